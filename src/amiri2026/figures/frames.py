"""The paper's Figs. 1 and 2, drawn from the model: the bend's variables, and a vehicle's frames."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from continuair import Vehicle
from continuair.equations import arm_position, position, rotation, section_rotation
from continuair.figures import style

Array = NDArray[np.float64]

_POINTS = 60
_AXES = {"x": "#D55E00", "y": "#009E73", "z": "#0072B2"}
_GREY = "#888888"
_WORDS = {"R": "world", "B": "", "tip": "tip", "camera": "camera"}
# Seen from the side of +x, -y and from above: x to the right, y away, z up.
_VIEW = Rotation.from_euler("zx", [-25.0, -62.0], degrees=True).as_matrix()[:2]

ANGLE = 1.2
"""Bend angle of the whole arm in the drawings, unless a bend is given [rad]."""


def bend_variables(vehicle: Vehicle, kappa: float | None = None, psi_a: float = 0.9) -> Figure:
    """Return the paper's Fig. 1: κ = 1/r, θ_a = κ s, ψa, s and the tip, of a vehicle's arm.

    kappa: not 0 [1/m]; by default the arm turns by ANGLE in all. psi_a [rad]. Left: in space;
    right: in the plane of the bend. Points are of `equations.arm_position`, Eqs. (1) and (2).
    """
    length = vehicle.arm.length
    kappa = ANGLE / length if kappa is None else kappa
    q = np.array([0, 0, 0, 0, 0, 0, kappa, psi_a])
    with style.applied():
        figure = style.new_figure(height=2.9)
        left, right = figure.subplots(1, 2)
        _in_space(left, vehicle, q)
        _in_plane(right, vehicle, q)
        tip = arm_position(vehicle, q, length)
        finding = (
            f"An arm of {length:.3g} m with κ = {kappa:.3g} 1/m is an arc of radius r = "
            f"{1 / kappa:.3g} m that turns by θ = κl = {math.degrees(kappa * length):.3g}° and "
            f"puts its tip {math.hypot(*tip[:2]):.2g} m aside"
        )
        text = f"Vehicle {style.plain(vehicle.name)}; the variables of Fig. 1 of Amiri et al."
        style.head(figure, finding, text)
    return figure


def frames(vehicle: Vehicle, kappa: float | None = None, psi_a: float = 0.2) -> Figure:
    """Return the paper's Fig. 2: the frames R (world), B (UAV), tip and camera of a vehicle.

    kappa, psi_a: as in `bend_variables`. Positions and attitudes are those of `equations`; the UAV
    is tilted and turned so that R and B can be told apart.
    """
    length = vehicle.arm.length
    kappa = ANGLE / length if kappa is None else kappa
    q = np.array([0.9 * length, 0.6 * length, 1.3 * length, 0.1, -0.12, 0.3, kappa, psi_a])
    found = frame_poses(vehicle, q)
    with style.applied():
        figure = style.new_figure(width=style.COLUMN_WIDTH, height=2.7)
        axes = _bare(figure.subplots())
        _draw_vehicle(axes, vehicle, q)
        same = np.allclose(found["tip"][0], found["camera"][0]) and np.allclose(
            found["tip"][1], found["camera"][1]
        )
        shown = {name: pose for name, pose in found.items() if name != "camera" or not same}
        for name, (origin, turned) in shown.items():
            word = "tip = camera" if same and name == "tip" else _WORDS[name]
            _draw_frame(axes, name[0], origin, turned, 0.3 * length, word)
        _link(axes, found["R"][0], found["B"][0])
        down = found["B"][0] - found["tip"][0]
        finding = f"The tip frame is {np.linalg.norm(down):.2g} m from B; " + (
            "the camera's frame is the tip's" if same else _offset(vehicle)
        )
        text = (
            f"Vehicle {style.plain(vehicle.name)}; the frames of Fig. 2 of Amiri et al. "
            "z of the tip is the arm's tangent, z of the camera its line of sight."
        )
        style.head(figure, finding, text)
    return figure


def frame_poses(vehicle: Vehicle, q: Array) -> dict[str, tuple[Array, Array]]:
    """Return origin (3,) [m] and axes, columns of (3, 3), of R, B, tip and camera in the world.

    q: the paper's coordinates (8,).
    """
    length, camera = vehicle.arm.length, vehicle.camera
    body = rotation(q)
    tip = body @ section_rotation(vehicle, q, length, camera.tip_frame)
    at = position(vehicle, q, length)
    seen = tip @ Rotation.from_quat(camera.attitude).as_matrix()
    return {
        "R": (np.zeros(3), np.eye(3)),
        "B": (q[:3], body),
        "tip": (at, tip),
        "camera": (at + tip @ np.asarray(camera.position), seen),
    }


def _in_space(axes: Any, vehicle: Vehicle, q: Array) -> None:
    """The arm below its base, with the plane of the bend, ψa and r."""
    _bare(axes)
    length, (kappa, psi_a) = vehicle.arm.length, q[6:]
    arc = arm_position(vehicle, q, np.linspace(0.0, length, _POINTS))
    out = np.array([math.cos(psi_a), math.sin(psi_a), 0.0])
    centre, tip = out / kappa, arc[-1]
    axes.fill(*(np.vstack([arc, centre]) @ _VIEW.T).T, color="#f2f2f2", lw=0)
    size = 0.42 * length
    _draw_frame(axes, "B", np.zeros(3), np.eye(3), size)
    _path(axes, np.array([np.zeros(3), centre]), color=_GREY, lw=0.8, ls="--")
    _path(axes, np.array([centre, tip]), color=_GREY, lw=0.8, ls="--")
    below = tip * [1, 1, 0]
    _path(axes, np.array([tip, below]), color=_GREY, lw=0.6, ls=":")
    turn = np.linspace(0.0, psi_a, 30)
    bow = 0.6 * size * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    _path(axes, bow, color="#CC79A7", lw=1.2)
    _word(axes, bow[15], r"$\psi_a$", "#CC79A7", (5, -4))
    _path(axes, arc, color="#000000", lw=2.6)
    _word(axes, 0.5 * (centre + tip), r"$r = 1/\kappa$", _GREY, (6, -4))
    _dot(axes, tip, "tip, $s = l$")
    _dot(axes, centre, "centre", _GREY)
    axes.set_title("in space: the bend points $\\psi_a$ from x", loc="left")


def _in_plane(axes: Any, vehicle: Vehicle, q: Array) -> None:
    """The arm in the plane of its bend: arc, centre, r, and θ of a point at s."""
    _bare(axes)
    length, (kappa, psi_a) = vehicle.arm.length, q[6:]
    flat = arm_position(vehicle, q, np.linspace(0.0, length, _POINTS))
    aside = np.array([math.cos(psi_a), math.sin(psi_a), 0.0])
    arc = np.column_stack([flat @ aside, flat[:, 2]])
    some = round(0.62 * _POINTS)
    point, tip, centre = arc[some], arc[-1], np.array([1 / kappa, 0.0])
    axes.plot(*arc.T, color="#cccccc", lw=2.6, solid_capstyle="round")
    axes.plot(*arc[: some + 1].T, color="#000000", lw=2.6, solid_capstyle="round")
    for end in (arc[0], point, tip):
        axes.plot(*np.array([centre, end]).T, color=_GREY, lw=0.8, ls="--")
    angle = np.linspace(math.pi, math.pi + kappa * length * some / (_POINTS - 1), 30)
    bow = centre + 0.3 / kappa * np.column_stack([np.cos(angle), np.sin(angle)])
    axes.plot(*bow.T, color="#CC79A7", lw=1.2)
    _note(axes, bow[12], r"$\theta_a = \kappa s$", "#CC79A7", (-40, -3))
    _note(axes, 0.5 * (centre + arc[0]), r"$r = 1/\kappa$", _GREY, (-8, 4))
    _note(axes, arc[some // 2], "$s$", "#000000", (-11, -3))
    for at, text in ((arc[0], "base, $s = 0$"), (point, "$P_s$"), (tip, "tip, $s = l$")):
        axes.plot(*at, "o", ms=4, color="#000000")
        _note(axes, at, text, "#000000", (-4, 6) if text.startswith("base") else (-4, -12))
    axes.plot(*centre, "o", ms=4, color=_GREY)
    axes.set_title("in the plane of the bend", loc="left")


def _draw_vehicle(axes: Any, vehicle: Vehicle, q: Array) -> None:
    """The UAV as a cross of two booms with rotors, and the arm."""
    length, (origin, body) = vehicle.arm.length, frame_poses(vehicle, q)["B"]
    reach, turn = 0.26 * length, np.linspace(0.0, 2 * math.pi, 40)
    ring = 0.11 * length * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    for angle in np.radians([45, 135, 225, 315]):
        end = reach * np.array([math.cos(angle), math.sin(angle), 0.12])
        _path(axes, origin + np.array([np.zeros(3), end]) @ body.T, color="#666666", lw=2.0)
        _path(axes, origin + (end + ring) @ body.T, color="#666666", lw=1.0)
    arm = position(vehicle, q, np.linspace(0.0, length, _POINTS))
    mount = origin + body @ np.asarray(vehicle.uav.mount)
    _path(axes, np.array([origin, mount]), color="#666666", lw=2.0)
    _path(axes, arm, color="#000000", lw=2.4)


def _draw_frame(
    axes: Any, letter: str, origin: Array, turned: Array, size: float, name: str = ""
) -> None:
    """Three arrows in their colours, with the letter of the frame, and its name in words."""
    for axis, colour, direction in zip(_AXES, _AXES.values(), turned.T, strict=True):
        start, end = origin @ _VIEW.T, (origin + size * direction) @ _VIEW.T
        arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", end, start, arrowprops=arrow, zorder=5)
        axes.plot(*end, alpha=0.0)  # arrows do not count for the limits of the axes
        reach = (origin + 1.2 * size * direction) @ _VIEW.T
        axes.text(*reach, f"${axis}_{letter}$", color=colour, ha="center", va="center")
    if name:
        _word(axes, origin, name, "#000000", (-8, -14), weight="bold", ha="right")


def _link(axes: Any, start: Array, end: Array) -> None:
    _path(axes, np.array([start, end]), color=_GREY, lw=0.7, ls=":")


def _offset(vehicle: Vehicle) -> str:
    camera = vehicle.camera
    turned = Rotation.from_quat(camera.attitude).magnitude() > 0.0 or camera.tip_frame == "frenet"
    away = f"the camera's is {np.linalg.norm(camera.position):.2g} m from it"
    return f"{away}, and turned" if turned else away


def _bare(axes: Any) -> Any:
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.margins(0.12)
    return axes


def _path(axes: Any, points: Array, **properties: Any) -> None:
    axes.plot(*(points @ _VIEW.T).T, solid_capstyle="round", **properties)


def _dot(axes: Any, at: Array, text: str, colour: str = "#000000") -> None:
    axes.plot(*(at @ _VIEW.T), "o", ms=4, color=colour)
    _word(axes, at, text, colour, (6, -3))


def _word(
    axes: Any, at: Array, text: str, colour: str, offset: tuple[float, float], **more: Any
) -> None:
    _note(axes, at @ _VIEW.T, text, colour, offset, **more)


def _note(
    axes: Any, at: Array, text: str, colour: str, offset: tuple[float, float], **more: Any
) -> None:
    axes.annotate(
        text, at, xytext=offset, textcoords="offset points", color=colour, zorder=6, **more
    )
