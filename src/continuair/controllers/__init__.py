"""Controllers: laws with their gains."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.controllers.gains import GAINS as GAINS

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "gains": ("GAINS",),
    },
)
