"""Flights under the paper's Theorem 1: gains that satisfy it, from starts near and far.

Three points, as 6×6 gains require; continuous control, all of G cancelled, an arm without damping,
as in Eq. (10), and an image without an edge. The paper prints no gains, no points and no starts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair import Scenario, Target, Vehicle, design, lyapunov, paths, servoing, simulate
from continuair.analysis import NEEDED, RTOL, Lyapunov, feature_norm, samples
from continuair.equations import facing, image_jacobian, mass_matrix
from continuair.errors import InputError, shown
from continuair.flight import RESOLVED
from continuair.warning import untold

Array = np.ndarray
Gains = dict[str, Any]

POINTS, SIZE = 3, 6
"""Number of points, and of rows of the image and of the gains."""

BANDWIDTH = 2.0
"""Of the gains that are made for the image [rad/s]: their slowest motion decays at 1 1/s."""

RANGES = {"Kp": (1, 100), "Kd": (0.01, 1), "Cp": (0.1, 10), "Cd": (0.01, 1), "Cs": (1e-3, 0.1)}
"""Eigenvalues of gains drawn at random: log-uniform over two decades, in random directions."""

SIGMA = 0.02
"""Width of tanh with gains drawn at random, normalised image."""

DRAWS, SEED = 200, 1

SLIDING = 0.1
"""K_p C_s of gains drawn for the sound statement, times one: a C_s of the range above."""

SPEED = 0.05
"""Of the target with constant velocity [m/s]."""

UNSTABLE_SETS, FAST = 4, 10.0
"""Sets that are flown: the first drawn whose error grows from the desired image by more [1/s]."""

STARTS = 8
"""Starts per set."""


@dataclass(frozen=True)
class Pace:
    """How long flights are, and how often sampled [s]."""

    duration: float
    sample: float


MADE, DRAWN = Pace(12.0, 1e-2), Pace(2.0, 1e-3)
"""Of gains made for the image, and drawn at random: most of those flights end early."""

ALIKE = 0.01
"""Share of its time by which an early end may move at a tenth of the tolerance."""

OFFSETS = (0.2, 0.2, 0.2, 0.05, 0.05, 0.2, 0.1, np.pi)
"""Largest offsets of q at the farthest start [m, rad, 1/m, rad]; those of ψa at every start."""

LEAST_BEND = 0.02
"""Of every start, as ψa has no meaning for a straight arm [1/m]."""

LAST = 0.2
"""Final share of a flight in which the remaining error is evaluated."""

_UPRIGHT = 1e-3
"""Cosine of the pitch below which the matrices of the paper's coordinates are singular."""

_EDGELESS = {"camera.image_size": [1_000_000, 1_000_000], "camera.principal_point": [5e5, 5e5]}
_UNDAMPED = {"arm.damping": 0.0, "arm.damping_ratio": None}


@dataclass(frozen=True)
class Flown:
    """A set of gains with a target, and its flights.

    made: whether the gains are made for the image or drawn at random. resolved: which flights
    (starts,) are. error: ‖e‖ (starts, time) [px]. found: conditions and V of the
    flights.
    """

    made: bool
    moving: bool
    gains: Gains
    flight: xr.Dataset
    resolved: Array
    error: Array
    found: Lyapunov

    @property
    def diverged(self) -> Array:
        """Which resolved flights (starts,) end early, or have a point beside or behind the
        camera."""
        behind = (samples(self.flight, "depth", "point") <= 0.0).any((-2, -1))
        early = self.flight["status"].to_numpy() != 0
        return np.asarray(self.resolved & (early | behind))

    @property
    def remaining(self) -> Array:
        """The largest ‖e‖ (starts,) in the last part of a flight [px]; NaN after an early end, or
        unless it is resolved."""
        left = self.error[:, in_the_end(self.flight)].max(-1)
        return np.asarray(np.where(self.resolved, left, np.nan))


@dataclass(frozen=True, eq=False)
class Theorem:
    """The flights, the random gains, and the growth rates of errors with each [1/s].

    vehicle: undamped and its image without an edge. target: the one at rest. steady: the gains
    designed for the image of a target with constant velocity. sound: gains drawn under the
    conditions of the sound statement, with their growth.
    """

    vehicle: Vehicle
    target: Target
    sets: tuple[Flown, ...]
    steady: Flown
    drawn: tuple[Gains, ...]
    growth: Array
    sound: tuple[Gains, ...]
    sound_growth: Array

    @property
    def made(self) -> Gains:
        """The gains made for the image."""
        return self.sets[0].gains

    @property
    def at_rest(self) -> list[Flown]:
        """The sets with a target at rest."""
        return [each for each in self.sets if not each.moving]

    @property
    def moving(self) -> list[Flown]:
        """The sets with a moving target."""
        return [each for each in self.sets if each.moving]


