"""Parameters of vehicles: UAV, rotors, arms, sections and camera; layouts of states and inputs."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.vehicle.coordinates import continuous_euler as continuous_euler
    from continuair.vehicle.coordinates import paper_rates as paper_rates
    from continuair.vehicle.layout import COORDINATES as COORDINATES
    from continuair.vehicle.layout import FIELDS as FIELDS
    from continuair.vehicle.runs import per_run as per_run
    from continuair.vehicle.vehicle import as_rod as as_rod
    from continuair.vehicle.vehicle import check_has_arms as check_has_arms
    from continuair.vehicle.vehicle import check_one_section as check_one_section
    from continuair.vehicle.vehicle import check_single_vehicle as check_single_vehicle
    from continuair.vehicle.vehicle import is_paper as is_paper
    from continuair.vehicle.vehicle import vehicle_of_run as vehicle_of_run

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "coordinates": (
            "continuous_euler",
            "paper_rates",
        ),
        "layout": (
            "COORDINATES",
            "FIELDS",
        ),
        "runs": ("per_run",),
        "vehicle": (
            "as_rod",
            "check_has_arms",
            "check_one_section",
            "check_single_vehicle",
            "is_paper",
            "vehicle_of_run",
        ),
    },
)
