"""A vehicle as nodes of a viser scene, posed frame by frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.interfaces.meshes import ring, tube
from continuair.interfaces.outline import pointing
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.bodies import Bodies, rotors_of
from continuair.viewer.colours import DARK, DISK, GREY, bend_colours, rgb

Array = NDArray[np.float64]

_SIDES = 24
"""Segments of round parts."""

BODY = "body"
"""Name of the node that turns with the UAV."""

_OVERLAP = 1.08
"""Length of a drawn segment over its own, which closes the gaps on the outside of a bend."""


class VehicleNodes:
    """A vehicle in a viser scene; a colour makes it a ghost, translucent and of that colour.

    largest: the bend angle at the end of the scale of colours [rad]; node: at the UAV, with the
    world's axes; below it is BODY, with its own.
    """

    def __init__(
        self,
        api: Any,
        name: str,
        vehicle: Vehicle,
        bodies: Bodies,
        largest: float,
        ghost: str | None = None,
    ) -> None:
        self._largest, self._ghost = largest, ghost
        self.node = api.add_frame(name, show_axes=False)
        body = f"{name}/{BODY}"
        self._body = api.add_frame(body, show_axes=False)
        _add_uav(api, body, vehicle, ghost)
        radius = _thick(ghost) * bodies.radius
        scales = np.column_stack([radius, radius, _OVERLAP * bodies.length])
        self._arm = _add_tubes(
            api, f"{body}/arm", bodies.middle[0], bodies.turn[0], scales, GREY, ghost
        )
        self.tips: list[Any] = []
        if ghost is None:
            size = float(vehicle.reach)
            self.tips = [
                api.add_batched_axes(
                    f"{body}/tips", wxyz_of(bodies.tip_attitude[0]), bodies.tip_position[0],
                    axes_length=0.16 * size, axes_radius=0.006 * size,
                )
            ]  # fmt: skip

    def show(self, bodies: Bodies, frame: int, gone: Array) -> None:
        """Pose the vehicle as in a frame, moved back by what it has gone (3,) [m].

        Arms are posed in the UAV's axes: a browser may show poses and meshes one after the other.
        """
        self.node.position = bodies.position[frame] - gone
        self._body.wxyz = wxyz_of(bodies.attitude[frame])
        _pose(self._arm, bodies, frame, bodies.middle, bodies.turn)
        if self._ghost is None:
            self._arm.batched_colors = bend_colours(bodies.angle[frame], self._largest)
        for tips in self.tips:
            _pose(tips, bodies, frame, bodies.tip_position, bodies.tip_attitude)


def _pose(node: Any, bodies: Bodies, frame: int, at: Array, turns: Array) -> None:
    node.batched_positions = bodies.in_body(frame, at[frame]).astype(np.float32)
    node.batched_wxyzs = wxyz_of(bodies.turned_in_body(frame, turns[frame]))


def wxyz_of(quaternion: Array) -> NDArray[np.float32]:
    """Return quaternions x y z w (..., 4) as viser orders them, w first."""
    return np.roll(np.asarray(quaternion, np.float32), 1, axis=-1)


def _add_uav(api: Any, name: str, vehicle: Vehicle, ghost: str | None) -> None:
    """Hull, booms, motors and rotor disks, in body axes, with the mounts of arms away from it."""
    rotors, look = rotors_of(vehicle), _look(ghost)
    lever = rotors.lever * _thick(ghost)
    thin = 0.035 * lever
    api.add_icosphere(
        f"{name}/hull", 1.0, rgb(ghost or DARK), scale=tuple(_thick(ghost) * rotors.hull), **look
    )  # fmt: skip
    mounts = np.array([arm.mount for arm in vehicle.arms], float).reshape(-1, 3)
    rods = np.vstack([rotors.hubs, mounts[np.linalg.norm(mounts, axis=1) > 0.05 * lever]])
    lengths = np.linalg.norm(rods, axis=1)
    scales = np.column_stack([np.full((len(rods), 2), thin), lengths])
    _add_tubes(api, f"{name}/booms", rods / 2, pointing(rods), scales, GREY, ghost)
    turns = pointing(rotors.axes)
    scales = np.tile([2.4 * thin, 2.4 * thin, 4.0 * thin], (len(turns), 1))
    _add_tubes(api, f"{name}/motors", rotors.hubs, turns, scales, DARK, ghost)
    disks = (rotors.hubs + 2.5 * thin * rotors.axes).astype(np.float32)
    for part, inner, opacity in (("rotors", 0.0, 0.35), ("rims", 0.93, 1.0)):
        flat = ring(inner, 2 * _SIDES)
        api.add_batched_meshes_simple(
            f"{name}/{part}", flat.vertices * rotors.radius, flat.triangles, wxyz_of(turns), disks,
            batched_colors=rgb(ghost or DISK), side="double", lod="off",
            opacity=0.5 * opacity if ghost else opacity, cast_shadow=ghost is None,
            receive_shadow=False,
        )  # fmt: skip
    nose = {"radius": 0.05 * lever, "position": (0.36 * lever, 0.0, 0.02 * lever)}
    api.add_icosphere(f"{name}/nose", color=rgb(ghost or "#D55E00"), **nose, **look)


def _add_tubes(
    api: Any, name: str, at: Array, turns: Array, scales: Array, colour: str, ghost: str | None
) -> Any:
    round_ = tube(np.array([0.5, -0.5]), np.ones(2), _SIDES)
    colours = np.tile(np.array(rgb(ghost or colour), np.uint8), (len(at), 1))
    return api.add_batched_meshes_simple(
        name, round_.vertices, round_.triangles, wxyz_of(turns), at.astype(np.float32),
        batched_scales=scales.astype(np.float32), batched_colors=colours, side="double", lod="off",
        **_look(ghost),
    )  # fmt: skip


def _thick(ghost: str | None) -> float:
    """Return widths of lines; those of a ghost are smaller, so that the vehicle hides it."""
    return 1.0 if ghost is None else 0.9


def _look(ghost: str | None) -> dict[str, Any]:
    if ghost is None:
        return {}
    return {"opacity": 0.5, "cast_shadow": False, "receive_shadow": False}
