"""The camera and its feature points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.backbone import placed, quaternions
from continuair.equations.turns import of_quaternion
from continuair.flight.reading import scenario_of
from continuair.vehicle.camera import Camera
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.bodies import Bodies

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CameraView:
    """The camera over frames: position (F, 3), attitude (F, 4), x y z w, image of the feature
    points (F, n, 2) and where they belong (n, 2) [px], NaN of those not seen."""

    camera: Camera
    position: Array
    attitude: Array
    image: Array
    desired: Array


@dataclass(frozen=True)
class Aim:
    """The target over frames: its centroid (F, 3), and its points (F, n, 3), if they are known."""

    centroid: Array
    points: Array


def camera_view_of(flight: xr.Dataset, vehicle: Vehicle, placed: Bodies) -> CameraView | None:
    """Return the camera of a flight that used it."""
    if "features" not in flight or "feature_error" not in flight:
        return None
    camera, arm = vehicle.camera, vehicle.camera_arm
    if "camera_attitude" in flight:
        attitude = flight["camera_attitude"].transpose("time", "quaternion").to_numpy()
    elif camera.tip_frame == "untwisted":
        tip = of_quaternion(placed.tip_attitude[:, arm])
        attitude = quaternions(tip @ of_quaternion(camera.attitude))
    else:
        return None
    # Of the tip's frame, which spins with the bend if it is Frenet's.
    axes = of_quaternion(attitude) @ of_quaternion(camera.attitude).T
    position = placed.tip_position[:, arm] + axes @ np.asarray(camera.position)
    image = flight["features"].transpose("time", "pixel").to_numpy()
    wanted = image + flight["feature_error"].transpose("time", "pixel").to_numpy()
    finite = np.isfinite(wanted).all(-1)
    desired = wanted[np.argmax(finite)]
    attitude = np.where(np.isfinite(attitude), attitude, attitude[0])
    return CameraView(
        camera,
        position,
        attitude,
        image.reshape(len(image), -1, 2),
        desired.reshape(-1, 2),
    )


def aim_of(flight: xr.Dataset) -> Aim | None:
    """Return the target of a flight that had one."""
    if "target_position" not in flight:
        return None
    centroid = flight["target_position"].transpose("time", "axis").to_numpy()
    points = _points(scenario_of(flight))
    return Aim(centroid, centroid[:, None] + points)


def in_image(view: CameraView, depth: float) -> Array:
    """Return where the feature points' images are on a plane at a depth, world axes (F, n, 3) [m].

    depth: from the camera [m].
    """
    camera = view.camera
    flat = (view.image - np.asarray(camera.principal_point)) / np.asarray(camera.focal_length)
    rays = depth * np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
    return placed(view.position, view.attitude, rays)


def _points(scenario: dict[str, Any]) -> Array:
    """Return feature points about the centroid (n, 3); none if they are not recorded."""
    try:
        target = scenario["target"]
        target = target[0] if isinstance(target, list) else target
        return np.asarray(target["points"], float).reshape(-1, 3)
    except (ValueError, TypeError, KeyError, IndexError):
        return np.empty((0, 3))
