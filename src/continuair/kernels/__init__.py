"""Device code in Warp: dynamics, sensing, control and integrators; names of models and statuses."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.kernels.dynamics import PLANTS as PLANTS
    from continuair.kernels.dynamics import REFERENCE as REFERENCE
    from continuair.kernels.dynamics import SIMPLER as SIMPLER
    from continuair.kernels.sensing.sense import LawCode as LawCode
    from continuair.kernels.step import OK as OK
    from continuair.kernels.step import STATUS as STATUS
    from continuair.kernels.step import UNSEEN as UNSEEN

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "dynamics": ("PLANTS", "REFERENCE", "SIMPLER"),
        "sensing.sense": ("LawCode",),
        "step": ("OK", "STATUS", "UNSEEN"),
    },
)
