"""Effects of dividing one arm into more sections: modes, sag, decoupling, step and cost."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from time import process_time
from typing import Any

import numpy as np

from continuair.analysis.beam import beam_frequency
from continuair.analysis.modes import modes
from continuair.analysis.trim import trim
from continuair.engine.engine import Engine
from continuair.flight.frequencies import fastest_rate, first_frequency
from continuair.flight.simulate import simulate
from continuair.kernels.step import OK
from continuair.scenario.scenarios import Scenario
from continuair.studies.timing import flight_alone
from continuair.sweeps.hardware import machine
from continuair.sweeps.pairs import run_pairs
from continuair.typing import Method
from continuair.vehicle.vehicle import Vehicle

COUNTS = (1, 2, 3, 4)
"""Numbers of equal sections that the arm is cut into."""

LENGTH, STIFFNESS, MASS_PER_LENGTH, DAMPING_RATIO = 0.6, 0.5, 0.1, 0.03
"""The arm: length [m], E I [N m²], mass per length [kg/m], damping of the beam's first mode [-]."""

UAV = {"mass": 1.8, "inertia": (0.02, 0.02, 0.035)}
"""The vehicle that carries it [kg, kg m²]."""

BEAM_CONSTANT = 3.516015
"""ω l² √(μ/E I) of the first mode of a clamped uniform beam."""

SWAY, RATIO, DURATION = 0.2, 0.5, 3.0
"""The flight: a lateral force on the UAV of so many weights at so much of the beam's first clamped
frequency, for a time [s]."""

PHASES: dict[Method, float] = {"RK4": 0.2, "implicit": 0.05}
"""Fixed steps that are compared, times the fastest rate (RK4) or that of the first mode."""

_RTOL = 1e-6

LOADS = (0.01, 0.5, 2.0, 5.0)
"""Loads μ g l³/E I at which the level arm sags."""

_SAMPLE, _ROUNDS, _TIMED_STEPS = 0.01, 15, 20_000
# From straight down to straight ahead.
_LEVEL = (0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5))


def cut(count: int, *, level: bool = False) -> Vehicle:
    """Return the vehicle with its arm in equal sections; level: horizontal instead of down."""
    clamped = BEAM_CONSTANT * np.sqrt(STIFFNESS / MASS_PER_LENGTH) / LENGTH**2
    section = {
        "length": LENGTH / count,
        "bending_stiffness": STIFFNESS,
        "mass_per_length": MASS_PER_LENGTH,
        "damping": 2.0 * DAMPING_RATIO / clamped * STIFFNESS,
    }
    arm = {"section": [section] * count} | ({"attitude": _LEVEL} if level else {})
    return Vehicle(name=f"{count} sections", uav=UAV, arm=[arm])


def beam_constants() -> dict[str, float]:
    """Return the constants of the true beam's first mode, clamped and on the free vehicle."""
    arm = {"length": LENGTH, "bending_stiffness": STIFFNESS, "mass_per_length": MASS_PER_LENGTH}
    vehicle = Vehicle(name="beam", uav=UAV, arm=arm)
    return {
        base: constant(beam_frequency(vehicle, free=base == "free")) for base in ("clamped", "free")
    }


def constant(frequency: float) -> float:
    """Return ω l² √(μ/E I) of a frequency of the arm [rad/s]."""
    return float(frequency * LENGTH**2 * np.sqrt(MASS_PER_LENGTH / STIFFNESS))


def sag(count: int, load: float) -> float:
    """Return the sag of the level arm's tip below its base, over the length, at μ g l³/E I."""
    gravity = load * STIFFNESS / (MASS_PER_LENGTH * LENGTH**3)
    vehicle = cut(count, level=True)
    q = trim(vehicle, gravity=gravity).q
    still = Scenario("level", q, duration=1e-5, gravity=0.0)
    flight = simulate(vehicle, still, sample=1e-5, variables=["tip_position"])
    return float(-flight["tip_position"].to_numpy()[0].ravel()[2] / LENGTH)


def elastica_sag(load: float) -> float:
    """Return the exact rod's sag: E I θ'' = -μ g (l - s) cos θ, clamped and level at its base."""
    # Slow to import.
    from scipy.integrate import solve_bvp

    def slopes(s: Any, y: Any) -> Any:
        return np.stack([y[1], -load * (1.0 - s) * np.cos(y[0]), np.sin(y[0])])

    def ends(base: Any, tip: Any) -> Any:
        return np.array([base[0], tip[1], base[2]])

    s = np.linspace(0.0, 1.0, 101)
    found = solve_bvp(slopes, ends, s, np.zeros((3, len(s))), tol=1e-9)
    assert found.success
    return float(found.y[2, -1])


