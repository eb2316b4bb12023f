"""Recorded motions of an arm on a base that does not move, and their simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from continuair.analysis.backbone import along_at
from continuair.errors import InputError
from continuair.flight.rotors import still
from continuair.flight.simulate import simulate
from continuair.identification.bench import Bench, markers_of
from continuair.scenario.payload import Payload
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.coordinates import paper_rates, polar_of_bends
from continuair.vehicle.runs import per_run, pick, take
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

GRAVITY = 9.81
"""Gravity of all recordings [m/s²]."""

_EARLY = 4
"""Samples from the start of a motion on that give the shape and its rate there."""

_UNMOVED = 1e6
"""Mass [kg] and moments of inertia [kg m²] of a UAV that an arm's weight does not move: by less
than 1e-5 in a few seconds."""

_PIECES = 12
"""Pieces of a section in which markers are placed: 2e-6 m off on 0.3 m bent by 2.5 rad."""

_KEPT_SMALL = 1e-3
"""Weight of the coordinates where the markers leave a shape open, against misses over the reach."""

_CHANGE = 1e-4
"""Change of a start for differences, where 1 bends the arm by about a radian."""

_PRECISION = 1e-5
"""Relative error of a step of the flights."""

_CLOSE = 1e-5
"""Relative change of the squared misses of a shape at which its search ends."""

_STEPS = 2
"""Gauss-Newton steps from that shape to the start of a motion."""


@dataclass(frozen=True)
class Clamped:
    """Motions of an arm on a base that does not move.

    Parameters
    ----------
    motions : tuple of ndarray, each of shape (samples, markers, 3)
        Positions in axes of the recording [m], motions of their own length.
    bench : Bench
        Where the arm hung.
    rate : float
        Samples per second [Hz].
    payload : float
        Mass that the tip carried [kg].
    resting : bool
        Whether the arm starts at rest.
    inputs : dict
        Further arguments of the scenario, such as commands of tendons, held between samples.
    """

    motions: tuple[Array, ...]
    bench: Bench
    rate: float
    payload: float
    resting: bool
    inputs: dict[str, Any]

    @property
    def samples(self) -> int:
        """Return the number of samples of the longest motion."""
        return max(len(motion) for motion in self.motions)

    def measured(self, vehicle: Vehicle) -> Array:
        """Return positions (motions, samples, markers, 3) in body axes [m], NaN after their end."""
        shape = len(self.motions), self.samples, *self.motions[0].shape[1:]
        found = np.full(shape, np.nan)
        for motion, row in zip(self.motions, found, strict=True):
            row[: len(motion)] = self.bench.in_body(motion, vehicle.arms[0].mount)
        return found

    def starts(self, vehicle: Vehicle) -> Array:
        """Return coordinates at the start, then their rates (motions, 2 coordinates).

        By least squares over the first samples, in which the arm swings as this vehicle's does.
        """
        at, early = markers_of(vehicle, self.bench), self.measured(vehicle)[:, :_EARLY]
        gaps = ~np.isfinite(early[:, 0]).all(axis=(1, 2))
        if gaps.any():
            raise InputError(
                "motions",
                f"has gaps in the first row of motion {int(np.argmax(gaps))}",
                "begin where all markers are seen",
            )
        shapes = [_shape(vehicle.arms[0], at, motion[0]) for motion in early]
        starts = np.hstack([shapes, np.zeros(np.shape(shapes))])
        for _ in range(_STEPS):
            starts = self._slopes(vehicle, starts, _EARLY).nearer(early)
        return starts

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return the function from vehicles to positions (runs, motions, samples, markers, 3)."""
        starts = self.starts(vehicle)
        return lambda vehicles: self._flown(vehicles, starts, self.samples)

    def free_predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return the function as `predictor`, with starts that fit the whole motions best.

        Every start is moved along the slopes of the given vehicle, to which others must be close.
        """
        measured, samples = self.measured(vehicle), self.samples
        starts = self._slopes(vehicle, self.starts(vehicle), samples).nearer(measured)
        slopes = self._slopes(vehicle, starts, samples)
        return lambda vehicles: slopes.moved(self._flown(vehicles, starts, samples), measured)

    def _slopes(self, vehicle: Vehicle, starts: Array, samples: int) -> _Slopes:
        """Return how the first samples of all motions of a vehicle depend on their starts."""
        motions, unknowns = starts.shape
        size = np.full(unknowns, float(np.asarray(self.bench.markers)[-1]))
        # Unknown rates count by what they change within the early samples.
        size[unknowns // 2 :] *= (_EARLY - 1) / self.rate
        free = unknowns // 2 if self.resting else unknowns
        changes = np.vstack([np.zeros(unknowns), _CHANGE * np.eye(unknowns)[:free]]) / size
        rows = (starts + changes[:, None]).reshape(-1, unknowns)
        found = self.markers_from(vehicle, rows, samples).reshape(1 + free, motions, -1)
        slopes = np.moveaxis((found[1:] - found[0]) / _CHANGE, 0, -1)
        return _Slopes(starts, found[0], slopes, size)

    def _flown(self, vehicles: Vehicle, starts: Array, samples: int) -> Array:
        """Return the markers (runs, motions, samples, markers, 3) of a batch, from starts."""
        runs, motions = vehicles.runs or 1, len(starts)
        each = take(vehicles, np.repeat(np.arange(runs), motions))
        found = self.markers_from(each, np.tile(starts, (runs, 1)), samples)
        return found.reshape(runs, motions, *found.shape[1:])

    def markers_from(self, vehicle: Vehicle, starts: Array, samples: int | None = None) -> Array:
        """Return the markers (runs, samples, markers, 3) of arms in body axes [m].

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle for all runs, or a batch of as many.
        starts : ndarray, shape (runs, 2 coordinates)
            Coordinates at the start, then their rates.
        samples : int, optional
            Number of samples. Default: those of the longest motion.
        """
        samples = samples or self.samples
        name = "strain" if vehicle.layout.strains else "bend"
        flight = self.flight(vehicle, starts, samples, [name])
        bends = flight[name].to_numpy().reshape(len(starts), samples, -1)
        return _markers(vehicle, np.asarray(self.bench.markers), bends)

    def flight(
        self, vehicle: Vehicle, starts: Array, samples: int, variables: list[str]
    ) -> xr.Dataset:
        """Return variables of flights in which arms move from starts (runs, 2 coordinates).

        In a decoupled flight the arm moves as if clamped while the UAV stands still, which it does
        with all weight carried and a mass and an inertia that nothing moves.
        """
        with untold():
            vehicle = vehicle.replace({"uav.mass": _UNMOVED, "uav.inertia": 3 * [_UNMOVED]})
        layout, runs = vehicle.layout, len(starts)
        bend, rates = np.split(starts, 2, axis=1)
        state = np.zeros((runs, layout.state))
        state[:, layout.attitude] = 0.0, 0.0, 0.0, 1.0
        state[:, layout.bend], state[:, layout.bend_rate] = bend, rates
        q = np.zeros((runs, layout.coordinates))
        q[:, layout.polar] = polar_of_bends(bend, layout)
        weight = GRAVITY * (per_run(vehicle.mass, runs) + self.payload)
        centre = self.bench.payload_centre
        inputs: dict[str, Any] = {**still(vehicle), **self.inputs}
        scenario = Scenario(
            "clamped arm",
            q,
            qd=paper_rates(q, state, layout=layout),
            force=weight[:, None] * [0.0, 0.0, 1.0],
            duration=(samples - 1) / self.rate,
            gravity=GRAVITY,
            payload=Payload(mass=self.payload, centre=centre) if self.payload else None,
            jumps=tuple((np.arange(1, samples - 1) / self.rate).tolist()) if self.inputs else (),
            **inputs,
        )
        return simulate(
            vehicle,
            scenario,
            model="decoupled",
            sample=1.0 / self.rate,
            rtol=_PRECISION,
            variables=variables,
        )


@dataclass(frozen=True)
class _Slopes:
    """How motions depend on their starts.

    starts (motions, n): coordinates and rates. flown (motions, m): markers. slopes (motions, m,
    free): change per change of a start times `size`, of the first ones of n that are free.
    """

    starts: Array
    flown: Array
    slopes: Array
    size: Array

    def nearer(self, measured: Array) -> Array:
        """Return the starts (motions, n) whose motions come closer to the measured ones."""
        count = self.slopes.shape[-1]
        found = self.starts.copy()
        kept = (found * self.size)[:, :count]
        found[:, :count] += self._moves(self.flown, measured, kept) / self.size[:count]
        return found

    def moved(self, flown: Array, measured: Array) -> Array:
        """Return motions (runs, motions, ...), each from the start that fits it best."""
        left = flown.reshape(*flown.shape[:2], -1)
        moves = self._moves(left, measured, np.zeros(()))
        return flown + (self.slopes @ moves[..., None]).reshape(flown.shape)

    def _moves(self, flown: Array, measured: Array, kept: Array) -> Array:
        """Return changes (..., motions, free) of starts, times `size`, by least squares."""
        reach = self.size[0]
        wanted = measured.reshape(len(measured), -1)
        known = np.isfinite(wanted) & np.isfinite(self.slopes).all(axis=-1)
        A = np.where(known[..., None], self.slopes, 0.0) / reach
        miss = np.where(known, wanted - flown, 0.0) / reach
        square = np.swapaxes(A, -1, -2) @ A + _KEPT_SMALL**2 * np.eye(A.shape[-1])
        towards = np.einsum("gmf,...gm->...gf", A, miss) - _KEPT_SMALL**2 * kept
        return np.asarray(np.linalg.solve(square, towards[..., None])[..., 0])


def _shape(arm: ArmChain, at: Array, points: Array) -> Array:
    """Return coordinates (n,) with which the markers are at points (markers, 3)."""
    count, reach = sum(section.coordinates for section in arm.section), at[-1]

    def left(unknowns: Array) -> Array:
        """Return misses over the reach, and small multiples of the unknowns (..., n)."""
        miss = (along_at(arm, unknowns / reach, at, _PIECES)[0] - points) / reach
        flat = miss.reshape(*unknowns.shape[:-1], -1)
        return np.concatenate([flat, _KEPT_SMALL * unknowns], axis=-1)

    def slopes(unknowns: Array) -> Array:
        """Return central differences of `left`, of all unknowns at once."""
        ahead = _CHANGE * np.eye(count)
        slopes: Array = (left(unknowns + ahead) - left(unknowns - ahead)).T / (2.0 * _CHANGE)
        return slopes

    # At exactly 0 a bend has no direction.
    found: Array = least_squares(left, np.full(count, 1e-3), slopes, ftol=_CLOSE).x / reach
    return found


def _markers(vehicle: Vehicle, at: Array, bend: Array) -> Array:
    """Return markers (runs, ..., markers, 3) for coordinates (runs, ..., coordinates)."""
    arm = vehicle.arms[0]
    lengths = [section.length for section in arm.section]
    if not any(isinstance(each, np.ndarray) for each in [*lengths, arm.mount, arm.attitude]):
        return along_at(arm, bend, at, _PIECES)[0]
    each = zip(range(len(bend)), bend, strict=True)
    return np.stack([along_at(pick(arm, run), own, at, _PIECES)[0] for run, own in each])
