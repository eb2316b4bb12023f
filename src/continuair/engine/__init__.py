"""Compilation of kernels for a vehicle, and their launches."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.engine.compiling import load as load
    from continuair.engine.compiling import made_once as made_once
    from continuair.engine.compiling import start_warp as start_warp
    from continuair.engine.lanes import structs as structs
    from continuair.engine.struct_types import numpy_type as numpy_type

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "compiling": (
            "load",
            "made_once",
            "start_warp",
        ),
        "lanes": ("structs",),
        "struct_types": ("numpy_type",),
    },
)