def sections(counts: Iterable[int] = COUNTS) -> dict[str, Any]:
    """Frequencies, sags, errors, steps and costs of every count, in order, and of the true beam.

    Frequencies as constants ω l² √(μ/E I), sags over the length, errors of the tip in arm lengths
    (RMS, in the flight of SWAY), steps [s]; processor's time per step and second of flight [s].
    """
    counts = tuple(sorted(set(counts)))
    rows = [_row(count) for count in counts]
    finest = rows[-1].pop("tip")
    for row in rows:
        tip = row.pop("tip", finest)
        off = np.linalg.norm(tip - finest, axis=-1)
        row["from_finest"] = float(np.sqrt(np.mean(off**2)) / LENGTH)
    times = _shortest({key: fly for row in rows for key, fly in row.pop("flights")})
    for row in rows:
        each = {name: times[row["count"], name] / _TIMED_STEPS for name in PHASES}
        row["step_s"] = each
        row["flight_s"] = {name: each[name] / row["step"][name] for name in PHASES}
    beam: dict[str, Any] = beam_constants() | {"sag": [elastica_sag(load) for load in LOADS]}
    return {"rows": rows, "beam": beam, "loads": list(LOADS), "machine": machine()}


def swayed(vehicle: Vehicle) -> Scenario:
    """Return the flight: the straight arm at rest, the weight compensated, a force on the UAV."""
    weight = 9.81 * vehicle.mass
    rate = RATIO * BEAM_CONSTANT * np.sqrt(STIFFNESS / MASS_PER_LENGTH) / LENGTH**2
    return Scenario(
        "sway",
        np.zeros(vehicle.layout.coordinates),
        duration=DURATION,
        force=lambda t: [SWAY * weight * np.sin(rate * t), 0.0, weight],
    )


def _row(count: int) -> dict[str, Any]:
    """Return the findings of one count, its flights to be timed, and its coupled tip."""
    vehicle = cut(count)
    scenario, steps = swayed(vehicle), _steps(vehicle)
    options: Any = {"sample": _SAMPLE, "variables": ["tip_position"]}
    flight = simulate(vehicle, scenario, rtol=_RTOL, **options)
    implicit = simulate(vehicle, scenario, method="implicit", step=steps["implicit"], **options)
    tip, other = (each["tip_position"].to_numpy().reshape(-1, 3) for each in (flight, implicit))
    pair = run_pairs(vehicle, scenario, ["decoupled"], sample=_SAMPLE, rtol=_RTOL)
    return {
        "count": count,
        "clamped": [
            constant(each) for each in modes(vehicle, base="clamped", gravity=0.0).frequencies[::2]
        ],
        "free": [constant(each) for each in modes(vehicle, gravity=0.0).frequencies[::2]],
        "sag": [sag(count, load) for load in LOADS],
        "decoupled": float(pair["rmse_t_m"].sel(model="decoupled")[0]) / LENGTH,
        "step": steps,
        "implicit_error": float(np.linalg.norm(other - tip, axis=-1).max() / LENGTH),
        "tip": tip,
        "flights": [((count, name), _timed(vehicle, name, step)) for name, step in steps.items()],
    }


def _steps(vehicle: Vehicle) -> dict[Method, float]:
    """Return the fixed step of each method [s]."""
    engine, straight = Engine(vehicle, "coupled"), np.zeros(vehicle.layout.coordinates)
    rates = {"RK4": fastest_rate, "implicit": first_frequency}
    return {name: phase / float(rates[name](engine, straight)[0]) for name, phase in PHASES.items()}


def _timed(vehicle: Vehicle, method: Method, step: float) -> Callable[[], None]:
    """Return a hover of so many steps, with everything else prepared."""
    straight = np.zeros(vehicle.layout.coordinates)
    lasts, weight = _TIMED_STEPS * step, 9.81 * vehicle.mass
    hover = Scenario("hover", straight, duration=lasts, force=[0.0, 0.0, weight])
    alone = flight_alone(vehicle, hover, "coupled", step=step, method=method)

    def fly() -> None:
        assert (alone() == OK).all(), "a flight that ends early cannot be timed"

    return fly


def _shortest(flights: dict[Any, Callable[[], None]]) -> dict[Any, float]:
    """Return the shortest processor time of every flight [s], taken in turns without overlap."""
    times: dict[Any, list[float]] = {key: [] for key in flights}
    for _ in range(_ROUNDS):
        for key, fly in flights.items():
            start = process_time()
            fly()
            times[key].append(process_time() - start)
    return {key: min(found) for key, found in times.items()}
