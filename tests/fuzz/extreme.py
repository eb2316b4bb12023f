"""Flights at the edge: light vehicles, large bends, fast spins, strong inputs, long tumbles."""

from pathlib import Path
from typing import Any

import numpy as np

import continuair as ca
from tests.fuzz.rules import check_flight, require

Rng = np.random.Generator

MOST_STEPS = 40_000
"""Longer flights are left out."""

_LONG = 0.2
"""Share of the flights that last for long."""


def extreme_flights(rng: Rng, folder: Path) -> None:
    """One whose step_error is below 1e-3 is off by no more than 1e-2 arm lengths."""
    vehicle, scenario = _long(rng) if rng.random() < _LONG else _short(rng)
    sample = scenario.duration / int(rng.choice([60, 1000, 10_000]))
    flight = ca.simulate(vehicle, scenario, sample=sample)
    check_flight(flight)
    step = float(flight.attrs["step"])
    if float(flight["step_error"]) > 1e-3 or scenario.duration > MOST_STEPS * step:
        return
    finer = ca.simulate(
        vehicle, scenario, sample=sample, step=step / 12.0, variables=["tip_position"]
    )
    if _apart(flight, finer, vehicle) > 1e-2:
        exact = ca.simulate(
            vehicle, scenario, sample=sample, integrator="dop853", tolerance=1e-10,
            variables=["tip_position"],
        )  # fmt: skip
        off = _apart(flight, exact, vehicle)
        require(off < 1e-2, f"off by {off:.2g}, told {float(flight['step_error']):.2g}")


def _apart(flight: Any, other: Any, vehicle: ca.Vehicle) -> float:
    apart = np.linalg.norm(flight["tip_position"] - other["tip_position"], axis=1)
    return float(np.nanmax(apart) / np.max(vehicle.reach))


def _short(rng: Rng) -> tuple[ca.Vehicle, ca.Scenario]:
    vehicle = _vehicle(rng)
    return vehicle, _scenario(rng, vehicle)


def _long(rng: Rng) -> tuple[ca.Vehicle, ca.Scenario]:
    """A limp arm of one section or two, below its UAV or on top of it, which a force carries: it
    swings, or tumbles, for so long that errors may multiply."""
    sections, below, mass = int(rng.integers(1, 3)), rng.random() < 0.5, _log(rng, 0.5, 4.0)
    chain: list[dict[str, Any]] = [
        {
            "name": f"s{i}",
            "length": float(rng.uniform(0.2, 0.6)),
            "mass_per_length": _log(rng, 0.01, 0.15),
            "bending_stiffness": _log(rng, 0.01, 1.0),
            "damping_ratio": float(rng.choice([0.0, 0.005, 0.03])),
        }
        for i in range(sections)
    ]
    arm = {
        "mount": [0.0, 0.0, -0.05 if below else 0.05],
        "attitude": [0.0, 0.0, 0.0, 1.0] if below else [1.0, 0.0, 0.0, 0.0],
        "section": chain,
        "tip": {"mass": _log(rng, 0.02, 0.3), "centre": [0, 0, 0.02], "inertia": [2e-5] * 3},
    }
    uav = {"mass": mass, "inertia": (mass * np.array([0.01, 0.012, 0.018])).tolist()}
    vehicle = ca.Vehicle(name="long", uav=uav, arm=[arm])
    bends = [[rng.uniform(0, 2.0) / each["length"], rng.uniform(-3, 3)] for each in chain]
    q = np.concatenate([[0, 0, 5, *rng.normal(size=3) * 0.05], *bends])
    rates = np.zeros(len(q))
    rates[3:6] = 0.3 * rng.normal(size=3)
    carried = [0.0, 0.0, 9.81 * float(vehicle.mass)]
    return vehicle, ca.Scenario("long", q, rates, force=carried, duration=_log(rng, 5.0, 40.0))


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _vehicle(rng: Rng) -> ca.Vehicle:
    length, mass = _log(rng, 0.2, 1.6), _log(rng, 0.1, 8.0)
    points = rng.normal(size=(8, 3)) * [1.0, 1.0, 0.5] * rng.uniform(0.05, 0.4)
    inertia = mass * (np.sum(points**2) * np.eye(3) - points.T @ points) / 8.0
    return ca.load_vehicle("paper").replace(
        {
            "arm.length": length,
            "arm.radius": length * _log(rng, 1e-3, 1e-2),
            "arm.youngs_modulus": _log(rng, 1e9, 2e11),
            "arm.damping_ratio": float(rng.choice([0.0, 0.0, 0.01, 0.05, 0.3, 1.0, 3.0])),
            "uav.mass": mass,
            "uav.inertia": inertia.tolist(),
            "uav.mount": rng.uniform(-0.1, 0.1, 3).tolist(),
        }
    )


def _scenario(rng: Rng, vehicle: ca.Vehicle) -> ca.Scenario:
    arm, weight = vehicle.arm, 10.0 * vehicle.mass
    angle = rng.choice([rng.uniform(0, 0.5), rng.uniform(0, 3), rng.uniform(3, 6.2)])
    q = [0, 0, 0, *rng.uniform(-1.2, 1.2, 3), angle / arm.length, rng.uniform(-3, 3)]
    spin = rng.choice([0.0, 0.0, 3.0, 15.0]) * rng.normal(size=3)
    bending = rng.integers(2) * rng.normal() * 0.3 * arm.clamped_frequency / arm.length
    inputs: dict[str, Any] = {}
    for name, scale, width, chance in (
        ("force", weight, 3, 0.5),
        ("moment", 0.1 * weight * arm.length, 3, 0.4),
        ("bend_moment", 0.5 * arm.bending_stiffness, 2, 0.3),
    ):
        if rng.random() < chance:
            inputs[name] = _wave(rng, scale, width)
    gravity, duration = float(rng.choice([0.0, 9.81])), _log(rng, 0.2, 3.0)
    rates = [*rng.normal(size=3), *spin, bending, 0.0]
    return ca.Scenario("extreme", q, rates, gravity=gravity, duration=duration, **inputs)


def _wave(rng: Rng, scale: float, width: int) -> Any:
    offset, amplitude = scale * rng.normal(size=(2, width))
    rate = 2.0 * np.pi * _log(rng, 0.3, 30.0)
    return lambda t: offset + amplitude * np.sin(rate * t)
