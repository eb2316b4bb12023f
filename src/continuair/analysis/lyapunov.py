"""Lyapunov functions of the paper's law: conditions on the gains, and values along a flight.

The paper's V = ½ q̇ᵀM q̇ + ½ e_aᵀK_p e_a need not decrease, even for a target at rest. The sound
one is

    V = ½ q̇ᵀM q̇ + elastic energy + ½ eᵀK_pC_p e + Σ (K_pC_s)_ii σ ln cosh(e_i/σ),

without the elastic energy if the law cancels the spring. With all conditions of "sound"
(`conditions.py`), V̇ = -ėᵀ(K_pC_d + K_d)ė - (d l + posture damping)|k̇|².
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.conditions import Condition, Gains, conditions_of
from continuair.analysis.metrics import samples
from continuair.analysis.motion import check_turns
from continuair.analysis.target_motion import largest_norms, norms_at
from continuair.controllers.servoing import law
from continuair.equations.camera import interaction_matrix, to_normalised
from continuair.errors import InputError, shown
from continuair.flight.labels import in_order
from continuair.flight.provenance import model_of
from continuair.flight.reading import BATCH_ROW
from continuair.scenario.scenarios import Scenario
from continuair.terms import name_of, terms_of
from continuair.typing import Array
from continuair.vehicle.layout import FIELDS
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

NEEDED = (
    *("attitude", "velocity", "angular_velocity", "bend", "bend_rate", "command"),
    *("kinetic_energy", "gravity_energy", "elastic_energy", "linear_momentum"),
    *("features", "feature_error", "depth", "in_view", "camera_twist", "camera_attitude"),
    "target_velocity",
)
"""Variables of a flight that `lyapunov` reads."""

_SAME_VELOCITY = 1e-6
"""Relative tolerance of equal target velocities."""

VARIABLES = {
    "lyapunov_paper": ("J", "½ q̇ᵀM q̇ + ½ e_aᵀK_p e_a"),
    "lyapunov_sound": ("J", "kinetic and elastic energy and the potential of the image errors"),
    "lyapunov_paper_rate": ("W", "rate of lyapunov_paper, by differences of samples"),
    "lyapunov_sound_rate": ("W", "rate of lyapunov_sound, by the power of command and damping"),
    "servo_error": ("1", "‖e_a‖, Eq. (16)"),
    "ultimate_radius": (
        "1",
        "radius of the proof's set for the target's motion now, λ = ‖K_p‖",
    ),
}
"""Variable over time -> (units, meaning)."""


@dataclass(frozen=True)
class Lyapunov:
    """Stability conditions and Lyapunov functions of a closed loop.

    Parameters
    ----------
    conditions : dict of str to tuple of Condition
        Conditions of the paper's "theorem" as printed, of its "proof" besides, and of the "sound"
        statement.
    bound : dict of str to float
        Result of `ultimate_bound`.
    over_time : xarray.Dataset
        `VARIABLES` over (..., time) of the flight; empty without one.
    """

    conditions: dict[str, tuple[Condition, ...]]
    bound: dict[str, float]
    over_time: xr.Dataset

    def broken(self, statement: str) -> tuple[Condition, ...]:
        """Return the conditions of a statement that do not hold.

        Parameters
        ----------
        statement : {"theorem", "proof", "sound"}
            The statement.

        Returns
        -------
        tuple of Condition
            The conditions.
        """
        return tuple(each for each in self.conditions[statement] if not each.holds)


def lyapunov(vehicle: Vehicle, scenario: Scenario, flight: xr.Dataset | None = None) -> Lyapunov:
    """Check the conditions of the stability proofs, and evaluate both V along a flight.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with an [arm] table.
    scenario : Scenario
        A scenario with one `servoing` controller of constant gains, and no other input.
    flight : xarray.Dataset, optional
        Flight of that vehicle and scenario: one run, or a batch with a target each.

    Returns
    -------
    Lyapunov
        Conditions with numbers, the ultimate bound and, with a flight, over (..., time):
        lyapunov_paper, V of Eqs. (18) and (19), and lyapunov_sound [J]; their rates [W];
        servo_error, ‖e_a‖; and ultimate_radius, of the proof's set for the target's motion at each
        time.

    Raises
    ------
    InputError
        If an argument cannot be used, or the flight is of another vehicle or scenario.

    Notes
    -----
    The rate of the sound V is from the power balance. That of the paper's V is from differences of
    samples, as a flight does not contain ë.
    """
    _check_paper_arm(check_single_vehicle(vehicle, strain=True))
    _check_powers(vehicle)
    gains = _gains_of(scenario)
    if flight is not None:
        _check_flight(vehicle, scenario, flight)
        flight = in_order(flight, vehicle)
        check_turns("attitude", samples(flight, "attitude", "quaternion"))
        _check_targets(scenario, flight)
        # The bound covers the target's motion for the whole flight.
        longest = max(scenario.duration, float(flight["time"][-1]))
        scenario = scenario.replace(duration=longest)
    return Lyapunov(
        conditions_of(vehicle, scenario, gains, flight),
        ultimate_bound(scenario),
        xr.Dataset() if flight is None else _over_time(vehicle, scenario, gains, flight),
    )


def errors(flight: xr.Dataset, vehicle: Vehicle, gains: Gains) -> tuple[Array, Array, Array]:
    """Return e, ė and e_a of a closed loop.

    Parameters
    ----------
    flight : xarray.Dataset
        Flight with a target.
    vehicle : Vehicle
        The vehicle, for its camera.
    gains : mapping of str to ndarray
        Gains of the law.

    Returns
    -------
    e : ndarray, shape (..., time, 2n)
        Feature error of Eq. (11), Amiri et al. (2026), in normalised image coordinates.
    e_dot : ndarray, shape (..., time, 2n)
        Its rate, Eq. (12) [1/s].
    e_a : ndarray, shape (..., time, 2n)
        Augmented error of Eq. (16).
    """
    e = samples(flight, "feature_error", "pixel") / np.tile(
        vehicle.camera.focal_length, flight.sizes["pixel"] // 2
    )
    seen = to_normalised(vehicle.camera, samples(flight, "features", "pixel"))
    L = interaction_matrix(seen, samples(flight, "depth", "point"))
    twist = samples(flight, "camera_twist", "twist").copy()
    moving = samples(flight, "target_velocity", "axis")
    twist[..., :3] -= _in_axes(samples(flight, "camera_attitude", "quaternion"), moving)
    e_dot = -(L @ twist[..., None])[..., 0]
    sliding = np.tanh(e / gains["sigma"])
    return e, e_dot, e_dot @ gains["Cd"].T + e @ gains["Cp"].T + sliding @ gains["Cs"].T


def ultimate_bound(scenario: Scenario, run: int | None = None) -> dict[str, float]:
    """Return the ultimate bound on ‖e_a‖ of the paper's proof.

    Parameters
    ----------
    scenario : Scenario
        A scenario with a `servoing` controller.
    run : int, optional
        Run of a batch of targets. Default: all together.

    Returns
    -------
    dict of str to float
        Largest speed, acceleration and jerk of the targets, `r_max`, `radius_least` and
        `radius_provable`. inf if an acceleration or a jerk has no bound.

    Notes
    -----
    The radius is ‖K_p‖ R_max / (√2 λ). The proof does not give λ: `radius_least` uses the largest
    possible value, ‖K_p‖, and `radius_provable` λ_min(K_p). R_max adds terms of different units, as
    printed.
    """
    assert scenario.controller is not None
    gains = scenario.controller.gains
    largest = largest_norms(scenario)[slice(None) if run is None else [run]]
    L1, L2, L3 = (float(each) for each in largest.max(axis=0))
    r_max = float(_residual(gains, L2, L3))
    K_p, smallest = np.linalg.norm(gains["Kp"], 2), np.linalg.eigvalsh(gains["Kp"])[0]
    return {
        "target_speed_m_s": L1,
        "target_acceleration_m_s2": L2,
        "target_jerk_m_s3": L3,
        "r_max": r_max,
        "radius_least": float(r_max / np.sqrt(2.0)),
        "radius_provable": float(K_p * r_max / (np.sqrt(2.0) * smallest)),
    }


def _residual(gains: Gains, acceleration: float | Array, jerk: float | Array) -> Array:
    """Return the proof's bound on ‖r‖, R_max: ‖C_d‖ ‖v̈_t‖ + (‖C_p‖ + ‖C_s‖/σ) ‖v̇_t‖."""
    C_p, C_d, C_s = (np.linalg.norm(gains[name], 2) for name in ("Cp", "Cd", "Cs"))
    # Without C_d, the jerk may be unbounded.
    slope = (C_p + C_s / gains["sigma"]) * acceleration
    return np.asarray((C_d * jerk if C_d > 0.0 else 0.0) + slope)


