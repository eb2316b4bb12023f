"""What device code is written with: numbers of single runs and of packs, and types made of them."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.device.options import OPTIONS as OPTIONS

__getattr__, __dir__, __all__ = lazy.names(__name__, {"options": ("OPTIONS",)})
