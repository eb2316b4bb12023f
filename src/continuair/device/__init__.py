"""Number types of device code, for single runs and packs of runs, and types built from them."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.device.options import OPTIONS as OPTIONS

__getattr__, __dir__, __all__ = lazy.names(__name__, {"options": ("OPTIONS",)})
