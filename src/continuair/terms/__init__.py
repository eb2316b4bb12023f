"""Forces on a vehicle, one file per term, in the order in which device code adds them.

Gravity, elasticity and structural damping are part of the dynamics (kernels/dynamics.py).
"""

import numpy as np

from continuair.kernels.device import Device
from continuair.kernels.term_sum import Acting
from continuair.terms.actuator_wrench import ActuatorWrench
from continuair.terms.arm_drag import ArmDrag
from continuair.terms.contact import Contact
from continuair.terms.paper_torques import PaperTorques
from continuair.terms.payload import CarriedBody
from continuair.terms.rotor_drag import RotorDrag
from continuair.terms.rotors import RotorThrusts
from continuair.terms.tendons import Tendons
from continuair.terms.term import Stream, Term, name_of
from continuair.terms.tip_wrench import TipWrench
from continuair.terms.uav_drag import UavDrag
from continuair.vehicle.vehicle import Vehicle

TERMS: tuple[type[Term], ...] = (
    ActuatorWrench,
    PaperTorques,
    RotorThrusts,
    RotorDrag,
    UavDrag,
    ArmDrag,
    TipWrench,
    Tendons,
)


def terms_of(vehicle: Vehicle) -> tuple[Term, ...]:
    """Return the terms that act on a vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle, plain or batched.

    Returns
    -------
    tuple of Term
        Terms of the list TERMS that apply, then the vehicle's own.
    """
    found = (term.of(vehicle) for term in TERMS)
    return (*(term for term in found if term is not None), *vehicle.terms)


def compiled_terms(vehicle: Vehicle) -> tuple[Term, ...]:
    """Return the terms of a vehicle as kernels are compiled for them, without their numbers.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle, plain or batched.

    Returns
    -------
    tuple of Term
        The terms, equal for vehicles that differ only in numbers of the terms.
    """
    found: list[Term] = []
    first = 0
    for term in terms_of(vehicle):
        found.append(term.compiled(first))
        first += term.width
    return tuple(found)


def pack_terms(plants: np.ndarray, vehicle: Vehicle) -> None:
    """Fill the fields of the device's Plant that terms read.

    Parameters
    ----------
    plants : structured ndarray, shape (runs,)
        Parameters of the vehicles, changed in place.
    vehicle : Vehicle
        The vehicle whose terms are packed.
    """
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
    "CarriedBody",
    "Contact",
    "Device",
    "ActuatorWrench",
    "PaperTorques",
    "RotorDrag",
    "RotorThrusts",
    "Stream",
    "Tendons",
    "Term",
    "TipWrench",
    "UavDrag",
    "compiled_terms",
    "name_of",
    "pack_terms",
    "terms_of",
]
