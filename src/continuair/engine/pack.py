"""A vehicle, or a batch of them, packed for the kernels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.engine.moments import length_unit, polynomials
from continuair.kernels.types import Tree
from continuair.terms import compiled_terms, pack_terms
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


# Vehicles whose moments are sampled at once: bounds the memory of the host side.
_BLOCK = 1024


def tree_of(vehicle: Vehicle) -> Tree:
    """What kernels are made for to fly a vehicle."""
    arms, straight = vehicle.arms, np.array([0.0, 0.0, 0.0, 1.0])
    return Tree(
        tuple(len(arm.section) for arm in arms),
        bodies=any(arm.tip is not None for arm in arms),
        turned=any((np.asarray(arm.attitude) != straight).any() for arm in arms),
        eye=vehicle.camera_arm,
        terms=compiled_terms(vehicle),
    )


def pack_table(vehicle: Vehicle, threads: int) -> Array:
    """Polynomials (vehicles, sections times terms, functions) of all sections, arm by arm.

    threads: how many blocks of vehicles are sampled at once.
    """
    runs = vehicle.runs or 1
    sections = [_Rod(each, runs) for arm in vehicle.arms for each in arm.section]
    blocks = [slice(first, first + _BLOCK) for first in range(0, runs, _BLOCK)]

    def sample(at: slice) -> Array:
        return np.concatenate([each.polynomials(at) for each in sections], axis=1)

    if len(blocks) == 1:
        return sample(blocks[0])
    # NumPy lets go of the interpreter in these, so that blocks run side by side.
    with ThreadPoolExecutor(threads) as pool:
        return np.concatenate(list(pool.map(sample, blocks)))


class _Rod:
    """A section's parts over runs: length (runs,); (mass, transverse, axial inertia) of the
    backbone, and after its position of every disk."""

    def __init__(self, section: Section, runs: int) -> None:
        self.length = per_run(section.length, runs)
        densities = (
            section.mass_per_length,
            section.transverse_inertia_per_length,
            section.axial_inertia_per_length,
        )
        self.backbone = [per_run(density, runs) * self.length for density in densities]
        self.disks = [
            [
                per_run(value, runs)
                for value in (d.position, d.mass, d.transverse_inertia, d.axial_inertia)
            ]
            for d in section.disks
        ]

    def polynomials(self, at: slice) -> Array:
        """Coefficients (n, terms, functions) of some runs."""
        disks = [[part[at] for part in disk] for disk in self.disks]
        return polynomials(self.length[at], [part[at] for part in self.backbone], disks)

    @property
    def axial_inertia(self) -> Array:
        """Of backbone and disks about the tangent (runs,) [kg m²]."""
        return np.asarray(self.backbone[2] + sum(disk[3] for disk in self.disks))


def pack_plants(vehicle: Vehicle, Plant: Any) -> Array:
    """Structured parameters (vehicles,); Plant: the struct that they fill."""
    runs, uav, arms = vehicle.runs or 1, vehicle.uav, vehicle.arms
    plants = np.zeros(runs, dtype=Plant.numpy_dtype())
    plants["uav_mass"] = per_run(uav.mass, runs)
    plants["uav_inertia"] = per_run(uav.inertia, runs, 3, 3)
    plants["mass"] = per_run(vehicle.mass, runs)
    lengths = [np.sum([per_run(each.length, runs) for each in arm.section], 0) for arm in arms]
    plants["length"] = np.max(lengths, axis=0)
    first = 0
    for index, arm in enumerate(arms):
        plants["arm_mass"][:, index] = per_run(arm.mass, runs)
        _pack_mount(plants, index, arm)
        _pack_body(plants, index, arm)
        _pack_sections(plants, first, arm, lengths[index])
        first += len(arm.section)
    pack_terms(plants, vehicle)
    return plants


def _pack_mount(plants: Array, index: int, arm: ArmChain) -> None:
    runs = len(plants)
    attitude = per_run(arm.attitude, runs, 4)
    plants["mount"][:, index] = per_run(arm.mount, runs, 3)
    plants["mount_attitude"][:, index] = attitude
    plants["turn"][:, index] = Rotation.from_quat(attitude).as_matrix().reshape(runs, 9)


def _pack_body(plants: Array, index: int, arm: ArmChain) -> None:
    """The body on a tip about that point, in axes in which the arm ends along -z."""
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


def _pack_sections(plants: Array, first: int, arm: ArmChain, whole: Array) -> None:
    """whole: length of the arm (runs,) [m]."""
    runs = len(plants)
    beyond = np.zeros(runs) if arm.tip is None else per_run(arm.tip.mass, runs)
    reach = np.zeros(runs)
    for at in range(len(arm.section) - 1, -1, -1):
        section, where = arm.section[at], first + at
        length = per_run(section.length, runs)
        unit = length_unit(length)
        mass = per_run(section.mass, runs)
        columns = {
            "unit": unit,
            "stiffness": per_run(section.bending_stiffness, runs) * length / unit**2,
            "damping": per_run(section.structural_damping, runs) * length / unit**2,
            "threshold": per_run(section.kappa_s, runs) * unit,
            "axial": _Rod(section, runs).axial_inertia,
            "section_mass": mass,
            "beyond": beyond,
            "reach": (reach + 0.5 * length) / whole,
        }
        for name, values in columns.items():
            plants[name][:, where] = values
        beyond, reach = beyond + mass, reach + length


def _spread(at: Array) -> Array:
    """|r|² 1 - r rᵀ of points (runs, 3)."""
    square = np.einsum("ni,ni->n", at, at)[:, None, None] * np.eye(3)
    return square - at[:, :, None] * at[:, None, :]
