"""Flights: simulation of a vehicle in a scenario, which gives a trajectory."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.flight.resolution import RESOLVED as RESOLVED
    from continuair.flight.resolution import angles_unread as angles_unread
    from continuair.flight.resolution import is_beyond_limits as is_beyond_limits
    from continuair.flight.resolution import overstated as overstated
    from continuair.flight.resolution import tells_rotation as tells_rotation
    from continuair.flight.resolution import unresolved as unresolved
    from continuair.flight.rotors import still as still

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "resolution": (
            "RESOLVED",
            "angles_unread",
            "is_beyond_limits",
            "overstated",
            "tells_rotation",
            "unresolved",
        ),
        "rotors": ("still",),
    },
)
