"""Batches of immutable parameter models: fields that vary are arrays over the runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
from pydantic import BaseModel

from continuair import checks
from continuair.typing import Array
from continuair.vehicle import effect
from continuair.vehicle.effect import Effect
from continuair.vehicle.fields import mixed


def count(value: object) -> int | None:
    """Return the number of runs of a batched model, or None if no field is an array."""
    if isinstance(value, np.ndarray):
        return len(value)
    return next((n for child in _children(value) if (n := count(child)) is not None), None)


def pick(value: Any, run: int) -> Any:
    """Return the plain model of one run of a batched model."""
    if isinstance(value, np.ndarray):
        return _tuples(value[run].tolist())
    if isinstance(value, BaseModel):
        return type(value).model_construct(**{name: pick(child, run) for name, child in value})
    if isinstance(value, Effect):
        return _changed(value, lambda child: pick(child, run))
    return tuple(pick(child, run) for child in value) if isinstance(value, tuple) else value


def take(value: Any, runs: np.ndarray) -> Any:
    """Return a batched model of some runs, by their indices; return a plain model unchanged."""
    if isinstance(value, np.ndarray):
        return checks.frozen(value[runs])
    if isinstance(value, BaseModel):
        return type(value).model_construct(**{name: take(child, runs) for name, child in value})
    if isinstance(value, Effect):
        return _changed(value, lambda child: take(child, runs))
    return tuple(take(child, runs) for child in value) if isinstance(value, tuple) else value


def plain(value: Any, runs: int | None = None) -> Any:
    """Return a model, batched or not, as dicts, lists and numbers for JSON.

    runs: of a batch. There a field that holds one number or several has a row for each run, as a
    row alone would be one number per run.
    """
    if isinstance(value, BaseModel):
        found = {name: plain(child, runs) for name, child in value}
        for name in found if runs else ():
            if isinstance(dict(value)[name], tuple) and mixed(type(value), name):
                found[name] = [list(found[name]) for _ in range(runs or 0)]
        return found
    if isinstance(value, Effect):
        return effect.plain(value)
    if isinstance(value, tuple):
        return [plain(child, runs) for child in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _children(value: object) -> Iterator[object]:
    if isinstance(value, BaseModel):
        return (child for _, child in value)
    if isinstance(value, Effect):
        return (getattr(value, each.name) for each in fields(value))
    return iter(value) if isinstance(value, tuple) else iter(())


def _changed(value: Effect, change: Callable[[Any], Any]) -> Effect:
    return replace(
        value, **{each.name: change(getattr(value, each.name)) for each in fields(value)}
    )


def _tuples(value: Any) -> Any:
    return tuple(_tuples(child) for child in value) if isinstance(value, list) else value


def varying(value: Any, path: str = "") -> dict[str, np.ndarray]:
    """Return the scalar fields that vary over the runs, by their dotted names."""
    if isinstance(value, np.ndarray):
        return {path: value} if value.ndim == 1 else {}
    found: dict[str, np.ndarray] = {}
    if isinstance(value, BaseModel):
        for name, field in type(value).model_fields.items():
            inside = f"{path}.{field.alias or name}".lstrip(".")
            found |= varying(getattr(value, name), inside)
    elif isinstance(value, tuple):
        for index, child in enumerate(value):
            found |= varying(child, f"{path}.{getattr(child, 'name', '') or index}")
    return found


def per_run(value: object, runs: int, *shape: int) -> Array:
    """Return a field with a leading dimension for the runs.

    Parameters
    ----------
    value : float, ndarray or tuple
        Field of a vehicle. The field, or any of its elements, may vary over the runs.
    runs : int
        Number of runs.
    *shape : int
        Shape of the field in one run; none for a number.

    Returns
    -------
    ndarray, shape (runs, *shape)
        The values. The array may be a read-only view.
    """
    if isinstance(value, np.ndarray) and value.ndim > len(shape):
        return np.broadcast_to(value, (runs, *shape))
    return np.stack([np.broadcast_to(x, runs) for x in _leaves(value)], -1).reshape(runs, *shape)


def _leaves(value: Any) -> list[Any]:
    return [x for entry in value for x in _leaves(entry)] if isinstance(value, tuple) else [value]
