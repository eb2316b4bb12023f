"""Kernel that compares packs with single runs, over all functions that packs need."""

from functools import cache
from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.options import OPTIONS


@wp.func_native("""
#ifdef __AVX512F__
return 1;
#else
return 0;
#endif
""")
def _wide() -> int: ...


@wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
def wide_registers(found: wp.array(dtype=wp.int32)):
    """Return 1 if the compiler uses vector registers of 512 bits, else 0."""
    found[0] = _wide()


TERMS, WIDTH = 4, 3
"""Shape of the tested tables: terms of WIDTH polynomials."""

PROBED = 12
"""Number of results per run."""


@cache
def probe_kernel(numbers: Numbers) -> tuple[Any, Any, Any]:
    """Return the kernel `probe`, and the types of its structs and rows.

    bodies: structs of an attitude and an inertia, one per run; table: as tables of moments; angles:
    (runs, 1); out: (runs, PROBED).
    """
    code, known = number_code(numbers), elementary_code(numbers)
    Cell, Real, lanes, above, finite = code.Cell, code.Real, code.lanes, code.above, code.finite
    vec3, mat33 = wp.types.vector(3, Real), wp.types.matrix((3, 3), Real)
    quat, Row = wp.types.quaternion(Real), wp.types.vector(WIDTH, Real)
    sine, cosine, angle_of, tanh = known.sine, known.cosine, known.angle_of, known.tanh
    of_run, keep_of_run, zero, one = code.of_run, code.keep_of_run, Real(0.0), Real(1.0)

    @wp.struct
    class Body:
        attitude: quat
        inertia: mat33

    Bodies, Table = code.rows_of(Body), code.table_of(Row)
    body_of, row_of = code.reader_of(Body), code.row_reader(Row)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def probe(
        bodies: Bodies, table: Table, angles: wp.array2d(dtype=Cell), out: wp.array2d(dtype=Cell)
    ):
        pack = wp.tid()
        run = pack * lanes
        body = body_of(bodies, run)
        angle = of_run(angles, run, 0)
        row = Row()
        for j in range(table.shape[1]):
            row = row * angle + row_of(table, pack, j)
        at = vec3(row[0], row[1], row[2])
        turned = wp.quat_rotate(body.attitude, body.inertia * at) + wp.cross(
            at, vec3(one, zero, angle)
        )
        for j in range(3):
            keep_of_run(out, run, j, turned[j])
            keep_of_run(out, run, 3 + j, at[j])
        keep_of_run(out, run, 6, sine(angle))
        keep_of_run(out, run, 7, cosine(angle))
        keep_of_run(out, run, 8, angle_of(angle, at[0]))
        keep_of_run(out, run, 9, tanh(angle))
        keep_of_run(out, run, 10, above(angle, zero, wp.length(turned), -one))
        keep_of_run(out, run, 11, finite(one / angle, wp.max(angle, one), wp.min(angle, zero)))

    return probe, Body, Row