def fly_theorem(vehicle: Vehicle) -> Theorem:
    """Fly one set of gains made for the image, target at rest and moving, and four drawn sets.

    Raises InputError for a camera that has the UAV upright where it sees the desired image.
    """
    vehicle = vehicle.replace(_UNDAMPED | _EDGELESS)
    still, moving = Target(paths.hold(), triangle()), Target(paths.circle(0.1, 10.0), triangle())
    if abs(np.cos(desired_pose(vehicle, still)[4])) < _UPRIGHT:
        raise InputError(
            "camera.attitude",
            (
                f"is {shown(vehicle.camera.attitude)}, which pitches the UAV by 90° to see "
                "the target, where Euler rates are singular"
            ),
            "give a camera along the arm",
        )
    rng = np.random.default_rng(SEED)
    drawn, sound = ([draw(rng) for _ in range(DRAWS)] for draw in (draw_gains, draw_sound_gains))
    rates, sound_rates = (
        np.array([growth(vehicle, still, gains) for gains in each]) for each in (drawn, sound)
    )
    flown = [drawn[i] for i in np.flatnonzero(rates > FAST)[:UNSTABLE_SETS]]
    made = made_gains(vehicle, still)
    sets = [fly(vehicle, made, still, made=True), fly(vehicle, made, moving, made=True)]
    sets += [fly(vehicle, gains, still) for gains in flown]
    steady = fly(vehicle, made, Target(straight_on(), triangle()), made=True)
    return Theorem(
        vehicle, still, tuple(sets), steady, tuple(drawn), rates, tuple(sound), sound_rates
    )


def straight_on() -> paths.Path:
    """Return a path along the world's x at constant velocity, from the start on."""

    def motion(t: Array) -> tuple[Array, Array, Array]:
        velocity = np.zeros((len(t), 3))
        velocity[:, 0] = SPEED
        return t[:, None] * velocity, velocity, 0.0 * velocity

    return paths.Path("constant velocity", MADE.duration, motion)


def triangle(radius: float = 0.4) -> Array:
    """Return three points (3, 3) around a centre, level [m]."""
    angle = np.pi / 2 + 2.0 * np.pi / 3.0 * np.arange(POINTS)
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])


def draw_gains(rng: np.random.Generator) -> Gains:
    """Return symmetric positive definite gains (6, 6) at random."""
    gains = {name: positive_definite(rng, *between) for name, between in RANGES.items()}
    return gains | {"sigma": SIGMA}


def draw_sound_gains(rng: np.random.Generator) -> Gains:
    """Draw gains (6, 6) that fulfil the conditions of the sound statement.

    K_p, C_p and C_d share their directions, so that their products are symmetric, and K_pC_s is a
    multiple of one; K_d is any symmetric positive definite matrix.
    """
    axes, _ = np.linalg.qr(rng.normal(size=(SIZE, SIZE)))
    gains = {"Kd": positive_definite(rng, *RANGES["Kd"])}
    for name in ("Kp", "Cp", "Cd"):
        low, high = np.log(RANGES[name])
        eigenvalues = np.exp(rng.uniform(low, high, SIZE))
        gains[name] = (axes * eigenvalues) @ axes.T
    return gains | {"Cs": SLIDING * np.linalg.inv(gains["Kp"]), "sigma": SIGMA}


def positive_definite(rng: np.random.Generator, least: float, largest: float) -> Array:
    """Return a matrix (6, 6) with eigenvalues in that range, log-uniform, in random directions."""
    axes, _ = np.linalg.qr(rng.normal(size=(SIZE, SIZE)))
    A = (axes * np.exp(rng.uniform(np.log(least), np.log(largest), SIZE))) @ axes.T
    return np.asarray((A + A.T) / 2.0)


def made_gains(vehicle: Vehicle, target: Target) -> Gains:
    """Return gains of `design` for the desired image, with all directions alike."""
    found: dict[str, object] = dict(
        design(vehicle, BANDWIDTH, conditioning=0.0, desired=target.desired, distance=target.depths)
    )
    one = np.eye(SIZE)
    gains = {name: np.asarray(found[name]) for name in RANGES}
    gains = {name: gain if gain.ndim else gain * one for name, gain in gains.items()}
    return gains | {"sigma": 1e-3}


