"""A scene as nodes of viser: made once, then posed frame by frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.viewer.bodies import rotors_of
from continuair.viewer.camera import in_image
from continuair.viewer.colours import COLOURS, GREY, GROUPS, HIDDEN, model_colour, rgb
from continuair.viewer.scene import Scene
from continuair.viewer.vehicles import BODY, VehicleNodes, wxyz_of

_WORLD, _VEHICLE, _GHOST = "/world", "/vehicle", "/ghost"

_PLANE = 3.0
"""Width of the plate that a plane is drawn as, over the reach."""

_UPRIGHT = ("push", "command")
"""Forces that do not turn with the UAV: their nodes have the world's axes."""


class Stage:
    """A scene's nodes. parts: node groups that can be hidden, by kind.

    largest: the bend angle at the end of the scale of colours [rad], by default the scene's own.
    """

    def __init__(self, server: Any, scene: Scene, largest: float | None = None) -> None:
        self._server, self.scene = server, scene
        self._api = server.scene
        self.parts: dict[str, list[Any]] = {}
        self.follows = scene.far
        self.largest = largest or scene.largest_bend
        self.frame, self._start = 0, scene.bodies.position[0]
        _light(self._api)
        self._world = self._api.add_frame(_WORLD, show_axes=False)
        self._add_ground()
        self._add_vehicles()
        self._add_trails()
        self._add_target()
        self._add_obstacles()
        self._add_camera()
        self._arrows = self._add_arrows()
        self._place_camera()
        for name in HIDDEN:
            self.set_visible(name, False)
        self.show(0)

    def show(self, frame: int) -> None:
        """Pose everything as in a frame, in one message to browsers."""
        scene, self.frame = self.scene, frame
        with self._server.atomic():
            gone = scene.bodies.position[frame] - self._start if self.follows else np.zeros(3)
            self._world.position = -gone
            for vehicle, bodies in zip(self._vehicles, (scene.bodies, scene.ghost), strict=False):
                assert bodies is not None
                vehicle.show(bodies, frame, gone)
            for name, (node, points) in self._arrows.items():
                if self.is_visible(name):
                    node.points = self._arrows_at(name, points, frame)
            if scene.aim is not None:
                self._target.position = scene.aim.centroid[frame]
            if self._frustum is not None:
                self._show_camera(frame)

    def is_visible(self, part: str) -> bool:
        """Return whether a part is shown."""
        return any(node.visible for node in self.parts.get(part, ()))

    def set_visible(self, part: str, shown: bool) -> None:
        """Show or hide a part, if there is one of that name."""
        for node in self.parts.get(part, ()):
            node.visible = shown

    @property
    def gone_far(self) -> bool:
        """Whether the UAV is too far from its start for a picture that stays there."""
        return self.scene.is_far(self.scene.bodies.position[self.frame] - self._start)

    def _arrows_at(self, name: str, points: Any, frame: int) -> Any:
        """Arrows (n, 2, 3) in axes of their node, without those of no length, which have heads."""
        bodies, found = self.scene.bodies, points[frame]
        long = (found[:, 0] != found[:, 1]).any(axis=-1)
        upright = name in _UPRIGHT
        own = found - bodies.position[frame] if upright else bodies.in_body(frame, found)
        return own[long].astype(np.float32)

    def _show_camera(self, frame: int) -> None:
        view, bodies = self.scene.camera_view, self.scene.bodies
        assert view is not None
        self._frustum.position = bodies.in_body(frame, view.position[frame])
        self._frustum.wxyz = wxyz_of(bodies.turned_in_body(frame, view.attitude[frame][None])[0])
        seen = bodies.in_body(frame, np.nan_to_num(self._images[frame]))
        self._seen.points = seen.astype(np.float32)

    def _add_vehicles(self) -> None:
        scene, largest = self.scene, self.largest
        shown = VehicleNodes(self._api, _VEHICLE, scene.vehicle, scene.bodies, largest)
        self._vehicles = [shown]
        self.parts["tip frames"] = shown.tips
        if scene.ghost is not None:
            colour = model_colour(scene.ghost_model)
            of = scene.vehicle, scene.ghost, largest, colour
            other = VehicleNodes(self._api, _GHOST, *of)
            self._vehicles.append(other)
            self.parts["ghost"] = [other.node]

    def _add_trails(self) -> None:
        scene = self.scene
        flights = {"trail": (scene.bodies, "#4d4d4d")}
        if scene.ghost is not None:
            flights["ghost_trail"] = (scene.ghost, model_colour(scene.ghost_model))
        found = [
            self._add_line(f"{name}_{arm}", bodies.tip_position[:, arm], colour)
            for name, (bodies, colour) in flights.items()
            for arm in range(len(scene.vehicle.arms))
        ]
        if any(found):
            self.parts["tip paths"] = [node for node in found if node is not None]

    def _add_line(self, name: str, points: Any, colour: str, width: float = 1.5) -> Any:
        points = points[:: max(1, len(points) // 1000)]
        if len(points) < 2:
            return None
        return self._api.add_line_segments(
            f"{_WORLD}/{name}",
            np.stack([points[:-1], points[1:]], axis=1).astype(np.float32),
            rgb(colour),
            thickness=width,
            thickness_units="screen",
        )

    def _add_target(self) -> None:
        aim = self.scene.aim
        self._target: Any = None
        if aim is None:
            return
        path = self._add_line("target_path", aim.centroid, "#0072B2", 2.0)
        self._target = self._api.add_frame(
            f"{_WORLD}/target", axes_length=0.12, axes_radius=0.004, position=aim.centroid[0]
        )
        for index, point in enumerate(aim.points[0] - aim.centroid[0]):
            colour = rgb(COLOURS[index % len(COLOURS)])
            self._api.add_icosphere(f"{_WORLD}/target/{index}", 0.022, colour, position=point)
        self.parts["target"] = [self._target, *([] if path is None else [path])]

    def _add_obstacles(self) -> None:
        nodes, wide = [], _PLANE * self.scene.reach
        for index, obstacle in enumerate(self.scene.obstacles):
            x, y, z, *attitude = obstacle.placed()[:7]
            a, b, c = obstacle.placed()[7:]
            name, colour = f"{_WORLD}/obstacle_{index}", rgb(GREY)
            pose: dict[str, Any] = {"position": (x, y, z), "wxyz": wxyz_of(np.array(attitude))}
            look: dict[str, Any] = {"opacity": 0.5, "cast_shadow": False}
            if obstacle.shape == "sphere":
                node = self._api.add_icosphere(name, a, colour, **look, **pose)
            elif obstacle.shape == "cylinder":
                node = self._api.add_cylinder(name, a, 2.0 * b, colour, **look, **pose)
            else:
                # A plane is a thin plate, as wide as the picture.
                size = (wide, wide, 1e-3) if obstacle.shape == "plane" else (2 * a, 2 * b, 2 * c)
                node = self._api.add_box(name, colour, size, **look, **pose)
            nodes.append(node)
        if nodes:
            self.parts["obstacles"] = nodes

    def _add_camera(self) -> None:
        view = self.scene.camera_view
        self._frustum: Any = None
        if view is None:
            return
        across, half = 0.5 * np.divide(view.camera.image_size, view.camera.focal_length)
        depth = 0.28 * self.scene.reach
        self._frustum = self._api.add_camera_frustum(
            f"{_VEHICLE}/{BODY}/camera", 2.0 * np.arctan(half), across / half,
            color=rgb("#0072B2"), scale=depth * np.cbrt(half * across / 3.0), thickness=1.5,
            thickness_units="screen",
        )  # fmt: skip
        self._images = in_image(view, depth)
        colours = [rgb(COLOURS[index % len(COLOURS)]) for index in range(view.image.shape[1])]
        self._seen = self._api.add_point_cloud(
            f"{_VEHICLE}/{BODY}/image", self._images[0].astype(np.float32), np.array(colours),
            point_size=0.06 * depth, point_shape="circle", precision="float32",
        )  # fmt: skip
        self.parts["camera"] = [self._frustum, self._seen]

    def _add_arrows(self) -> dict[str, tuple[Any, Any]]:
        found, self.scale = {}, self.scene.scale
        thick = 0.01 * self.scene.size
        for name, force in self.scene.forces.items():
            points = force.arrows(self.scale)
            on = _VEHICLE if name in _UPRIGHT else f"{_VEHICLE}/{BODY}"
            node = self._api.add_arrows(
                f"{on}/{name.replace(' ', '_')}", self._arrows_at(name, points, 0),
                rgb(GROUPS[name]), shaft_radius=thick, head_radius=2.4 * thick,
                head_length=6.0 * thick,
            )  # fmt: skip
            found[name], self.parts[name] = (node, points), [node]
        return found

    def _add_ground(self) -> None:
        size = self.scene.reach
        cell = 10.0 ** np.round(np.log10(size)) / 2.0
        self.parts["ground"] = [
            self._api.add_grid(
                f"{_WORLD}/ground", infinite_grid=True, cell_size=cell, section_size=4.0 * cell,
                cell_color=(222, 226, 230), section_color=(190, 196, 202), shadow_opacity=0.25,
                fade_distance=40.0 * size, position=(0.0, 0.0, self.scene.floor),
            )
        ]  # fmt: skip

    def _place_camera(self) -> None:
        every = np.concatenate(self._to_see())
        low, high = every.min(axis=0), every.max(axis=0)
        size = max(float(np.linalg.norm(high - low)), 1.5 * self.scene.reach)
        camera = self._server.initial_camera
        camera.fov = np.radians(45.0)
        camera.look_at = (low + high) / 2
        camera.position = (low + high) / 2 + 1.25 * size * np.array([0.75, -0.55, 0.32])

    def _to_see(self) -> list[Any]:
        """Return points in the first picture, relative to the start if it follows the UAV."""
        bodies, aim = self.scene.bodies, self.scene.aim
        rotors = rotors_of(self.scene.vehicle)
        wide = rotors.edge * np.array([[1.0, 1.0, 0.2], [-1.0, -1.0, -0.2]])
        points = [bodies.position[:, None] + wide, *bodies.lines]
        points += [each.reshape(len(each), -1, 3) for name, (_, each) in self._arrows.items()
                   if name not in HIDDEN]  # fmt: skip
        if self.follows:
            return [(each - bodies.position[:, None]).reshape(-1, 3) + self._start
                    for each in points]  # fmt: skip
        if aim is not None:
            points.append(aim.points)
        return [each.reshape(-1, 3) for each in points]


def _light(api: Any) -> None:
    """Soft light from all sides, and one with shadows from above."""
    api.configure_default_lights(enabled=False)
    api.configure_environment_map("studio", environment_intensity=0.15)
    sky, ground = (255, 255, 255), (140, 140, 150)
    api.add_light_hemisphere("/light/sky", sky_color=sky, ground_color=ground, intensity=0.45)
    place = (3.0, -2.0, 8.0)
    api.add_light_directional("/light/sun", intensity=0.8, cast_shadow=True, position=place)
