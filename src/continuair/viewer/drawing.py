"""A scene as a matplotlib picture, frame by frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from numpy.typing import NDArray

from continuair.analysis.backbone import placed
from continuair.figures import style
from continuair.viewer.bodies import Bodies, rotors_of
from continuair.viewer.camera import CameraView
from continuair.viewer.colours import (
    COLOURS,
    DARK,
    GREY,
    GROUPS,
    HIDDEN,
    bend_colours,
    model_colour,
    scale_of_bends,
)
from continuair.viewer.scene import Scene

Array = NDArray[np.float64]

_ROUND = np.linspace(0.0, 2.0 * np.pi, 40)
_TIP_AXES = ("#D55E00", "#009E73", "#0072B2")


class Picture:
    """A scene on a figure; `show` draws one of its frames."""

    def __init__(self, figure: Figure, scene: Scene, name: str) -> None:
        self._scene, self._name = scene, style.plain(name)
        axes: Any = figure.add_axes((0.0, 0.0, 1.0, 0.93), projection="3d")
        axes.set_proj_type("persp", focal_length=0.8)
        axes.view_init(elev=18, azim=-42)
        self._axes = axes
        self._title = figure.text(0.03, 0.95, "", size=9, color="#333333")
        self._largest, self._scale = scene.largest_bend, scene.scale
        self._arrows = {
            name: force.arrows(scene.scale)
            for name, force in scene.forces.items()
            if name not in HIDDEN
        }
        self._key(figure)
        self._bar(figure)
        self._inset = None if scene.camera_view is None else Inset(figure, scene.camera_view)
        self._frame_of_uav = _outline(scene)
        self._low, self._high = self._limits()

    def show(self, frame: int) -> None:
        """Draw a frame in the place of the one before."""
        scene, axes = self._scene, self._axes
        axes.clear()
        axes.set_axis_off()
        gone = scene.bodies.position[frame] - scene.bodies.position[0] if scene.far else 0.0
        low, high = self._low + gone, self._high + gone
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low, zoom=1.25)
        self._title.set_text(f"{self._name}   {scene.times[frame]:.2f} s")
        self._draw_ground(low, high)
        self._draw_target(frame)
        if scene.ghost is not None:
            self._draw_vehicle(scene.ghost, frame, model_colour(scene.ghost_model))
        self._draw_trail(frame)
        self._draw_vehicle(scene.bodies, frame, None)
        self._draw_forces(frame)
        if self._inset is not None:
            self._inset.show(frame)

    def _key(self, figure: Figure) -> None:
        """Draw colours and lengths at the right, and how flights ended at the left."""
        scene = self._scene
        said = [(f"{scene.model} model".strip(), DARK)]
        if scene.ghost is not None:
            said.append((f"{scene.ghost_model} model", model_colour(scene.ghost_model)))
        said += [(name, GROUPS[name]) for name in self._arrows]
        if self._arrows:
            said.append((f"arrows: 0.1 m is {0.1 / self._scale:.3g} N", DARK))
        for index, (name, colour) in enumerate(reversed(said)):
            figure.text(0.97, 0.03 + 0.035 * index, name, size=8, color=colour, ha="right")
        for index, note in enumerate(scene.notes):
            figure.text(0.03, 0.91 - 0.035 * index, note, size=7, color="#B00020")

    def _bar(self, figure: Figure) -> None:
        """Draw the scale of colours of bends, if there are arms."""
        if not self._scene.vehicle.arms:
            return
        bar = figure.add_axes((0.06, 0.06, 0.22, 0.015))
        bar.imshow(scale_of_bends()[None], aspect="auto", extent=(0.0, 1.0, 0.0, 1.0))
        bar.set(yticks=[], xticks=[0.0, 1.0])
        bar.set_xticklabels(["straight", f"{np.degrees(self._largest):.3g}°"], size=7)
        bar.set_title("bend of a section", size=7, pad=2)

    def _limits(self) -> tuple[Array, Array]:
        scene = self._scene
        every = [*(line.reshape(-1, 3) for line in scene.bodies.lines), scene.bodies.position]
        if scene.aim is not None:
            every.append(scene.aim.points.reshape(-1, 3))
        if scene.far:
            every = [*(line[0] for line in scene.bodies.lines), scene.bodies.position[:1]]
        points = np.concatenate(every)
        low, high = points.min(axis=0), points.max(axis=0)
        middle, half = (low + high) / 2, (high - low) / 2 + 0.45 * scene.reach
        half[:2] = half[:2].max()
        return middle - half, middle + half

    def _draw_ground(self, low: Array, high: Array) -> None:
        height = self._scene.floor if low[2] < self._scene.floor < high[2] else low[2]
        cell = 0.5 * self._scene.reach
        for axis, other in ((0, 1), (1, 0)):
            ticks = np.arange(np.ceil(low[axis] / cell), np.floor(high[axis] / cell) + 1) * cell
            lines = np.full((len(ticks), 2, 3), height)
            lines[..., axis] = ticks[:, None]
            lines[..., other] = low[other], high[other]
            self._lines(lines, color="#d5dade", linewidth=0.6)

    def _draw_vehicle(self, bodies: Bodies, frame: int, ghost: str | None) -> None:
        alpha = 1.0 if ghost is None else 0.45
        for index, line in enumerate(self._frame_of_uav):
            colour = ghost or (DARK if index == 0 else GREY)
            points = placed(bodies.position[frame], bodies.attitude[frame], line)
            self._axes.plot(*points.T, color=colour, lw=2.2 if index == 0 else 1.2, alpha=alpha)
        pieces = len(bodies.length) // max(len(bodies.lines), 1)
        for arm, points in enumerate(line[frame] for line in bodies.lines):
            angle = bodies.angle[frame, arm * pieces : (arm + 1) * pieces]
            if ghost is None:
                colours = bend_colours(angle, self._largest) / 255.0
                self._lines(_pieces(points), color=colours, linewidth=3.0)
            else:
                self._axes.plot(*points.T, color=ghost, lw=3.0, alpha=alpha)
        if ghost is None:
            self._draw_tips(bodies, frame)

    def _draw_tips(self, bodies: Bodies, frame: int) -> None:
        size = 0.14 * self._scene.reach
        tips = zip(bodies.tip_position[frame], bodies.tip_attitude[frame], strict=True)
        for at, attitude in tips:
            ends = placed(at, attitude, size * np.eye(3))
            self._lines(np.stack([0.0 * ends + at, ends], 1), color=_TIP_AXES, linewidth=1.6)

    def _draw_trail(self, frame: int) -> None:
        for arm in range(self._scene.bodies.tip_position.shape[1]):
            path = self._scene.bodies.tip_position[: frame + 1, arm]
            self._axes.plot(*path.T, color="#777777", lw=0.8)

    def _draw_target(self, frame: int) -> None:
        aim = self._scene.aim
        if aim is None:
            return
        self._axes.plot(*aim.centroid.T, color="#0072B2", lw=0.9)
        for index, point in enumerate(aim.points[frame]):
            self._axes.plot(*point[:, None], "o", ms=4, color=COLOURS[index % len(COLOURS)])

    def _draw_forces(self, frame: int) -> None:
        for name, arrows in self._arrows.items():
            ends = arrows[frame][(arrows[frame, :, 0] != arrows[frame, :, 1]).any(axis=-1)]
            look = {"color": GROUPS[name], "lw": 1.4}
            self._lines(ends, **look)
            self._lines(_heads(ends, 0.04 * self._scene.size), **look)

    def _lines(self, lines: Array, **look: Any) -> None:
        collection = Line3DCollection(lines, capstyle="round", **look)
        self._axes.add_collection3d(collection, autolim=False)


class Inset:
    """The camera's image in a corner: tracks, where points belong, and where they are."""

    def __init__(self, figure: Figure, view: CameraView) -> None:
        self._camera_view = view
        width, height = view.camera.image_size
        axes = figure.add_axes((0.03, 0.62, 0.24, 0.27))
        axes.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[], aspect="equal")
        colours = [COLOURS[index % len(COLOURS)] for index in range(view.image.shape[1])]
        for index, colour in enumerate(colours):
            axes.plot(*view.image[:, index].T, color=colour, alpha=0.45, lw=0.8)
        axes.plot(*view.desired.T, "+", color="#333333", ms=6)
        u, v = view.image[0].T
        self._points = axes.scatter(u, v, c=colours, s=14)

    def show(self, frame: int) -> None:
        """Show the image of a frame."""
        self._points.set_offsets(self._camera_view.image[frame])


