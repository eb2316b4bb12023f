"""All that acts on a vehicle, a file for each term, in the order in which device code sums them up.

Gravity, springs and dampers are in the recursion along the arms (kernels/dynamics.py).
"""

import numpy as np

from continuair.kernels.device import Device
from continuair.kernels.term_sum import Acting
from continuair.terms.arm_drag import ArmDrag
from continuair.terms.paper_torques import PaperTorques
from continuair.terms.push import DirectPush
from continuair.terms.rotor_drag import RotorDrag
from continuair.terms.rotors import RotorThrusts
from continuair.terms.term import Stream, Term, name_of
from continuair.terms.tip_wrench import TipWrench
from continuair.terms.uav_drag import UavDrag
from continuair.vehicle.vehicle import Vehicle

TERMS: tuple[type[Term], ...] = (
    DirectPush,
    PaperTorques,
    RotorThrusts,
    RotorDrag,
    UavDrag,
    ArmDrag,
    TipWrench,
)


def terms_of(vehicle: Vehicle) -> tuple[Term, ...]:
    """The terms that act on a vehicle: those of the list, then its own."""
    found = (term.of(vehicle) for term in TERMS)
    return (*(term for term in found if term is not None), *vehicle.terms)


def compiled_terms(vehicle: Vehicle) -> tuple[Term, ...]:
    """What kernels for a vehicle are made for: its terms without their numbers."""
    found: list[Term] = []
    first = 0
    for term in terms_of(vehicle):
        found.append(term.compiled(first))
        first += term.width
    return tuple(found)


def pack_terms(plants: np.ndarray, vehicle: Vehicle) -> None:
    """Fill the fields of structured plants (runs,) that terms read."""
    numbers = [np.empty((len(plants), 0))]
    for term in terms_of(vehicle):
        term.pack(plants, vehicle)
        numbers.append(term.values(len(plants)))
    packed = np.hstack(numbers)
    if packed.shape[1]:
        plants["term_numbers"] = packed


__all__ = [
    "TERMS",
    "Acting",
    "ArmDrag",
    "Device",
    "DirectPush",
    "PaperTorques",
    "RotorDrag",
    "RotorThrusts",
    "Stream",
    "Term",
    "TipWrench",
    "UavDrag",
    "compiled_terms",
    "name_of",
    "pack_terms",
    "terms_of",
]
