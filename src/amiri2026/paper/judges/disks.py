"""Spacer disks of a published tendon-driven arm, and their share beside the backbone.

The paper prints no disks. These are of the arm of Till, Aloi and Rucker, "Real-time dynamics of
soft and continuum robots based on Cosserat rod models", Int. J. Robotics Research 38 (2019), with
the numbers of the authors' code: a steel backbone 0.7144 m long, of 0.675 mm radius, seven disks,
34 g in all, tendons 15.06 mm off the backbone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from amiri2026.extremes import largest
from amiri2026.open_loop_tests import OPEN_LOOP_TESTS, open_loop_test
from continuair import Vehicle, equations, run_pairs, simulate
from continuair.analysis import RTOL
from continuair.flight import angles_unread
from continuair.vehicle import paper_rates

Array = np.ndarray

_LENGTH, _RADIUS, _STEEL, _TOTAL, _COUNT, _TENDONS = 0.7144, 0.675e-3, 7850.0, 0.034, 7, 0.01506

MASS = (_TOTAL - _STEEL * np.pi * _RADIUS**2 * _LENGTH) / _COUNT
"""Of a disk, with its share of the tendons [kg]."""

SPACING = _LENGTH / _COUNT
"""Between disks, the last one at the tip [m]."""

RADII = (0.001, 0.005, 0.010)
"""Of the backbone, that the paper sweeps [m]."""

_GRAVITY, _BETWEEN_SAMPLES = 9.81, 0.05

_SAME = 0.01
"""Relative difference within which results of two tolerances count as equal."""

_STRAIGHT = 1e-6
"""Bend angle up to which an arm counts as straight [rad]."""

_STATE = ("position", "attitude", "bend", "velocity", "angular_velocity", "bend_rate")


def with_disks(vehicle: Vehicle) -> Vehicle:
    """The vehicle with the published disks, thin ones as wide as their tendons, beside its own."""
    length = vehicle.arm.length
    count = max(1, round(length / SPACING))
    inertia = (MASS * _TENDONS**2 / 4, MASS * _TENDONS**2 / 2)
    disks = [
        {"position": length * (index + 1) / count, "mass": MASS, "inertia": inertia}
        for index in range(count)
    ]
    return vehicle.replace({"arm.disks": [*vehicle.arm.disks, *disks]})


@dataclass(frozen=True)
class Shares:
    """Shares of the disks in kinetic and in potential energy along a flight."""

    kinetic: float
    potential: float

    @property
    def larger(self) -> float:
        """The larger of the two."""
        return largest([self.kinetic, self.potential])


def shares_of_energy(vehicle: Vehicle, test: str) -> tuple[Shares, Shares]:
    """Return shares of the disks in the energies of the arm, and in those of the whole vehicle.

    They are computed along the coupled flight of a test with disks, up to its end if it ends early.
    Energies are summed over its samples, potential energy as its change since the start. NaN if a
    tenth of the tolerance changes them.
    """
    full = with_disks(vehicle)

    def shares(rtol: float) -> Array:
        flown = _fly(full, test, rtol)
        q, qd = _motion(full, flown)
        whole = _energies(full, q, qd)
        of_disks = np.abs(whole - _energies(vehicle, q, qd)).sum(axis=1)
        of_arm = np.abs(whole - _energies_of_uav(full, q, qd)).sum(axis=1)
        # Of a flight that ends in its first step there is no share.
        with np.errstate(invalid="ignore"):
            return np.array([of_disks / of_arm, of_disks / np.abs(whole).sum(axis=1)])

    of_arm, of_all = _settled(shares).tolist()
    return Shares(*of_arm), Shares(*of_all)


def states_of_tests(vehicle: Vehicle) -> Array:
    """Return q (n, 8) along the coupled flights of Tests A to D with disks.

    At 0.05 s intervals, up to an early end. Without straight states, at which ψa has no meaning.
    """
    full = with_disks(vehicle)
    rows = []
    for test in OPEN_LOOP_TESTS:
        with angles_unread():
            flown = _fly(full, test, RTOL)
        rows.append(_motion(full, flown)[0])
    q = np.concatenate(rows)
    return q[np.abs(q[:, 6]) * vehicle.arm.length > _STRAIGHT]


def errors_of_tests(vehicle: Vehicle) -> dict[str, float]:
    """Return RMSE of the tip between the decoupled and the coupled flight [m], by test; NaN where a
    tenth of the tolerance changes it."""

    def error(test: str, rtol: float) -> Array:
        pair = run_pairs(vehicle, open_loop_test(test), ["decoupled"], rtol=rtol)
        return pair["rmse_t_m"].sel(model="decoupled").to_numpy()

    return {test: _settled(partial(error, test)).item() for test in OPEN_LOOP_TESTS}


def _fly(vehicle: Vehicle, test: str, rtol: float) -> xr.Dataset:
    scenario = open_loop_test(test)
    names = ["q", *_STATE]
    return simulate(vehicle, scenario, sample=_BETWEEN_SAMPLES, rtol=rtol, variables=names)


def _settled(found_within: Callable[[float], Array]) -> Array:
    """Return the values found within RTOL; NaN unless a tenth of it gives the same."""
    with angles_unread():
        found, finer = found_within(RTOL), found_within(0.1 * RTOL)
    same = (np.abs(found - finer) <= _SAME * np.abs(finer)).all()
    return found if same else np.full_like(found, np.nan)


def _motion(vehicle: Vehicle, flown: xr.Dataset) -> tuple[Array, Array]:
    """Return q and q̇ (samples, 8) of a flight."""
    flown = flown.sel(time=slice(None, float(flown["end_time"])))
    q, *state = (flown[name].to_numpy() for name in ("q", *_STATE))
    # Logged in body axes, integrated in world axes.
    state[3] = Rotation.from_quat(state[1]).apply(state[3])
    return q, paper_rates(q, np.hstack(state), vehicle.arm.kappa_s)


def _energies(vehicle: Vehicle, q: Array, qd: Array) -> Array:
    """Return the kinetic energy, and the change of the potential energy, (2, samples) [J]."""
    kinetic = [equations.kinetic_energy(vehicle, *row) for row in zip(q, qd, strict=True)]
    potential = [equations.potential_energy(vehicle, row) for row in q]
    return np.array([kinetic, np.subtract(potential, potential[0])])


def _energies_of_uav(vehicle: Vehicle, q: Array, qd: Array) -> Array:
    """Return the same of the UAV alone."""
    uav = vehicle.uav
    kinetic = 0.5 * uav.mass * (qd[:, :3] ** 2).sum(axis=1)
    spins = [
        equations.rotation(at).T @ equations.euler_rate_matrix(at) @ rates
        for at, rates in zip(q, qd[:, 3:6], strict=True)
    ]
    kinetic += [0.5 * spin @ np.asarray(uav.inertia) @ spin for spin in spins]
    return np.array([kinetic, uav.mass * _GRAVITY * (q[:, 2] - q[0, 2])])