def _heads(arrows: Array, longest: float) -> Array:
    """Return the four lines of the head of each arrow (n, 2, 3), no longer than so many metres."""
    back = arrows[:, 0] - arrows[:, 1]
    length = np.linalg.norm(back, axis=-1, keepdims=True)
    back = back / length
    side = np.cross(back, np.where(np.abs(back[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    side = side / np.linalg.norm(side, axis=-1, keepdims=True)
    size, other = np.minimum(0.4 * length, longest), np.cross(back, side)
    fins = [arrows[:, 1] + size * (back + 0.4 * across) for across in (side, -side, other, -other)]
    return np.concatenate([np.stack([arrows[:, 1], fin], axis=1) for fin in fins])


def _pieces(points: Array) -> Array:
    return np.stack([points[:-1], points[1:]], axis=1)


def _outline(scene: Scene) -> list[Array]:
    """Return lines of a UAV in body axes: its hull, then booms, rods to mounts and rotor rims."""
    rotors = rotors_of(scene.vehicle)
    hull = 0.22 * rotors.lever * np.column_stack([np.cos(_ROUND), np.sin(_ROUND), 0.0 * _ROUND])
    ends = [*rotors.hubs, *(np.asarray(arm.mount, float) for arm in scene.vehicle.arms)]
    rods = [np.stack([np.zeros(3), end]) for end in ends]
    rims = []
    for hub, axis in zip(rotors.hubs, rotors.axes, strict=True):
        across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        across /= np.linalg.norm(across)
        along = np.cross(axis, across)
        turn = np.outer(np.cos(_ROUND), across) + np.outer(np.sin(_ROUND), along)
        rims.append(hub + rotors.radius * turn)
    return [hull, *rods, *rims]
