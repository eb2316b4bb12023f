"""Analysis of vehicles and flights: metrics, model differences, modes, Lyapunov functions."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.analysis.convergence import CONVERGED as CONVERGED
    from continuair.analysis.convergence import RTOL as RTOL
    from continuair.analysis.convergence import SAMPLE as SAMPLE
    from continuair.analysis.convergence import Entries as Entries
    from continuair.analysis.convergence import Flown as Flown
    from continuair.analysis.convergence import compared_models as compared_models
    from continuair.analysis.convergence import entries_of as entries_of
    from continuair.analysis.determinacy import fly_twice as fly_twice
    from continuair.analysis.excited import excited_arm as excited_arm
    from continuair.analysis.linear import bending_frequencies as bending_frequencies
    from continuair.analysis.lyapunov import NEEDED as NEEDED
    from continuair.analysis.lyapunov import Lyapunov as Lyapunov
    from continuair.analysis.lyapunov import errors as errors
    from continuair.analysis.lyapunov import other_powers as other_powers
    from continuair.analysis.lyapunov import ultimate_bound as ultimate_bound
    from continuair.analysis.mass import centre_of_mass as centre_of_mass
    from continuair.analysis.mass import mass_distribution as mass_distribution
    from continuair.analysis.mass import straight_arm_inertia as straight_arm_inertia
    from continuair.analysis.metrics import TRANSIENT as TRANSIENT
    from continuair.analysis.metrics import at_camera as at_camera
    from continuair.analysis.metrics import differences as differences
    from continuair.analysis.metrics import feature_norm as feature_norm
    from continuair.analysis.metrics import feature_rms as feature_rms
    from continuair.analysis.metrics import geodesic_angle as geodesic_angle
    from continuair.analysis.metrics import joint_speed as joint_speed
    from continuair.analysis.metrics import norm_difference as norm_difference
    from continuair.analysis.metrics import nrmse as nrmse
    from continuair.analysis.metrics import regular_speed as regular_speed
    from continuair.analysis.metrics import rotation_metric as rotation_metric
    from continuair.analysis.metrics import samples as samples
    from continuair.analysis.metrics import tip_euler as tip_euler
    from continuair.analysis.shares import percent as percent

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "convergence": (
            "CONVERGED",
            "Entries",
            "Flown",
            "RTOL",
            "SAMPLE",
            "compared_models",
            "entries_of",
        ),
        "determinacy": ("fly_twice",),
        "excited": ("excited_arm",),
        "linear": ("bending_frequencies",),
        "lyapunov": (
            "Lyapunov",
            "NEEDED",
            "errors",
            "other_powers",
            "ultimate_bound",
        ),
        "mass": (
            "centre_of_mass",
            "mass_distribution",
            "straight_arm_inertia",
        ),
        "metrics": (
            "TRANSIENT",
            "at_camera",
            "differences",
            "feature_norm",
            "feature_rms",
            "geodesic_angle",
            "joint_speed",
            "norm_difference",
            "nrmse",
            "regular_speed",
            "rotation_metric",
            "samples",
            "tip_euler",
        ),
        "shares": ("percent",),
    },
)
