"""Solid objects of a scene, which arms touch: planes, spheres, boxes and cylinders."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.typing import ArrayLike

UPRIGHT = (0.0, 0.0, 0.0, 1.0)

SPOTS = (0.25, 0.5, 0.75, 1.0)
"""Places along a section at which it touches, over its length."""


@dataclass(frozen=True, kw_only=True)
class Obstacle(Immutable):
    """A solid object at rest, with the law of its contact.

    Parameters
    ----------
    stiffness : float, default 1e4
        Normal force over the depth to the power 1.5 [N/m^1.5].
    damping : float, default 0.0
        Increase of the normal force per speed of approach [s/m]; 0 for elastic contact.
    friction : float, default 0.0
        Coefficient of friction [-].
    slip_speed : float, default 0.01
        Speed at which friction has reached 0.7 of its limit [m/s]; it creeps below.

    Raises
    ------
    InputError
        If a number cannot be used.
    """

    shape: ClassVar[str] = ""

    stiffness: float = 1e4
    damping: float = 0.0
    friction: float = 0.0
    slip_speed: float = 0.01

    def __init_subclass__(cls) -> None:
        """Add the parameters that all shapes share to the docstring of a shape."""
        shared = inspect.cleandoc(Obstacle.__doc__ or "").split("-" * 10)[1].split("Raises")[0]
        before, rule, own = inspect.cleandoc(cls.__doc__ or "").partition("-" * 10)
        cls.__doc__ = f"{before}{rule}\n{shared.strip()}{own}\n"

    def __post_init__(self) -> None:
        for each in fields(self):
            value, name = getattr(self, each.name), f"{type(self).__name__}.{each.name}"
            if each.name in ("damping", "friction"):
                found: Any = checks.number(name, value, least=0.0)
            elif each.name in ("point", "centre", "normal"):
                found = tuple(checks.vector(name, value, 3).tolist())
            elif each.name == "size":
                found = tuple(checks.vector(name, value, 3).tolist())
                if min(found) <= 0.0:
                    raise InputError(name, f"is {shown(found)}", "give 3 lengths above 0 [m]")
            elif each.name == "attitude":
                found = tuple(_unit(name, checks.vector(name, value, 4)).tolist())
            else:
                found = checks.positive(name, value)
            object.__setattr__(self, each.name, found)
        if hasattr(self, "normal"):
            _unit(f"{type(self).__name__}.normal", np.array(self.normal))

    @property
    def law(self) -> tuple[float, ...]:
        """Return stiffness, damping, friction and slip speed."""
        return self.stiffness, self.damping, self.friction, self.slip_speed

    def placed(self) -> tuple[float, ...]:
        """Return position (3) [m], attitude (4) x y z w to world axes, and sizes (3) [m].

        Returns
        -------
        tuple of float
            Ten numbers; the sizes are half lengths, or radius and half length.
        """
        raise NotImplementedError

    def describe(self) -> dict[str, object]:
        """Return the shape and all fields.

        Returns
        -------
        dict of str to object
            Values for JSON.
        """
        return {"shape": self.shape} | {
            each.name: getattr(self, each.name) for each in fields(self)
        }


def _unit(name: str, vector: Any) -> Any:
    """Return a vector of length 1, or raise InputError for one of length 0."""
    size = float(np.linalg.norm(vector))
    if not size > 0.0:
        raise InputError(name, f"is {shown(vector)}, of length 0", "give a direction")
    return vector / size


@dataclass(frozen=True, kw_only=True)
class Plane(Obstacle):
    """Half a space, solid below a plane.

    Parameters
    ----------
    point : array_like, shape (3,), default (0, 0, 0)
        A point of the plane in world axes [m].
    normal : array_like, shape (3,), default (0, 0, 1)
        Direction out of the solid, in world axes.
    """

    shape: ClassVar[str] = "plane"

    point: ArrayLike = (0.0, 0.0, 0.0)
    normal: ArrayLike = (0.0, 0.0, 1.0)

    def placed(self) -> tuple[float, ...]:
        """Return the point and the attitude whose z is the normal, as `Obstacle.placed`.

        Returns
        -------
        tuple of float
            Ten numbers.
        """
        n = _unit("normal", np.array(self.normal))
        # The shortest turn from z; from -z half a turn about x.
        turn = np.array([-n[1], n[0], 0.0, 1.0 + n[2]])
        if 1.0 + n[2] < 1e-12:
            turn = np.array([1.0, 0.0, 0.0, 0.0])
        turn /= np.linalg.norm(turn)
        return (*np.array(self.point).tolist(), *turn.tolist(), 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Sphere(Obstacle):
    """A solid sphere.

    Parameters
    ----------
    centre : array_like, shape (3,)
        Its centre in world axes [m].
    radius : float
        Its radius [m].
    """

    shape: ClassVar[str] = "sphere"

    centre: ArrayLike
    radius: float

    def placed(self) -> tuple[float, ...]:
        """Return the centre and the radius, as `Obstacle.placed`.

        Returns
        -------
        tuple of float
            Ten numbers.
        """
        return (*np.array(self.centre).tolist(), *UPRIGHT, self.radius, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Box(Obstacle):
    """A solid box.

    Parameters
    ----------
    centre : array_like, shape (3,)
        Its centre in world axes [m].
    size : array_like, shape (3,)
        Its lengths along its own axes [m].
    attitude : array_like, shape (4,), default (0, 0, 0, 1)
        Rotation from its axes to world axes, a quaternion x y z w.
    """

    shape: ClassVar[str] = "box"

    centre: ArrayLike
    size: ArrayLike
    attitude: ArrayLike = UPRIGHT

    def placed(self) -> tuple[float, ...]:
        """Return centre, attitude and half lengths, as `Obstacle.placed`.

        Returns
        -------
        tuple of float
            Ten numbers.
        """
        half = 0.5 * np.array(self.size)
        return (*np.array(self.centre).tolist(), *np.array(self.attitude).tolist(), *half.tolist())


@dataclass(frozen=True, kw_only=True)
class Cylinder(Obstacle):
    """A solid cylinder about the z axis of its own axes.

    Parameters
    ----------
    centre : array_like, shape (3,)
        Its centre in world axes [m].
    radius : float
        Its radius [m].
    length : float
        Its length [m].
    attitude : array_like, shape (4,), default (0, 0, 0, 1)
        Rotation from its axes to world axes, a quaternion x y z w.
    """

    shape: ClassVar[str] = "cylinder"

    centre: ArrayLike
    radius: float
    length: float
    attitude: ArrayLike = UPRIGHT

    def placed(self) -> tuple[float, ...]:
        """Return centre, attitude, radius and half length, as `Obstacle.placed`.

        Returns
        -------
        tuple of float
            Ten numbers.
        """
        place = np.array(self.centre).tolist(), np.array(self.attitude).tolist()
        return (*place[0], *place[1], self.radius, 0.5 * self.length, 0.0)


def obstacles_of(told: object) -> tuple[Obstacle, ...]:
    """Return obstacles from their descriptions, those of `Obstacle.describe`.

    Parameters
    ----------
    told : sequence of mapping
        What a result's scenario holds; anything else is no obstacle.

    Returns
    -------
    tuple of Obstacle
        The obstacles.

    Raises
    ------
    InputError
        If a number cannot be used.
    """
    kinds = {kind.shape: kind for kind in (Plane, Sphere, Box, Cylinder)}
    found = []
    for each in told if isinstance(told, (list, tuple)) else ():
        kind = kinds.get(str(each.get("shape"))) if isinstance(each, Mapping) else None
        known = {field.name for field in fields(kind)} if kind else set()
        if kind is not None and known == each.keys() - {"shape"}:
            found.append(kind(**{name: each[name] for name in known}))
    return tuple(found)
