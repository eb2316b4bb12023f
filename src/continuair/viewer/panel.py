"""Controls and texts beside the picture of a view."""

from __future__ import annotations

import html
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from continuair.viewer.camera import CameraView
from continuair.viewer.colours import COLOURS, GROUPS, MEANINGS, model_colour, scale_of_bends
from continuair.viewer.player import Player
from continuair.viewer.scene import Scene
from continuair.viewer.stage import Stage

_SPEEDS = ("0.05", "0.1", "0.25", "0.5", "1", "2", "4", "8")

_ALONG = "Move the picture along with the UAV."

_TRACK = 250
"""Points of a track in the image at most."""


class Panel:
    """Controls and readings of a stage; it follows the player, if there is one, and steers it."""

    def __init__(self, server: Any, stage: Stage, player: Player | None) -> None:
        self._stage, self._gui, self._player = stage, server.gui, player
        if player is not None:
            self._add_playing(player)
        self._readings = self._gui.add_html(readings(stage.scene, 0))
        self._legend = self._gui.add_html(legend(stage))
        self._image = None
        if stage.scene.camera_view is not None:
            self._image = Image(stage.scene.camera_view)
            with self._gui.add_folder("Image of the camera"):
                self._seen = self._gui.add_html(self._image.at(0))
        with self._gui.add_folder("Shown", expand_by_default=self._image is None):
            self._along = self._add_parts()

    def follow(self, frame: int) -> None:
        """Show the readings of a frame."""
        if self._player is not None:
            self._slider.value = round(float(self._stage.scene.times[frame]), 4)
            self._button.label = _word(self._player)
        self._readings.content = readings(self._stage.scene, frame)
        if self._image is not None:
            self._seen.content = self._image.at(frame)

    def _add_playing(self, player: Player) -> None:
        times, gui = self._stage.scene.times, self._gui
        first, last = float(times[0]), float(times[-1])
        step = max(1e-4, round((last - first) / max(1, len(times) - 1), 4))
        end = max(last, first + step)
        self._slider = slider = gui.add_slider("Time [s]", first, end, step, first)
        self._button = button = gui.add_button(_word(player))
        speed = gui.add_dropdown("Speed", _SPEEDS, initial_value="1")
        loop = gui.add_checkbox("Loop", player.loop)

        def seek(event: Any) -> None:
            if event.client_id is not None:  # not by the player itself
                player.seek(float(slider.value))

        def toggle(_event: Any) -> None:
            if not player.playing and player.shown == len(times) - 1:
                player.seek(first)
            player.playing = not player.playing
            button.label = _word(player)

        slider.on_update(seek)
        button.on_click(toggle)
        speed.on_update(lambda _event: setattr(player, "speed", float(speed.value)))
        loop.on_update(lambda _event: setattr(player, "loop", loop.value))

    def go_along(self) -> None:
        """Make the picture follow the UAV from now on."""
        self._along.value = self._stage.follows = True

    def _add_parts(self) -> Any:
        stage = self._stage
        along = self._gui.add_checkbox("follow", stage.follows, hint=_ALONG)

        def follow(_event: Any) -> None:
            stage.follows = along.value
            stage.show(stage.frame)

        along.on_update(follow)
        for name in stage.parts:
            self._add_part(name)
        return along

    def _add_part(self, name: str) -> None:
        stage = self._stage
        box = self._gui.add_checkbox(name, stage.is_visible(name), hint=MEANINGS.get(name))

        def change(_event: Any) -> None:
            stage.set_visible(name, box.value)
            stage.show(stage.frame)
            self._legend.content = legend(stage)

        box.on_update(change)


def _word(player: Player) -> str:
    return "Pause" if player.playing else "Play"


