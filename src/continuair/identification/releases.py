"""Recorded releases of an arm: bent, let go, swinging freely below a base that does not move."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from continuair import checks
from continuair.analysis.backbone import along_at
from continuair.errors import InputError
from continuair.files import printed, user_path
from continuair.flight.simulate import simulate
from continuair.identification.bench import Bench, markers_of
from continuair.identification.csv_rows import numbers_of, rows_of
from continuair.identification.decay import FEWEST, onset
from continuair.immutable import Immutable
from continuair.scenario.payload import Payload
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.coordinates import paper_rates, polar_of_bends
from continuair.vehicle.runs import per_run, pick, take
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold, warn

GRAVITY = 9.81
"""Gravity of all recordings [m/s²]."""

_LONGER = 1.05
"""Distance of a marker from the base, over its distance along the arm, that is no measurement."""

_JUMP = 5.0
"""Longest step of a marker between two samples, over the 95th percentile of its steps."""

_SAMPLES_OF_START = 4
"""Samples from the onset of motion on that give the shape and its rate at the start."""

_UNMOVED = 1e6
"""Mass [kg] and moments of inertia [kg m²] of a UAV that an arm's weight does not move: by less
than 1e-5 in a few seconds."""

_PIECES = 12
"""Pieces of a section in which markers are placed: 2e-6 m off on 0.3 m bent by 2.5 rad."""

_KEPT_SMALL = 1e-3
"""Weight of the coordinates where the markers leave a shape open, against misses over the reach."""


@dataclass(frozen=True, kw_only=True)
class Releases(Immutable):
    """Positions of markers on an arm that was let go, each release from the onset of its motion on.

    Parameters
    ----------
    name : str
        Where they come from, for messages.
    motions : tuple of ndarray, each of shape (samples, markers, 3)
        Positions in axes of the recording [m], releases of their own length.
    bench : Bench
        Where the arm hung.
    payload : float, default 0.0
        Mass that the tip carried [kg].
    rate : float, default 100.0
        Samples per second [Hz].
    names : tuple of str, default ()
        Name of each release. Default: numbers.
    """

    name: str
    motions: tuple[Array, ...]
    bench: Bench
    payload: float = 0.0
    rate: float = 100.0
    names: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Return the number of samples of the longest release."""
        return max(len(motion) for motion in self.motions)

    def measured(self, vehicle: Vehicle) -> Array:
        """Return all motions in body axes, with NaN after the end of each.

        Parameters
        ----------
        vehicle : Vehicle
            The measured vehicle, of one arm.

        Returns
        -------
        ndarray, shape (releases, samples, markers, 3)
            Positions [m].
        """
        shape = len(self.motions), self.samples, *self.motions[0].shape[1:]
        found = np.full(shape, np.nan)
        for motion, row in zip(self.motions, found, strict=True):
            row[: len(motion)] = self.bench.in_body(motion, vehicle.arms[0].mount)
        return found

    def starts(self, vehicle: Vehicle) -> tuple[Array, Array]:
        """Return the arm's coordinates at the onset of motion and their rates, by least squares.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm.

        Returns
        -------
        coordinates : ndarray, shape (releases, coordinates)
            Bend vectors of arcs [1/m], and the coordinates of other sections.
        rates : ndarray, shape (releases, coordinates)
            Their rates [per s].
        """
        at = markers_of(vehicle, self.bench)
        early = self.measured(vehicle)[:, :_SAMPLES_OF_START]
        each = [_start(vehicle.arms[0], at, motion, self.rate) for motion in early]
        coordinates, rates = zip(*each, strict=True)
        return np.array(coordinates), np.array(rates)

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return the function that predicts the motions for vehicles like a given one.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle, of one arm, whose shape is fitted to the onset of each motion.

        Returns
        -------
        callable
            From one vehicle, or a batch, of arms as long as the given one's, to positions of the
            markers in body axes (runs, releases, samples, markers, 3) [m]: its arm let go on a base
            that does not move; NaN after a flight has stopped.
        """
        at, starts, releases = markers_of(vehicle, self.bench), self.starts(vehicle), self.motions

        def predicted(vehicles: Vehicle) -> Array:
            runs = vehicles.runs or 1
            coordinates, rates = (np.tile(each, (runs, 1)) for each in starts)
            each = np.repeat(np.arange(runs), len(releases))
            bend = _released(take(vehicles, each), coordinates, rates, self)
            return _markers(vehicles, at, bend.reshape(runs, len(releases), self.samples, -1))

        return predicted


def _start(arm: ArmChain, at: Array, early: Array, rate: float) -> tuple[Array, Array]:
    """Return coordinates and rates for which the markers move as in (samples, markers, 3)."""
    t = np.arange(len(early)) / rate
    count, reach = sum(section.coordinates for section in arm.section), at[-1]
    size = np.full(count, reach)

    def left(unknowns: Array) -> Array:
        """Return misses over the reach, and small multiples of the unknowns."""
        first, rates = unknowns.reshape(2, count) / size
        miss = along_at(arm, first + np.outer(t, rates), at, _PIECES)[0] - early
        return np.append(miss.ravel() / reach, _KEPT_SMALL * unknowns)

    # At exactly 0 a bend has no direction.
    found = least_squares(left, np.append(np.full(count, 1e-3), np.zeros(count))).x
    coordinates, rates = found.reshape(2, count) / size
    return coordinates, rates


def _released(vehicle: Vehicle, bend: Array, rates: Array, of: Releases) -> Array:
    """Return the coordinates (runs, samples, coordinates) of arms let go from (runs, coordinates).

    In a decoupled flight the arm moves as if clamped while the UAV stands still, which it does with
    all weight carried and a mass and an inertia that nothing moves.
    """
    with untold():
        vehicle = vehicle.replace({"uav.mass": _UNMOVED, "uav.inertia": 3 * [_UNMOVED]})
    layout, runs = vehicle.layout, len(bend)
    state = np.zeros((runs, layout.state))
    state[:, layout.attitude] = 0.0, 0.0, 0.0, 1.0
    state[:, layout.bend], state[:, layout.bend_rate] = bend, rates
    q = np.zeros((runs, layout.coordinates))
    q[:, layout.polar] = polar_of_bends(bend, layout)
    qd = paper_rates(q, state, layout=layout)
    weight = GRAVITY * (per_run(vehicle.mass, runs) + of.payload)
    scenario = Scenario(
        "release",
        q,
        qd=qd,
        force=weight[:, None] * [0.0, 0.0, 1.0],
        duration=(of.samples - 1) / of.rate,
        gravity=GRAVITY,
        payload=Payload(mass=of.payload, centre=of.bench.payload_centre) if of.payload else None,
        **_still(vehicle),
    )
    name = "strain" if layout.strains else "bend"
    flight = simulate(
        vehicle, scenario, model="decoupled", sample=1.0 / of.rate, rtol=1e-5, variables=[name]
    )
    found: Array = flight[name].to_numpy().reshape(runs, of.samples, -1)
    return found


def _still(vehicle: Vehicle) -> dict[str, Any]:
    """Return the commands of rotors that stand still."""
    rotors = vehicle.uav.rotors
    return {} if rotors is None else {"rotor_command": np.zeros(rotors.count)}


def _markers(vehicle: Vehicle, at: Array, bend: Array) -> Array:
    """Return markers (runs, ..., markers, 3) for coordinates (runs, ..., coordinates)."""
    if vehicle.runs is None:
        return along_at(vehicle.arms[0], bend, at, _PIECES)[0]
    arms = [pick(vehicle.arms[0], run) for run in range(vehicle.runs)]
    each = zip(arms, bend, strict=True)
    return np.stack([along_at(arm, own, at, _PIECES)[0] for arm, own in each])


def load_releases(
    path: str | os.PathLike[str], bench: Bench, *, payload: float = 0.0, rate: float = 100.0
) -> Releases:
    """Return the releases of a CSV file.

    Parameters
    ----------
    path : str or path-like
        A CSV file with the columns ID, a number of the release, and x1, y1, z1, x2, … of the
        markers from the arm's base out [m]; rows of a release follow each other at equal times.
    bench : Bench
        Where the arm hung.
    payload : float, default 0.0
        Mass that the tip carried [kg].
    rate : float, default 100.0
        Samples per second [Hz].

    Returns
    -------
    Releases
        All releases in which every marker was seen, from the onset of motion on. A warning names
        those left out: with gaps, with markers that jump, or farther from the base than along the
        arm.

    Raises
    ------
    InputError
        If the file cannot be read, or fewer than half of its releases can be used.
    """
    file = user_path("data", path)
    where = printed(file)
    payload = checks.number("payload", payload, least=0.0, otherwise=" [kg]")
    rate = checks.positive("rate", rate, " [Hz]")
    count = len(np.asarray(bench.markers))
    names = [f"{axis}{marker + 1}" for marker in range(count) for axis in "xyz"]
    headings, rows = rows_of("data", file)
    table = numbers_of(where, headings, rows, ["ID", *names])
    if f"x{count + 1}" in headings:
        raise InputError(
            "data",
            f"has more markers than the {count} of the bench",
            "name all distances in bench.markers, or remove the columns",
        ).located(where)
    motions: dict[str, Array] = {}
    left_out: dict[str, str] = {}
    for release in dict.fromkeys(table[:, 0].tolist()):
        motion = table[table[:, 0] == release, 1:].reshape(-1, count, 3)
        problem = _problem(motion, bench)
        if not problem:
            motion = motion[onset(motion[:, -1], rate) :]
            problem = "is short" if len(motion) < FEWEST else ""
        if problem:
            left_out[f"{release:g}"] = problem
        else:
            motions[f"{release:g}"] = motion
    _tell(where, motions, left_out)
    return Releases(
        name=where,
        motions=tuple(motions.values()),
        bench=bench,
        payload=payload,
        rate=rate,
        names=tuple(motions),
    )


def _problem(motion: Array, bench: Bench) -> str:
    """Return why a release (samples, markers, 3) cannot be used, or nothing."""
    if not np.isfinite(motion).all():
        return "has gaps"
    away = np.linalg.norm(motion - np.asarray(bench.base), axis=-1)
    if (away > _LONGER * np.asarray(bench.markers)).any():
        return "has a marker farther from the base than along the arm"
    steps = np.linalg.norm(np.diff(motion, axis=0), axis=-1)
    if len(steps) and (steps.max(axis=0) > _JUMP * np.percentile(steps, 95, axis=0)).any():
        return "has a marker that jumps"
    return ""


def _tell(where: str, kept: dict[str, Any], left_out: dict[str, str]) -> None:
    """Warn of releases that were left out; raise InputError if these are most of them."""
    if not left_out and kept:
        return
    why = ", ".join(f"{name} {problem}" for name, problem in list(left_out.items())[:3])
    if len(left_out) >= max(len(kept), 1):
        raise InputError(
            "data",
            f"has {len(left_out)} releases that cannot be used ({why or 'no rows'})",
            "check the unit (m), the order of the markers, and base, up and markers of the bench",
        ).located(where)
    warn(f"{where}: leaves out {len(left_out)} releases ({why}).", stacklevel=3)