def growth(vehicle: Vehicle, target: Target, gains: Gains) -> float:
    """Return the fastest growth [1/s] of a small e about the desired image, below 0 if all decay.

    From ë + Λ(K_pC_d + K_d)ė + ΛK_p(C_p + C_s/σ)e = 0, Λ = J_L M⁻¹ J_Lᵀ, the law substituted into
    Eq. (10) where the target and the vehicle rest.
    """
    q = desired_pose(vehicle, target)
    points = target.path([0.0])[0][0] + target.points
    J, M = image_jacobian(vehicle, q, points), mass_matrix(vehicle, q)
    Λ = J @ np.linalg.solve(M, J.T)
    spring = Λ @ gains["Kp"] @ (gains["Cp"] + gains["Cs"] / gains["sigma"])
    damping = Λ @ (gains["Kp"] @ gains["Cd"] + gains["Kd"])
    loop = np.block([[np.zeros_like(Λ), np.eye(len(Λ))], [-spring, -damping]])
    return float(np.linalg.eigvals(loop).real.max())


def desired_pose(vehicle: Vehicle, target: Target) -> Array:
    """Return q (8,) of a vehicle that sees the desired image, its arm straight but for a hair."""
    q = np.zeros(8)
    q[:3], q[3:6] = facing(vehicle, target.path([0.0])[0][0], target.distance)
    q[6] = 1e-2 / vehicle.arm.length
    return q


def starts(vehicle: Vehicle, target: Target) -> tuple[Array, Array]:
    """Return q and q̇ (starts, 8), from near to far of the desired pose, moving with it."""
    rng = np.random.default_rng(SEED)
    q = desired_pose(vehicle, target) + offsets(rng, np.linspace(0.1, 1.0, STARTS))
    qd = np.zeros((STARTS, 8))
    qd[:, :3] = target.path([0.0])[1][0]
    return q, qd


def offsets(rng: np.random.Generator, sizes: Array) -> Array:
    """Return random offsets (n, 8) of q up to OFFSETS times sizes (n,); one way in the bend."""
    found = rng.uniform(-1.0, 1.0, (len(sizes), 8)) * OFFSETS
    found[:, :7] *= sizes[:, None]
    found[:, 6] = LEAST_BEND + np.abs(found[:, 6])
    return np.asarray(found)


def fly(
    vehicle: Vehicle,
    gains: Gains,
    target: Target,
    *,
    made: bool = False,
) -> Flown:
    """Fly one set of gains from all starts; the vehicle: undamped, its image without an edge."""
    pace = MADE if made else DRAWN
    q, qd = starts(vehicle, target)
    law = servoing(**gains, points=POINTS, compensation="literal")
    scenario = Scenario(
        "Theorem 1",
        q,
        qd,
        controller=law,
        target=target,
        control_period=None,
        duration=pace.duration,
    )
    flight, resolved = resolved_flights(vehicle, scenario, pace.sample)
    return Flown(
        made,
        bool(np.any(qd)),
        gains,
        flight,
        resolved,
        feature_norm(flight),
        lyapunov(vehicle, scenario, flight),
    )


def resolved_flights(
    vehicle: Vehicle, scenario: Scenario, sample: float
) -> tuple[xr.Dataset, Array]:
    """Return flights, and which (starts,) of them are resolved.

    A flight is resolved if its error_estimate is small. It also is if it ends early at the same
    time within a tenth of the tolerance, as its final motion is faster than any step.
    """

    @untold("error_estimate")
    def fly(rtol: float, check: bool) -> xr.Dataset:
        return simulate(
            vehicle,
            scenario,
            sample=sample,
            variables=NEEDED,
            rtol=rtol,
            check=check,
        )

    flight = fly(RTOL, True)
    resolved = np.asarray(flight["error_estimate"].to_numpy() <= RESOLVED)
    if not resolved.all():
        resolved |= _end_alike(flight, fly(0.1 * RTOL, False))
    return flight, resolved


def _end_alike(*flights: xr.Dataset) -> Array:
    """Return which runs end early in both flights, at the same time."""
    early = np.all([flight["status"].to_numpy() != 0 for flight in flights], axis=0)
    first, second = (flight["end_time"].to_numpy() for flight in flights)
    return np.asarray(early & (np.abs(second - first) <= ALIKE * second))


def in_the_end(flight: xr.Dataset) -> Array:
    """Return which samples (time,) are in the last part."""
    time = flight["time"].to_numpy()
    return np.asarray(time >= (1.0 - LAST) * time[-1])
