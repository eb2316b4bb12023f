"""All that acts on a vehicle, a file for each term, in the order in which device code sums them up.

Gravity, springs and dampers are in the recursion along the arms (kernels/dynamics.py).
"""

from continuair.terms.arm_drag import ArmDrag
from continuair.terms.paper_torques import PaperTorques
from continuair.terms.push import DirectPush
from continuair.terms.rotors import RotorThrusts
from continuair.terms.term import Stream, Term
from continuair.terms.tip_wrench import TipWrench
from continuair.terms.uav_drag import UavDrag
from continuair.vehicle.vehicle import Vehicle

TERMS: tuple[type[Term], ...] = (
    DirectPush,
    PaperTorques,
    RotorThrusts,
    UavDrag,
    ArmDrag,
    TipWrench,
)


def terms_of(vehicle: Vehicle) -> tuple[Term, ...]:
    """The terms that act on a vehicle."""
    found = (term.of(vehicle) for term in TERMS)
    return tuple(term for term in found if term is not None)


__all__ = [
    "TERMS",
    "ArmDrag",
    "DirectPush",
    "PaperTorques",
    "RotorThrusts",
    "Stream",
    "Term",
    "TipWrench",
    "UavDrag",
    "terms_of",
]
