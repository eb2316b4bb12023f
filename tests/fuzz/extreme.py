"""Flights at the edge: light vehicles, large bends, fast spins, strong inputs, long tumbles, and
slow loops around slung loads."""

from pathlib import Path
from typing import Any

import numpy as np

import continuair as ca
from tests.fuzz.rules import check_flight, require

Rng = np.random.Generator

MOST_STEPS = 40_000
"""Longer flights are left out."""

_LONG, _LOOPED, _LOADED = 0.2, 0.15, 0.25
"""Shares of the flights that last for long, in which a flight controller holds a load, and in which
wind, falls and pulls at the tip load light arms."""


def extreme_flights(rng: Rng, folder: Path) -> None:
    """One whose error_estimate is below 1e-3 is off by no more than 1e-2 arm lengths, and ends as a
    finer one does."""
    chance = rng.random()
    if chance < _LOOPED:
        return _try(*_loop(rng), 0.02)
    kinds = ((_LOOPED + _LONG, _long), (_LOOPED + _LONG + _LOADED, _loaded), (1.0, _short))
    vehicle, scenario = next(make for share, make in kinds if chance <= share)(rng)
    sample = scenario.duration / int(rng.choice([60, 1000, 10_000]))
    _try(vehicle, scenario, sample)


def _try(vehicle: ca.Vehicle, scenario: ca.Scenario, sample: float) -> None:
    """Fly as a user does; two references that agree tell the error."""
    flight = ca.simulate(vehicle, scenario, sample=sample, check=True)
    check_flight(flight)
    told = float(flight["error_estimate"])
    if told > 1e-3 or int(flight["steps"]) > MOST_STEPS:
        return
    options: dict[str, Any] = {"sample": sample, "variables": ["tip_position"]}
    exact, reference = (
        ca.simulate(vehicle, scenario, rtol=rtol, **options) for rtol in (1e-10, 1e-11)
    )
    if _apart(exact, reference, vehicle) < 1e-4:
        off = _apart(flight, reference, vehicle)
        require(off < 1e-2, f"off by {off:.2g}, told {told:.2g}")
        require(int(flight["status"]) == int(reference["status"]), "another status")


def _loop(rng: Rng) -> tuple[ca.Vehicle, ca.Scenario]:
    """A load that hangs on a limp arm, under a flight controller that leaves the arm free."""
    mass, length = _log(rng, 0.5, 2.0), float(rng.uniform(0.4, 1.5))
    load = {"position": length, "mass": mass * float(rng.uniform(0.1, 1.0)), "inertia": [1e-4] * 2}
    vehicle = ca.load_vehicle("slender").replace(
        {
            "uav.mass": mass,
            "uav.inertia": [0.012 * mass, 0.012 * mass, 0.023 * mass],
            "arm.length": length,
            "arm.youngs_modulus": 207e9 / _log(rng, 20.0, 1000.0),
            "arm.damping_ratio": float(rng.choice([0.0, 0.01, 0.05])),
            "arm.disks": [load],
        }
    )
    rate, latency = float(rng.choice([50.0, 100.0, 250.0])), float(rng.choice([0.0, 0.005, 0.02]))
    law = ca.flight_controller(vehicle, bend_bandwidth=0.0, rate=rate, latency=latency)
    tilt, spin, angle = [(0.4, 0.5, 0.8), (0.8, 1.0, 1.2)][rng.integers(2)]
    q = [0, 0, 3, *rng.uniform(-tilt, tilt, 2), 0, rng.uniform(0, angle) / length, 0]
    q[7] = rng.uniform(-3, 3)
    rates = [0, 0, 0, *spin * rng.normal(size=3), 0, 0]
    return vehicle, ca.Scenario("loop", q, rates, controller=law, duration=_log(rng, 5.0, 30.0))


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


def _loaded(rng: Rng) -> tuple[ca.Vehicle, ca.Scenario]:
    """A light arm, thick or thin, limp or stiff, with a weight at its tip or none: in a wind, a
    gust or a fall, or pulled at its tip."""
    length, mass = _log(rng, 0.2, 1.2), _log(rng, 0.3, 6.0)
    per_length, rate = _log(rng, 1e-3, 0.3), _log(rng, 3.0, 100.0)
    arm: dict[str, Any] = {
        "length": length,
        "mass_per_length": per_length,
        "bending_stiffness": rate**2 * per_length * length**4 / 20.0,
        "radius": min(_log(rng, 2e-3, 2.5e-2), length / 4),
        "damping_ratio": _log(rng, 1e-3, 0.5),
        "drag_coefficient": float(rng.uniform(0.6, 1.6)),
    }
    if rng.random() < 0.3:
        arm["disks"] = [{"position": length, "mass": _log(rng, 1e-3, 0.1)}]
    uav = {"mass": mass, "inertia": (mass * np.array([0.015, 0.018, 0.03])).tolist()}
    vehicle = ca.Vehicle(name="loaded", uav={**uav, "mount": [0.0, 0.0, -0.05]}, arm=arm)
    weight, load = 9.81 * float(vehicle.mass), int(rng.integers(4))
    inputs: dict[str, Any] = {"force": [0.0, 0.0, weight * rng.uniform(0.5, 1.3)]}
    if load == 0:
        inputs["wind"] = (10.0 * rng.normal(size=3)).tolist()
    elif load == 1:
        inputs["wind"] = ca.gust(12.0 * rng.normal(size=3), 0.2, _log(rng, 0.03, 1.0))
    elif load == 2:
        inputs["tip_wrench"] = [*weight * _log(rng, 0.02, 1.5) * rng.normal(size=3), 0, 0, 0]
    else:
        inputs = {}
    bend = rng.choice([rng.uniform(0, 0.5), rng.uniform(0, 4.0)]) / length
    rates = [*(5.0 * rng.integers(2) * rng.normal(size=3)), 0, 0, 0, 0, 0]
    q = [0, 0, 3, 0, 0, 0, bend, rng.uniform(-3, 3)]
    return vehicle, ca.Scenario("loaded", q, rates, duration=1.0, **inputs)


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
