"""A flight as an animated glTF file, for viewers, Blender and web pages."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from continuair.analysis.backbone import HALF_TURN, curve, parts, quaternions, sections_of
from continuair.analysis.motion import Motion, motion_of
from continuair.errors import InputError
from continuair.files import new_file, printed, save
from continuair.interfaces.glb import Glb
from continuair.interfaces.meshes import closed, cube, tube
from continuair.interfaces.outline import (
    disk_radius,
    equal_box,
    pointing,
    radius_of,
    rotor_radius,
)
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.camera import Camera
from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

RATE = 60.0
"""Keyframes a second at most; samples are taken as they are."""

PIECES = 12
"""Straight pieces of a section."""

_Y_UP = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""Our axes in glTF's, in which y points up: a quarter turn about x."""

_THICKNESS = 0.1
"""Of a disk, over its radius."""


def to_gltf(
    dataset: xr.Dataset, path: str | os.PathLike[str], *, vehicle: Vehicle | None = None
) -> None:
    """Write one flight as an animated .glb file.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of one run of `simulate`.
    path : str or path-like
        Path of the new file, which ends in .glb.
    vehicle : Vehicle, optional
        The simulated vehicle. Default: that of the result's attributes.

    Raises
    ------
    InputError
        If the result is not that of one run, or the file exists or has another suffix.

    Notes
    -----
    The UAV is the box of equal mass and inertia; arms are skinned tubes. The node ``world`` turns
    our axes, z up, into those of glTF. Below it, all is in our axes, in metres, and in seconds
    since the first sample.
    """
    motion = motion_of(dataset, vehicle).at(RATE)
    file = new_file("path", path)
    if file.suffix != ".glb":
        raise InputError("path", f"is {printed(path)}", "name a file that ends in .glb")
    save("path", file, _document(motion).content())


@dataclass(frozen=True)
class _Stage:
    """A document, the accessor of its times, and nodes' shared meshes."""

    glb: Glb
    times: int
    cube: int
    disk: int
    rotor: int
    arm: int
    """material of the arms"""

    def moved(self, node: int, translation: Array, rotation: Array) -> int:
        """Return the node after adding its motion."""
        for path, values in (("translation", translation), ("rotation", rotation)):
            self.glb.move(node, path, self.glb.track(self.times, values))
        return node


def _document(motion: Motion) -> Glb:
    stage, vehicle = _stage(motion), motion.vehicle
    hung = [_box(stage, vehicle.uav.mass, vehicle.uav.inertia)] + _rotors(stage, vehicle.uav)
    skinned, seeing = [], vehicle.camera.tip_frame == "untwisted"
    for index, (arm, bend) in enumerate(parts(vehicle, motion.bend)):
        sees = seeing and index == vehicle.camera_arm
        cameras = [_camera(stage.glb, vehicle.camera)] if sees else []
        joints = _joints(stage, arm, bend, [*_tip(stage, arm), *cameras])
        hung.append(joints[0])
        skinned.append(_skin(stage, arm, joints))
    uav = stage.moved(stage.glb.node("uav", hung), motion.position, motion.attitude)
    world = stage.glb.node("world", [uav], rotation=_Y_UP)
    stage.glb.document |= {"scene": 0, "scenes": [{"nodes": [world, *skinned]}]}
    return stage.glb


def _stage(motion: Motion) -> _Stage:
    glb = Glb()
    body, arm = glb.material(0.2, 0.22, 0.25), glb.material(0.85, 0.4, 0.1)
    disk = closed(tube(np.array([0.5, -0.5]) * _THICKNESS, np.ones(2), 32), 32)
    return _Stage(
        glb,
        times=glb.accessor(motion.time - motion.time[0]),
        cube=glb.mesh(cube(), body),
        disk=glb.mesh(disk, body),
        rotor=glb.mesh(disk, glb.material(0.4, 0.45, 0.5, opacity=0.5)),
        arm=arm,
    )


def _box(stage: _Stage, mass: float, inertia: Any, centre: Any = (0.0, 0.0, 0.0)) -> int:
    box = equal_box(mass, inertia)
    shown = {"mesh": stage.cube, "scale": box.half, "rotation": box.attitude, "translation": centre}
    return stage.glb.node("body", **shown)


def _rotors(stage: _Stage, uav: Uav) -> list[int]:
    if uav.rotors is None:
        return []
    found, radius = [], rotor_radius(uav.rotors)
    for hub, turn in zip(uav.rotors.hubs, pointing(uav.rotors.axes), strict=True):
        shown = {"mesh": stage.rotor, "translation": hub, "rotation": turn}
        found.append(stage.glb.node("rotor", scale=(radius, radius, 0.2 * radius), **shown))
    return found