def other_powers(vehicle: Vehicle) -> list[str]:
    """Return the terms of a vehicle whose power the Lyapunov functions omit.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.

    Returns
    -------
    list of str
        Names of the terms.
    """
    return [name_of(term) for term in terms_of(vehicle) if term.has_power]


def _check_paper_arm(vehicle: Vehicle) -> None:
    """Raise InputError for a section whose strain varies: the theorem is of the paper's one arc."""
    if vehicle.layout.strains:
        raise InputError(
            "strain",
            "of a section varies, but the theorem and both V are of the paper's arm, one arc",
            "give the vehicle an [arm] table, with bending = 0 if it has a strain",
        )


def _check_powers(vehicle: Vehicle) -> None:
    """Raise InputError for a vehicle with a term whose power V does not include."""
    for name in other_powers(vehicle):
        raise InputError(
            "vehicle",
            f"{shown(vehicle.name)} has {name}, whose power the Lyapunov functions omit",
            "remove it",
        )


def _gains_of(scenario: Scenario) -> dict[str, Array]:
    """Return the constant gains of a scenario's controller, or raise InputError."""
    controller = scenario.controller if isinstance(scenario, Scenario) else None
    if controller is None or controller.law is not law:
        name = shown(scenario) if controller is None else f"has the controller {controller.name}"
        raise InputError(
            "scenario",
            name,
            "give a Scenario whose controller is one of continuair.servoing with constant gains",
        )
    if controller.integral:
        raise InputError(
            "scenario",
            (
                f"has a controller with integral {controller.integral:g}, which the "
                "Lyapunov functions omit"
            ),
            "give one without",
        )
    if controller.believes is not None:
        raise InputError(
            "scenario",
            (
                "has a controller with the nominal model "
                f"{shown(controller.believes.name)}, which the Lyapunov functions omit"
            ),
            "give one without",
        )
    if controller.runs is not None:
        raise InputError(
            "scenario",
            f"has a controller of {controller.runs} runs",
            "give one with the gains of one run",
        )
    for field in FIELDS:
        if getattr(scenario, field) is not None:
            raise InputError(
                "scenario",
                f"has {field} beside its controller, whose power the Lyapunov functions omit",
                "remove it",
            )
    return {name: np.asarray(value, float) for name, value in controller.gains.items()}