def readings(scene: Scene, frame: int) -> str:
    """Return the numbers of a frame, as HTML."""
    bodies = scene.bodies
    x, y, z = bodies.position[frame]
    bend = np.degrees(bodies.largest[frame])
    rows = [
        ("time", f"{scene.times[frame]:.2f} s"),
        ("UAV", f"{x:z.2f}, {y:z.2f}, {z:z.2f} m"),
        ("largest bend", f"{bend:.1f}°"),
    ]
    if scene.ghost is not None:
        far = scene.apart[frame]
        said = f"{1e3 * far:.2f} mm" if far < 1.0 else f"{far:.2f} m"
        rows.append((f"tip to that of {scene.ghost_model}", said if np.isfinite(far) else "ended"))
    if scene.camera_view is not None:
        error = np.linalg.norm(
            scene.camera_view.image[frame] - scene.camera_view.desired, axis=-1
        ).max()
        rows.append(("largest feature error", f"{error:.2f} px"))
    cells = "".join(
        f"<tr><td style='opacity:.65;padding-right:1em'>{html.escape(name)}</td>"
        f"<td style='text-align:right;font-variant-numeric:tabular-nums'>{value}</td></tr>"
        for name, value in rows
    )
    return f"<table style='font-size:.8em;margin:.3em .9em;width:90%'>{cells}</table>"


class Image:
    """The camera's image as SVG: tracks of the feature points, where they belong, and are."""

    def __init__(self, view: CameraView) -> None:
        self._camera_view = view
        width, height = view.camera.image_size
        unit = width / 100
        self._colours = [COLOURS[index % len(COLOURS)] for index in range(view.image.shape[1])]
        drawn = [self._track(index, colour) for index, colour in enumerate(self._colours)]
        drawn += [_cross(u, v, 2.0 * unit) for u, v in view.desired if np.isfinite(u + v)]
        self._size = 1.6 * unit
        self._before = (
            f"<svg viewBox='0 0 {width} {height}' stroke-width='{0.7 * unit:.1f}' style='width:54%;"
            f"margin:.4em 23%;background:#fff;border:1px solid #bbb'>{''.join(drawn)}"
        )

    def at(self, frame: int) -> str:
        """Return the image of a frame."""
        points = zip(self._camera_view.image[frame], self._colours, strict=True)
        dots = [
            f"<circle cx='{u:.1f}' cy='{v:.1f}' r='{self._size:.1f}' fill='{colour}'/>"
            for (u, v), colour in points
            if np.isfinite(u + v)
        ]
        return f"{self._before}{''.join(dots)}</svg>"

    def _track(self, index: int, colour: str) -> str:
        track = self._camera_view.image[:, index]
        track = track[np.isfinite(track).all(-1)]
        line = " ".join(f"{u:.0f},{v:.0f}" for u, v in track[:: max(1, len(track) // _TRACK)])
        return f"<polyline points='{line}' fill='none' stroke='{colour}' opacity='.45'/>"


def _cross(u: float, v: float, size: float) -> str:
    path = f"M{u - size:.0f} {v:.0f}h{2 * size:.0f}M{u:.0f} {v - size:.0f}v{2 * size:.0f}"
    return f"<path d='{path}' stroke='#333'/>"


def legend(stage: Stage) -> str:
    """Return as HTML how flights ended, and the meaning of colours and lengths shown."""
    scene = stage.scene
    stops = ", ".join(to_hex(colour / 255.0) for colour in scale_of_bends()[::51])
    largest = np.degrees(stage.largest)
    lines = [
        *(f"<div style='color:#B00020'>{html.escape(note)}</div>" for note in scene.notes),
        f"<div style='height:.6em;background:linear-gradient(90deg,{stops})'></div>"
        f"<div style='display:flex;justify-content:space-between'><span>straight</span>"
        f"<span>bend of a section</span><span>{largest:.3g}°</span></div>"
        if scene.vehicle.arms
        else "",
    ]
    forces = {name: GROUPS[name] for name in scene.forces if stage.is_visible(name)}
    shown = dict(forces)
    if stage.is_visible("ghost"):
        shown[f"{scene.ghost_model} ghost"] = model_colour(scene.ghost_model)
    if shown:
        dots = (f"<span style='color:{colour}'>■</span> {html.escape(name)}"
                for name, colour in shown.items())  # fmt: skip
        lines.append(f"<div>{' &nbsp;'.join(dots)}</div>")
    if forces:
        lines.append(f"<div>arrows: 0.1 m is {0.1 / stage.scale:.3g} N</div>")
    if stage.is_visible("ground"):
        lines.append(f"<div>ground at z = {scene.floor:z.2f} m</div>")
    return f"<div style='font-size:.75em;margin:.3em .9em'>{''.join(lines)}</div>"
