"""Messages in the schemas of Foxglove, as JSON: transforms between frames, and shapes in them."""

from __future__ import annotations

from typing import Any

import numpy as np

Message = dict[str, Any]
Array = np.ndarray

_NUMBER, _TEXT, _WHOLE = ({"type": kind} for kind in ("number", "string", "integer"))


def _object(title: str = "", **properties: Any) -> Message:
    named = {"title": title} if title else {}
    return {**named, "type": "object", "properties": properties}


def _list(items: Message) -> Message:
    return {"type": "array", "items": items}


_TIME = _object("time", sec=_WHOLE, nsec=_WHOLE)
_DURATION = _object("duration", sec=_WHOLE, nsec=_WHOLE)
_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_POINT = _object("foxglove.Point3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_COLOR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_CUBE = _object("foxglove.CubePrimitive", pose=_POSE, size=_VECTOR, color=_COLOR)
_LINE = _object(
    "foxglove.LinePrimitive", type=_WHOLE, pose=_POSE, thickness=_NUMBER,
    scale_invariant={"type": "boolean"}, points=_list(_POINT), color=_COLOR,
)  # fmt: skip
_ENTITY = _object(
    "foxglove.SceneEntity", timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_DURATION,
    frame_locked={"type": "boolean"}, cubes=_list(_CUBE), lines=_list(_LINE),
)  # fmt: skip
_TRANSFORM = _object(
    "foxglove.FrameTransform", timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT,
    translation=_VECTOR, rotation=_QUATERNION,
)  # fmt: skip

TRANSFORMS = _object("foxglove.FrameTransforms", transforms=_list(_TRANSFORM))
SCENE = _object("foxglove.SceneUpdate", entities=_list(_ENTITY))


def time(nanoseconds: int) -> Message:
    """Return a time or a duration."""
    return {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}


def vector(values: Array) -> Message:
    """Return components (3,), or those of a quaternion (4,), by name."""
    return dict(zip("xyzw", np.asarray(values, float).tolist(), strict=False))


def transform(at: int, parent: str, child: str, position: Array, attitude: Array) -> Message:
    """Return the transform of a child frame in its parent, at a time [ns]."""
    return {
        "timestamp": time(at), "parent_frame_id": parent, "child_frame_id": child,
        "translation": vector(position), "rotation": vector(attitude),
    }  # fmt: skip


def entity(at: int, frame: str, name: str, **shapes: list[Message]) -> Message:
    """Return an entity in a frame, valid until one of the same name replaces it."""
    return {
        "timestamp": time(at), "frame_id": frame, "id": name, "lifetime": time(0),
        "frame_locked": True, **shapes,
    }  # fmt: skip


def cube(size: Array, attitude: Array, color: tuple[float, ...]) -> Message:
    """Return a box of whole sides (3,) [m] about the origin."""
    pose = {"position": vector(np.zeros(3)), "orientation": vector(attitude)}
    return {"pose": pose, "size": vector(size), "color": dict(zip("rgba", color, strict=True))}


def line(points: Array, thickness: float, color: tuple[float, ...]) -> Message:
    """Return a line through points (n, 3) [m], as thick as it is in the world [m]."""
    here = {"position": vector(np.zeros(3)), "orientation": vector(np.array([0, 0, 0, 1]))}
    return {
        "type": 0, "pose": here,
        "thickness": thickness, "scale_invariant": False, "points": [vector(p) for p in points],
        "color": dict(zip("rgba", color, strict=True)),
    }  # fmt: skip