def _check_flight(vehicle: Vehicle, scenario: Scenario, flight: object) -> None:
    """Raise InputError unless a flight is of this vehicle and scenario."""
    if not isinstance(flight, xr.Dataset):
        raise InputError("flight", f"is {shown(flight)}", "give a Dataset that simulate returned")
    missing = [name for name in NEEDED if name not in flight.variables]
    if missing:
        raise InputError(
            "flight", f"has no {', '.join(missing)}", "simulate it with these variables"
        )
    flown = flight.attrs.get("vehicle")
    if flown is not None and json.loads(flown) != json.loads(json.dumps(vehicle.describe())):
        raise InputError(
            "flight",
            f"is of another vehicle than {shown(vehicle.name)}",
            "give the vehicle that was simulated",
        )
    targets, runs = (
        len(scenario.targets),
        flight["kinetic_energy"].transpose(..., "time").shape[:-1],
    )
    if targets > 1 and runs[-1:] != (targets,):
        raise InputError(
            "flight",
            f"has {runs[-1] if runs else 1} runs, but scenario has {targets} targets",
            "give all runs of that scenario",
        )
    rows = flight.coords.get(BATCH_ROW)
    if targets > 1 and rows is not None and not np.array_equal(rows, np.arange(targets)):
        raise InputError(
            "flight",
            (
                f"has the runs {shown(rows.to_numpy().tolist())} of its batch, but "
                f"scenario has {targets} targets"
            ),
            "give all its runs, in order",
        )
    given = flight.attrs.get("scenario")
    if given is not None:
        _check_scenario(json.loads(given), json.loads(json.dumps(scenario.describe())))


def _check_targets(scenario: Scenario, flight: xr.Dataset) -> None:
    """Raise InputError if targets moved differently; the names of their paths may be the same."""
    time, flown = flight["time"].to_numpy(), samples(flight, "target_velocity", "axis")
    given = np.squeeze([target.path(time)[1] for target in scenario.targets])
    apart = np.abs(flown - given).max()
    if not apart <= _SAME_VELOCITY * np.abs([flown, np.broadcast_to(given, flown.shape)]).max():
        raise InputError(
            "flight",
            f"has a target velocity up to {apart:.3g} m/s off that of scenario",
            "give the scenario that was simulated",
        )


def _check_scenario(flown: dict[str, Any], given: dict[str, Any]) -> None:
    """Raise InputError if a flight is of another scenario.

    Name, duration and initial rotor thrusts may differ.
    """
    for field in sorted(given.keys() - {"name", "duration", "rotor_thrust", "rotor_command"}):
        if flown.get(field) != given[field]:
            raise InputError(
                "flight",
                (
                    f"is of a scenario whose {field} is {shown(flown.get(field))}, not "
                    f"{shown(given[field])}"
                ),
                "give the scenario that was simulated",
            )


