"""Vehicles of the tests with sections whose strain varies."""

from typing import Any

import continuair as ca

UAV: dict[str, Any] = {
    "mass": 1.5,
    "inertia": [[0.02, 0, 0], [0, 0.03, 0], [0, 0, 0.04]],
    "mount": [0, 0, 0],
}
MOUNT = [0.02, -0.01, -0.05]


def rod(nodes: int | None = None, **changes: Any) -> dict[str, Any]:
    """Return a section; further arguments: the orders of its strain, or its fields."""
    orders = {name: changes.pop(name) for name in ORDERS if name in changes}
    section: dict[str, Any] = {
        "length": 0.5,
        "radius": 0.006,
        "density": 1500.0,
        "youngs_modulus": 5e7,
    }
    section |= {"strain": orders} if orders else {}
    section |= {"nodes": nodes} if nodes else {}
    needs = "twist" in orders or "shear" in orders
    return section | ({"poisson_ratio": 0.25} if needs else {}) | changes


ORDERS = ("bending", "twist", "stretch", "shear")


def flying(*sections: dict[str, Any], **arm: Any) -> ca.Vehicle:
    """Return a vehicle whose arm has these sections."""
    given = {"section": list(sections), "mount": MOUNT} | arm
    return ca.Vehicle(name="strained", uav=UAV, arm=[given])