def _joints(stage: _Stage, arm: ArmChain, bend: Array, at_tip: list[int]) -> list[int]:
    """Return the chain of an arm's frames, each in the one before, from the base to the tip."""
    found: list[int] = []
    children = at_tip
    for section, own in reversed(sections_of(arm, bend)):
        moves = _pieces(stage, section, own)
        disks = _disks(stage, section)
        for piece in reversed(range(PIECES)):
            children = [*children, *disks.get(piece + 1, [])]
            name = f"{arm.name}.{section.name}.{piece + 1}"
            at, turn, tracks = moves[piece]
            node = stage.glb.node(name, children, translation=at, rotation=turn)
            for path, track in zip(("translation", "rotation"), tracks, strict=True):
                stage.glb.move(node, path, track)
            found, children = [node, *found], [node]
        children += disks.get(0, [])
    base = stage.glb.node(arm.name, children, translation=arm.mount, rotation=arm.attitude)
    return [base, *found]


def _pieces(
    stage: _Stage, section: Section, bend: Array
) -> list[tuple[Array, Array, tuple[int, int]]]:
    """Return place, attitude and tracks of each piece of a section in axes of the one before."""
    # All pieces of an arc move alike.
    count = 1 if section.polar else PIECES
    points, frames = curve(
        section, bend, np.arange(PIECES + 1)[: count + 1] * section.length / PIECES
    )
    found = []
    for piece in range(count):
        before = frames[:, piece].swapaxes(-1, -2)
        moved = (before @ (points[:, piece + 1] - points[:, piece])[..., None])[..., 0]
        turn = quaternions(before @ frames[:, piece + 1])
        tracks = stage.glb.track(stage.times, moved), stage.glb.track(stage.times, turn)
        found.append((moved[0], turn[0], tracks))
    return found * (PIECES // count)


def _disks(stage: _Stage, section: Section) -> dict[int, list[int]]:
    """Return nodes of a section's disks, by the joint above them."""
    found: dict[int, list[int]] = {}
    part = section.length / PIECES
    for disk in section.disks:
        joint = min(int(disk.position / part), PIECES)
        radius, below = disk_radius(disk, section), joint * part - disk.position
        shown: dict[str, Any] = {"mesh": stage.disk, "translation": (0.0, 0.0, below)}
        node = stage.glb.node("disk", scale=3 * (radius,), **shown)
        found.setdefault(joint, []).append(node)
    return found


def _tip(stage: _Stage, arm: ArmChain) -> list[int]:
    body = arm.tip
    inside = [_box(stage, body.mass, body.inertia, body.centre)] if body and body.mass else []
    return [stage.glb.node(f"{arm.name}.tip", inside, rotation=HALF_TURN)]


def _camera(glb: Glb, camera: Camera) -> int:
    """Add the camera below the last joint.

    glTF's cameras look along -z, with y up, at the image's centre.
    """
    across, down = np.divide(camera.image_size, camera.focal_length)
    lens = {"yfov": 2.0 * float(np.arctan(down / 2.0)), "aspectRatio": float(across / down)}
    lens["znear"] = 0.01
    lens_index = glb.add("cameras", {"type": "perspective", "perspective": lens})
    tip = Rotation.from_quat(HALF_TURN)
    turn = tip * Rotation.from_quat(camera.attitude) * Rotation.from_quat(HALF_TURN)
    at = tip.apply(camera.position)
    return glb.node("camera", camera=lens_index, translation=at, rotation=turn.as_quat())


def _skin(stage: _Stage, arm: ArmChain, joints: list[int]) -> int:
    """Add the tube around an arm, each of whose rings moves with one joint."""
    lengths = np.repeat([section.length / PIECES for section in arm.section], PIECES)
    heights = -np.append(0.0, np.cumsum(lengths))
    radii = np.repeat([radius_of(section) for section in arm.section], PIECES)
    shape = closed(tube(heights, np.append(radii[0], radii)))
    rings = np.arange(len(heights))
    sides = len(shape.vertices) // (len(rings) + 2)
    bound = np.repeat(np.append(rings, [0, rings[-1]]), sides)
    # Straight, a joint is at its height and not turned.
    inverse = np.tile(np.eye(4), (len(heights), 1, 1))
    inverse[:, 2, 3] = -heights
    skin = {"joints": joints, "inverseBindMatrices": stage.glb.accessor(inverse)}
    mesh = stage.glb.mesh(shape, stage.arm, bound)
    return stage.glb.node(f"{arm.name}.tube", mesh=mesh, skin=stage.glb.add("skins", skin))
