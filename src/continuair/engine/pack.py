"""A vehicle, or a batch of them, packed for the kernels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

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
    runs = vehicle.runs or 1
    uav, rod = vehicle.uav, vehicle.arm

    def across(value: Any, *shape: int) -> Array:
        return per_run(value, runs, *shape)

    length, uav_mass = across(rod.length), across(uav.mass)
    mount, inertia = across(uav.mount, 3), across(uav.inertia, 3, 3)
    backbone = tuple(
        across(density) * length
        for density in (
            rod.mass_per_length,
            rod.transverse_inertia_per_length,
            rod.axial_inertia_per_length,
        )
    )
    disks = [
        tuple(across(v) for v in (d.position, d.mass, d.transverse_inertia, d.axial_inertia))
        for d in rod.disks
    ]
    arm_mass = across(rod.mass)
    mass = uav_mass + arm_mass
    lever = mount * (uav_mass / mass)[:, None]
    unit = arc.length_unit(length)
    blocks = [slice(first, first + _BLOCK) for first in range(0, runs, _BLOCK)]

    def sample(at: slice) -> Array:
        rod = [part[at] for part in backbone]
        added = [[part[at] for part in disk] for disk in disks]
        if coupled is not None:
            if not own_base:
                return coupled[at]
            return _with_own(coupled[at], arc.moments(length[at], rod, added, _OWN))
        return _table(own_base, length[at], rod, added, mass[at], lever[at, 2])

    # NumPy lets go of the interpreter in these, so that blocks run side by side.
    with ThreadPoolExecutor(threads) as pool:
        table = np.concatenate(list(pool.map(sample, blocks)))
    axial = backbone[2] + sum((disk[3] for disk in disks), np.zeros(runs))

    plants = np.zeros(runs, dtype=Plant.numpy_dtype())
    reduced = uav_mass * arm_mass / mass
    plants["mass"], plants["arm_mass"], plants["uav_mass"] = mass, arm_mass, uav_mass
    plants["unit"] = unit
    plants["stiffness"] = across(rod.bending_stiffness) * length / unit**2
    plants["damping"] = across(rod.structural_damping) * length / unit**2
    plants["threshold"] = across(rod.kappa_s) * unit
    plants["mount"] = mount
    plants["uav_inertia"] = inertia
    plants["lever"][:, :2] = lever[:, :2]
    plants["inertia"] = (
        inertia + axial[:, None, None] * np.eye(3) + reduced[:, None, None] * _spread(mount)
    )
    return plants, table


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
