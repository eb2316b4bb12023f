"""A vehicle, or a batch of them, packed for the kernels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from continuair.engine import moments as arc
from continuair.kernels.types import MOMENTS
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

# Vehicles whose moments are sampled at once: bounds the memory of the host side.
_BLOCK = 1024


_OWN = ("NP", "ND")
"""Moments that some models take about the arm's own base."""


def pack(
    vehicle: Vehicle, Plant: Any, threads: int, own_base: bool, coupled: Array | None = None
) -> tuple[Array, Array]:
    """Structured parameters (vehicles,) and moment polynomials (vehicles, terms, moments).

    vehicle: plain or batched. Plant: the struct that the rows fill. threads: how many blocks of
    vehicles are sampled at once. own_base: the inertia of bending is about the arm's own base, not
    the common centre of mass. coupled: the polynomials about that centre, where they are known.
    """
    parts = _parts(vehicle)
    blocks = [slice(first, first + _BLOCK) for first in range(0, len(parts.length), _BLOCK)]

    def sample(at: slice) -> Array:
        if coupled is not None and not own_base:
            return coupled[at]
        rod = [part[at] for part in parts.backbone]
        added = [[part[at] for part in disk] for disk in parts.disks]
        if coupled is not None:
            return _with_own(coupled[at], arc.moments(parts.length[at], rod, added, _OWN))
        height = parts.lever[at, 2]
        return _table(own_base, parts.length[at], rod, added, parts.mass[at], height)

    # NumPy lets go of the interpreter in these, so that blocks run side by side.
    with ThreadPoolExecutor(threads) as pool:
        table = np.concatenate(list(pool.map(sample, blocks)))
    return _plants(vehicle, parts, Plant), table


class _Parts(NamedTuple):
    """A vehicle's parts over its runs: length (runs,); (mass, transverse, axial inertia) of the
    backbone, and after its position of every disk; mass (runs,), lever of the mount (runs, 3)."""

    length: Array
    backbone: tuple[Array, ...]
    disks: list[tuple[Array, ...]]
    mass: Array
    lever: Array


def _parts(vehicle: Vehicle) -> _Parts:
    runs, rod = vehicle.runs or 1, vehicle.arm
    length, uav_mass = per_run(rod.length, runs), per_run(vehicle.uav.mass, runs)
    densities = (
        rod.mass_per_length,
        rod.transverse_inertia_per_length,
        rod.axial_inertia_per_length,
    )
    backbone = tuple(per_run(density, runs) * length for density in densities)
    disks = [
        tuple(per_run(v, runs) for v in (d.position, d.mass, d.transverse_inertia, d.axial_inertia))
        for d in rod.disks
    ]
    mass = uav_mass + per_run(rod.mass, runs)
    lever = per_run(vehicle.uav.mount, runs, 3) * (uav_mass / mass)[:, None]
    return _Parts(length, backbone, disks, mass, lever)


def _plants(vehicle: Vehicle, parts: _Parts, Plant: Any) -> Array:
    """Structured parameters (vehicles,)."""
    runs, uav, rod = len(parts.length), vehicle.uav, vehicle.arm
    unit, uav_mass = arc.length_unit(parts.length), per_run(uav.mass, runs)
    arm_mass, mount = per_run(rod.mass, runs), per_run(uav.mount, runs, 3)
    axial = parts.backbone[2] + sum((disk[3] for disk in parts.disks), np.zeros(runs))
    reduced = uav_mass * arm_mass / parts.mass
    inertia = per_run(uav.inertia, runs, 3, 3)
    plants = np.zeros(runs, dtype=Plant.numpy_dtype())
    plants["mass"], plants["arm_mass"], plants["uav_mass"] = parts.mass, arm_mass, uav_mass
    plants["unit"] = unit
    plants["stiffness"] = per_run(rod.bending_stiffness, runs) * parts.length / unit**2
    plants["damping"] = per_run(rod.structural_damping, runs) * parts.length / unit**2
    plants["threshold"] = per_run(rod.kappa_s, runs) * unit
    plants["mount"] = mount
    plants["uav_inertia"] = inertia
    plants["lever"][:, :2] = parts.lever[:, :2]
    plants["inertia"] = (
        inertia + axial[:, None, None] * np.eye(3) + reduced[:, None, None] * _spread(mount)
    )
    return plants


def per_run(value: Any, runs: int, *shape: int) -> Array:
    """A field (runs, *shape), whether it, or one of its elements, varies over the runs or not."""
    if isinstance(value, np.ndarray) and value.ndim > len(shape):
        return np.broadcast_to(value, (runs, *shape))
    return np.stack([np.broadcast_to(x, runs) for x in _leaves(value)], -1).reshape(runs, *shape)


def _table(
    own_base: bool, length: Array, backbone: Any, disks: Any, mass: Array, height: Array
) -> Array:
    """Moment polynomials (vehicles, terms, moments) of a block of vehicles."""
    own = arc.moments(length, backbone, disks)
    reduced = arc.about_common_centre(own, mass, height)
    if own_base:
        reduced.value.update({name: own.value[name] for name in _OWN})
    return np.stack([arc.interpolate(reduced.value[name]) for name in MOMENTS], axis=-1)


def _with_own(table: Array, own: arc.Moments) -> Array:
    """The coupled model's moment polynomials, those of the arm about its base in their place."""
    table = table.copy()
    for name in _OWN:
        table[..., MOMENTS.index(name)] = arc.interpolate(own.value[name])
    return table


def _leaves(value: Any) -> list[Any]:
    return [x for entry in value for x in _leaves(entry)] if isinstance(value, tuple) else [value]


def _spread(mount: Array) -> Array:
    """|m|² 1 - m mᵀ of the mount offset (runs, 3)."""
    square = np.einsum("ni,ni->n", mount, mount)[:, None, None] * np.eye(3)
    return square - mount[:, :, None] * mount[:, None, :]