def _over_time(
    vehicle: Vehicle, scenario: Scenario, gains: Gains, flight: xr.Dataset
) -> xr.Dataset:
    """Return the variables of VARIABLES over (..., time)."""
    kinetic, elastic = (
        flight[name].transpose(..., "time") for name in ("kinetic_energy", "elastic_energy")
    )
    e, e_dot, e_a = errors(flight, vehicle, gains)
    springs, springs_rate = _image_springs(gains, e, e_dot)
    paper = kinetic.to_numpy() + 0.5 * _form(e_a, gains["Kp"])
    values = {
        "lyapunov_paper": paper,
        "lyapunov_sound": (kinetic + (1.0 - gains["spring"]) * elastic).to_numpy() + springs,
        "lyapunov_paper_rate": np.gradient(paper, flight["time"].to_numpy(), axis=-1),
        "lyapunov_sound_rate": _power(vehicle, scenario, gains, flight) + springs_rate,
        "servo_error": np.linalg.norm(e_a, axis=-1),
        "ultimate_radius": _radius(scenario, gains, flight["time"].to_numpy()),
    }
    return xr.Dataset(
        {
            name: (kinetic.dims, np.broadcast_to(found, kinetic.shape), _attributes(name))
            for name, found in values.items()
        },
        kinetic.coords,
    )


def _attributes(name: str) -> dict[str, str]:
    """Return the attributes of a variable."""
    units, meaning = VARIABLES[name]
    return {"units": units, "long_name": meaning}


def _image_springs(gains: Gains, e: Array, e_dot: Array) -> tuple[Array, Array]:
    """Return the potential [J] of the law's forces on e, and its rate [W]."""
    σ = float(gains["sigma"])
    linear = gains["Kp"] @ gains["Cp"]
    sliding = np.diag(gains["Kp"] @ gains["Cs"])
    stored = 0.5 * _form(e, linear) + σ * _ln_cosh(e / σ) @ sliding
    pull = e @ (linear + linear.T) / 2 + sliding * np.tanh(e / σ)
    return stored, (e_dot * pull).sum(-1)


def _power(vehicle: Vehicle, scenario: Scenario, gains: Gains, flight: xr.Dataset) -> Array:
    """Return the rate of the kinetic energy, with the elastic energy that the law does not cancel
    [W].

    The power of the command, less that of lifting the weight, of bending a spring that the law
    cancels, and of damping in the arm.
    """
    command = samples(flight, "command", "actuator")
    bend, bend_rate = (samples(flight, name, "bend_axis") for name in ("bend", "bend_rate"))
    force = _in_axes(samples(flight, "attitude", "quaternion"), command[..., :3])
    given = (force * samples(flight, "velocity", "axis")).sum(-1)
    given += (command[..., 3:6] * samples(flight, "angular_velocity", "axis")).sum(-1)
    given += (command[..., 6:] * bend_rate).sum(-1)
    arm = vehicle.arm
    bending = arm.bending_stiffness * arm.length * (bend * bend_rate).sum(-1)
    lost = arm.structural_damping * arm.length * (bend_rate**2).sum(-1)
    return given - _lifting(scenario, flight) - gains["spring"] * bending - lost


def _lifting(scenario: Scenario, flight: xr.Dataset) -> Array:
    """Return the rate of the potential energy of gravity [W]: upward momentum times g.

    For the independent model, whose arm is on a base of its own, by differences of samples.
    """
    if model_of(flight) == "independent":
        energy = flight["gravity_energy"].transpose(..., "time").to_numpy()
        return np.gradient(energy, flight["time"].to_numpy(), axis=-1)
    return scenario.gravity * samples(flight, "linear_momentum", "axis")[..., 2]


def _radius(scenario: Scenario, gains: Gains, time: Array) -> Array:
    """Return the radius √(δ/λ) of the proof's set for each target's motion at times, λ = ‖K_p‖."""
    norms = norms_at(scenario, time)
    return np.squeeze(_residual(gains, norms[:, 1], norms[:, 2]) / np.sqrt(2.0))


def _in_axes(attitude: Array, v: Array) -> Array:
    """Return world vectors (..., 3) in the axes of an attitude (..., 4), x y z w, body to world."""
    axis, w = attitude[..., :3], attitude[..., 3:]
    t = 2.0 * np.cross(v, axis)
    return np.asarray(v + w * t + np.cross(t, axis))


def _form(v: Array, A: Array) -> Array:
    """Return vᵀA v over the last axis."""
    return np.einsum("...i,ij,...j->...", v, A, v)


def _ln_cosh(x: Array) -> Array:
    """Return ln cosh x without overflow."""
    size = np.abs(x)
    return np.asarray(size + np.log1p(np.exp(-2.0 * size)) - np.log(2.0))
