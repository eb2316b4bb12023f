"""Packing of a vehicle, or a batch, for the kernels."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.device.types import Tree
from continuair.engine.struct_types import numpy_type
from continuair.sections import kind_of
from continuair.terms import compiled_terms, pack_terms, terms_of
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.layout import Layout
from continuair.vehicle.runs import per_run, take
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


# Vehicles whose moments are sampled at once, which bounds the memory on the host.
_BLOCK = 1024

MOST_KEPT = 65_536
"""Most vehicles whose coefficients are kept, which take 2 to 5 kB each."""


def tree_of(vehicle: Vehicle) -> Tree:
    """Return the constants for which kernels of a vehicle are compiled."""
    arms, straight = vehicle.arms, np.array([0.0, 0.0, 0.0, 1.0])
    return Tree(
        tuple(tuple(kind_of(section) for section in arm.section) for arm in arms),
        bodies=any(arm.tip is not None for arm in arms)
        or any(term.carries for term in terms_of(vehicle)),
        turned=any((np.asarray(arm.attitude) != straight).any() for arm in arms),
        camera_arm=vehicle.camera_arm,
        terms=compiled_terms(vehicle),
    )


def pack_table(vehicle: Vehicle, threads: int) -> Array:
    """Return the coefficients (vehicles, rows, columns) of all sections, arm by arm.

    threads: number of blocks of vehicles that are sampled in parallel.
    """
    runs = vehicle.runs or 1
    sections = [(kind_of(each), each) for arm in vehicle.arms for each in arm.section]
    terms = [term for term in terms_of(vehicle) if term.rows]
    if not sections:
        return np.zeros((runs, 1, 1))
    columns = max(*(kind.columns for kind, _ in sections), *(term.columns for term in terms), 1)
    blocks = [slice(first, first + _BLOCK) for first in range(0, runs, _BLOCK)]

    def sample(at: slice) -> Array:
        tables = [kind.table(section, runs, at) for kind, section in sections]
        tables += [term.table(vehicle, runs, at) for term in terms]
        return np.concatenate([_wide(table, columns) for table in tables], axis=1)

    if len(blocks) == 1:
        return sample(blocks[0])
    # NumPy releases the interpreter lock, so that blocks run in parallel.
    with ThreadPoolExecutor(threads) as pool:
        return np.concatenate(list(pool.map(sample, blocks)))


class Coefficients:
    """Coefficients of the sections of a vehicle, or of a batch: those of many when they are used.

    threads: as in `pack_table`.
    """

    def __init__(self, vehicle: Vehicle, threads: int) -> None:
        self._vehicle, self._runs, self._threads = vehicle, vehicle.runs or 1, threads
        self.whole = pack_table(vehicle, threads) if self._runs <= MOST_KEPT else None
        # Each thread's last runs, which it uses several times.
        self._last = threading.local()

    def of(self, at: slice | Array) -> Array:
        """Return the coefficients (n, rows, columns) of some vehicles, by their indices."""
        if self.whole is not None:
            return self.whole[at]
        if isinstance(at, slice) and at == slice(None):
            return pack_table(self._vehicle, self._threads)
        runs, which = np.unique(np.arange(self._runs)[at], return_inverse=True)
        key, (known, rows) = runs.tobytes(), getattr(self._last, "rows", (None, None))
        if rows is None or known != key:
            rows = pack_table(take(self._vehicle, runs), 1)
            self._last.rows = key, rows
        return rows[which.ravel()]


def _wide(table: Array, columns: int) -> Array:
    """Return a table (n, rows, columns), padded to the largest number of columns."""
    missing = columns - table.shape[-1]
    return np.pad(table, ((0, 0), (0, 0), (0, missing))) if missing else table


def pack_plants(vehicle: Vehicle, Plant: Any) -> Array:
    """Return structured parameters (vehicles,) of the type Plant."""
    runs, uav, arms = vehicle.runs or 1, vehicle.uav, vehicle.arms
    plants = np.zeros(runs, dtype=numpy_type(Plant))
    plants["uav_mass"] = per_run(uav.mass, runs)
    plants["uav_inertia"] = per_run(uav.inertia, runs, 3, 3)
    plants["mass"] = per_run(vehicle.mass, runs)
    lengths = [np.sum([per_run(each.length, runs) for each in arm.section], 0) for arm in arms]
    plants["length"] = per_run(vehicle.reach, runs)
    first = 0
    for index, arm in enumerate(arms):
        plants["arm_mass"][:, index] = per_run(arm.mass, runs)
        _pack_mount(plants, index, arm)
        _pack_body(plants, index, arm)
        _pack_sections(plants, vehicle.layout, first, arm, lengths[index])
        first += len(arm.section)
    if not arms:
        plants["mount"][:, 0] = per_run(uav.mount, runs, 3)
        plants["mount_attitude"][:, 0] = 0.0, 0.0, 0.0, 1.0
    _pack_couples(plants, vehicle)
    pack_terms(plants, vehicle)
    return plants


def _pack_mount(plants: Array, index: int, arm: ArmChain) -> None:
    runs = len(plants)
    attitude = per_run(arm.attitude, runs, 4)
    plants["mount"][:, index] = per_run(arm.mount, runs, 3)
    plants["mount_attitude"][:, index] = attitude
    plants["turn"][:, index] = Rotation.from_quat(attitude).as_matrix().reshape(runs, 9)


def _pack_body(plants: Array, index: int, arm: ArmChain) -> None:
    """Pack the body on a tip about the tip, in axes in which the arm ends along -z."""
    if arm.tip is None:
        return
    runs, half_turn = len(plants), np.array([1.0, -1.0, -1.0])
    mass = per_run(arm.tip.mass, runs)
    centre = per_run(arm.tip.centre, runs, 3) * half_turn
    inertia = per_run(arm.tip.inertia, runs, 3, 3) * np.outer(half_turn, half_turn)
    inertia = inertia + mass[:, None, None] * _spread(centre)
    plants["body_mass"][:, index] = mass
    plants["body_moment"][:, index] = mass[:, None] * centre
    plants["body_inertia"][:, index] = inertia.reshape(runs, 9)


def _pack_sections(plants: Array, layout: Layout, first: int, arm: ArmChain, whole: Array) -> None:
    """Pack the sections of an arm; whole: length of the arm (runs,) [m]."""
    runs = len(plants)
    beyond = np.zeros(runs) if arm.tip is None else per_run(arm.tip.mass, runs)
    reach = np.zeros(runs)
    for at in range(len(arm.section) - 1, -1, -1):
        section, where = arm.section[at], first + at
        own, kind = layout.of_section[where], kind_of(section)
        length, unit = per_run(section.length, runs), kind.units(section, runs)
        mass = per_run(section.mass, runs)
        plants["unit"][:, own] = unit
        plants["stiffness"][:, own] = kind.stiffness(section, runs) / unit**2
        plants["damping"][:, own] = kind.damping(section, runs) / unit**2
        columns = {
            "threshold": per_run(section.kappa_s, runs) * unit[:, 0],
            "section_mass": mass,
            "beyond": beyond,
            "reach": (reach + 0.5 * length) / whole,
        }
        for name, values in (columns | kind.pack(section, runs)).items():
            plants[name][:, where] = values
        beyond, reach = beyond + mass, reach + length


def _pack_couples(plants: Array, vehicle: Vehicle) -> None:
    """Pack stiffness and damping between the pairs of coordinates of all sections."""
    runs, first = len(plants), 0
    for section in (section for arm in vehicle.arms for section in arm.section):
        kind = kind_of(section)
        if not kind.couples:
            continue
        unit, (one, other) = kind.units(section, runs), np.array(kind.couples).T
        values = kind.between(section, runs)
        for name, each in zip(("stiffness_between", "damping_between"), values, strict=True):
            plants[name][:, first : first + len(one)] = each / (unit[:, one] * unit[:, other])
        first += len(one)


def natural_units(vehicle: Vehicle, layout: Layout, runs: int) -> Array:
    """Return the natural units of the sections' coordinates (runs, coordinates)."""
    found = np.empty((runs, layout.bends))
    sections = [section for arm in vehicle.arms for section in arm.section]
    for section, own in zip(sections, layout.of_section, strict=True):
        found[:, own] = kind_of(section).natural(section, runs)
    return found


def units_of_own_states(vehicle: Vehicle, runs: int) -> Array:
    """Return the natural units of the states that terms add (runs, n), in their order."""
    found = [np.empty((runs, 0))]
    for term in terms_of(vehicle):
        units = term.state_units(vehicle, runs)
        found += [units[name] for name in term.states]
    return np.hstack(found)


def _spread(at: Array) -> Array:
    """Return |r|² 1 - r rᵀ of points (runs, 3)."""
    square = np.einsum("ni,ni->n", at, at)[:, None, None] * np.eye(3)
    return square - at[:, :, None] * at[:, None, :]
