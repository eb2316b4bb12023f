"""Types of structs for NumPy."""

from typing import Any, cast

import numpy as np

from continuair.engine import numpy_type, start_warp


def test_a_struct_has_the_type_that_warp_describes() -> None:
    start_warp()
    import warp as wp

    @wp.struct
    class Inner:
        place: wp.vec3d
        there: wp.bool

    @wp.struct
    class Outer:
        count: wp.int32
        inertia: wp.mat33d
        attitude: wp.quatd
        inner: Inner
        mass: wp.float32

    assert numpy_type(Outer) == np.dtype(cast("Any", Outer).numpy_dtype())
