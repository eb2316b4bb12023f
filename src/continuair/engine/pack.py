"""A vehicle, or a batch of them, packed for the kernels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np

from continuair.engine import moments as arc

# Vehicles whose moments are sampled at once: bounds the memory of the host side.
_BLOCK = 1024


_OWN = ("NP", "ND")
"""Moments that models other than the coupled one take about the arm's base."""


def pack(
    vehicle, code: SimpleNamespace, threads: int, coupled: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Structured parameters (vehicles,) and moment polynomials (vehicles, terms, moments).

    vehicle: a Vehicle, plain or batched. code: the device code whose `Plant` the rows fill.
    threads: how many blocks of vehicles are sampled at once. coupled: the moment polynomials of the
    coupled model for the same vehicle, where they are known, for another model.
    """
    runs = vehicle.runs or 1
    uav, rod = vehicle.uav, vehicle.arm

    def across(value, *shape):
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

    def sample(at: slice) -> np.ndarray:
        rod = [part[at] for part in backbone]
        added = [[part[at] for part in disk] for disk in disks]
        if coupled is not None:
            return _with_own(coupled[at], arc.moments(length[at], rod, added, _OWN))
        return _table(code.model, length[at], rod, added, mass[at], lever[at, 2])

    # NumPy lets go of the interpreter in these, so that blocks run side by side.
    with ThreadPoolExecutor(threads) as pool:
        table = np.concatenate(list(pool.map(sample, blocks)))
    axial = backbone[2] + sum((disk[3] for disk in disks), np.zeros(runs))

    plants = np.zeros(runs, dtype=code.Plant.numpy_dtype())
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


def per_run(value, runs: int, *shape) -> np.ndarray:
    """A field (runs, *shape), whether it, or one of its elements, varies over the runs or not."""
    if isinstance(value, np.ndarray) and value.ndim > len(shape):
        return np.broadcast_to(value, (runs, *shape))
    return np.stack([np.broadcast_to(x, runs) for x in _leaves(value)], -1).reshape(runs, *shape)


def _table(model: str, length, backbone, disks, mass, height) -> np.ndarray:
    """Moment polynomials (vehicles, terms, moments) of a block of vehicles."""
    own = arc.moments(length, backbone, disks)
    reduced = arc.about_common_centre(own, mass, height)
    if model != "coupled":
        reduced.value.update({name: own.value[name] for name in _OWN})
    return np.stack([arc.interpolate(reduced.value[name]) for name in arc.NAMES], axis=-1)


def _with_own(table: np.ndarray, own: arc.Moments) -> np.ndarray:
    """The coupled model's moment polynomials, those of the arm about its base in their place."""
    table = table.copy()
    for name in _OWN:
        table[..., arc.NAMES.index(name)] = arc.interpolate(own.value[name])
    return table


def _leaves(value):
    return [x for entry in value for x in _leaves(entry)] if isinstance(value, tuple) else [value]


def _spread(mount):
    """|m|² 1 - m mᵀ of the mount offset (runs, 3)."""
    square = np.einsum("ni,ni->n", mount, mount)[:, None, None] * np.eye(3)
    return square - mount[:, :, None] * mount[:, None, :]
