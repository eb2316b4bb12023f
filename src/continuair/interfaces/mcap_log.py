"""A flight as an MCAP log, for Foxglove and other viewers of robot logs."""

from __future__ import annotations

import heapq
import io
import json
import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.backbone import TIP, along, parts, quaternions
from continuair.analysis.motion import Motion, motion_of
from continuair.files import new_file, save
from continuair.flight.provenance import model_of
from continuair.flight.reading import scenario_of
from continuair.interfaces import foxglove
from continuair.interfaces.acting import Acting, acting_on, warn_of_lacking
from continuair.interfaces.logged import Column, columns_of
from continuair.interfaces.outline import equal_box, radius_of
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.layout import OF_NAME
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray
Message = dict[str, Any]

RATE = 60.0
"""Pictures of the arms a second at most."""

PIECES = 16
"""Straight pieces of a section."""

_GREY, _ORANGE = (0.25, 0.27, 0.3, 1.0), (0.85, 0.4, 0.1, 1.0)
_KEPT = ("method", "versions")


def to_mcap(
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    *,
    vehicle: Vehicle | None = None,
    scenario: Scenario | None = None,
) -> None:
    """Write one flight as an MCAP log of JSON messages.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of one run of `simulate`.
    path : str or path-like
        Path of the new file.
    vehicle : Vehicle, optional
        The simulated vehicle. Default: that of the result's attributes.
    scenario : Scenario, optional
        The simulated scenario. A result does not hold its functions of time.

    Raises
    ------
    InputError
        If the result is not that of one run, the file exists, or the package mcap is not installed
        (extra ``mcap``).

    Warns
    -----
    ContinuairWarning
        If the log lacks inputs, which it names.

    Notes
    -----
    Messages have the times of the samples, from 0 on. Topics: ``/tf``, frames world, uav and the
    tip of every arm (foxglove.FrameTransforms); ``/scene``, the UAV's box and the arms as lines
    (foxglove.SceneUpdate); ``/flight``, all logged signals, and ``/inputs``, with units in their
    schemas.
    """
    checks.installed("mcap", "mcap")
    motion = motion_of(dataset, vehicle)
    file = new_file("path", path)
    acting = acting_on(motion, scenario)
    warn_of_lacking(acting.untold, 2, file.name)
    save("path", file, _log(motion, acting))


def _log(motion: Motion, acting: Acting) -> bytes:
    from mcap.writer import Writer

    content = io.BytesIO()
    writer = Writer(content)
    writer.start(profile="", library="continuair")
    told = {name: str(motion.dataset.attrs.get(name, "")) for name in _KEPT}
    told["scenario"] = json.dumps(scenario_of(motion.dataset))
    told["model"] = model_of(motion.dataset)
    told["vehicle"] = json.dumps(motion.vehicle.describe())
    writer.add_metadata("continuair", told)
    streams = [
        ("/tf", foxglove.TRANSFORMS, _transforms(motion)),
        ("/scene", foxglove.SCENE, _scene(motion.at(RATE))),
        ("/flight", *_numbers("continuair.Flight", motion, list(columns_of(motion)))),
    ]
    if acting.inputs:
        numbers = _numbers("continuair.Inputs", motion, list(_of_inputs(motion, acting)))
        streams.append(("/inputs", *numbers))
    channels = []
    for topic, schema, messages in streams:
        text = json.dumps(schema).encode()
        known = writer.register_schema(schema["title"], "jsonschema", text)
        channel = writer.register_channel(topic, "json", known)
        channels.append(_stamped(channel, messages))
    for at, channel, message in heapq.merge(*channels, key=lambda each: each[:2]):
        text = json.dumps(message, allow_nan=False).encode()
        writer.add_message(channel, at, text, at)
    writer.finish()
    return content.getvalue()


def _stamped(channel: int, messages: Iterator[tuple[int, Message]]) -> Iterator[Any]:
    return ((at, channel, message) for at, message in messages)


def _nanoseconds(motion: Motion) -> list[int]:
    return [round(1e9 * each) for each in motion.time.tolist()]


def _transforms(motion: Motion) -> Iterator[tuple[int, Message]]:
    tips = [_tip(arm, bend) for arm, bend in parts(motion.vehicle, motion.bend)]
    for i, at in enumerate(_nanoseconds(motion)):
        frames = [foxglove.transform(at, "world", "uav", motion.position[i], motion.attitude[i])]
        for arm, (point, turn) in zip(motion.vehicle.arms, tips, strict=True):
            frames.append(foxglove.transform(at, "uav", f"{arm.name}.tip", point[i], turn[i]))
        yield at, {"transforms": frames}


def _tip(arm: ArmChain, bend: Array) -> tuple[Array, Array]:
    """Return points (n, 3) [m] and attitudes (n, 4), body axes."""
    points, frames = along(arm, bend, 2)
    return points[:, -1], quaternions(frames[:, -1] @ TIP)


def _scene(motion: Motion) -> Iterator[tuple[int, Message]]:
    uav, times = motion.vehicle.uav, _nanoseconds(motion)
    box = equal_box(uav.mass, uav.inertia)
    cube = foxglove.cube(2.0 * box.half, box.attitude, _GREY)
    body = foxglove.entity(times[0], "uav", "uav", cubes=[cube])
    arms = [
        along(arm, bend, PIECES * len(arm.section) + 1)[0]
        for arm, bend in parts(motion.vehicle, motion.bend)
    ]
    for i, at in enumerate(times):
        seen = [body] if i == 0 else []
        for arm, points in zip(motion.vehicle.arms, arms, strict=True):
            line = foxglove.line(points[i], 2.0 * radius_of(arm.section[0]), _ORANGE)
            seen.append(foxglove.entity(at, "uav", f"{arm.name}.arm", lines=[line]))
        yield at, {"entities": seen}


def _of_inputs(motion: Motion, acting: Acting) -> Iterator[Column]:
    arms = motion.vehicle.arms
    parts = {
        "arm": [arm.name for arm in arms],
        "section": [f"{arm.name}.{section.name}" for arm in arms for section in arm.section],
    }
    for name, values in acting.inputs.items():
        told = OF_NAME[name]
        units = told.units.split(", ")
        for index, column in enumerate(values.T):
            part, component = divmod(index, len(told.axes))
            axis = told.axes[component]
            if name == "tip_wrench":
                axis = f"{('force', 'moment')[component // 3]}_{axis}"
            unit = units[component // 3 % len(units)]
            yield Column(name, (*parts.get(told.per, [])[part : part + 1], axis), unit, column)


def _key(label: str) -> str:
    """Return a label as viewers take it in a path: no dots, and no digit first."""
    found = label.replace(".", "_")
    return f"_{found}" if found[0].isdigit() else found


def _numbers(
    title: str, motion: Motion, columns: list[Column]
) -> tuple[Message, Iterator[tuple[int, Message]]]:
    """Yield schema and messages of columns."""
    schema: Message = {"title": title, "type": "object", "properties": {}}
    for column in columns:
        inside, (*outer, last) = schema, _path(column)
        for key in outer:
            inside = inside["properties"].setdefault(key, {"type": "object", "properties": {}})
        inside["properties"][last] = {"type": "number", "description": column.unit}
    return schema, _rows(motion, columns)


def _rows(motion: Motion, columns: list[Column]) -> Iterator[tuple[int, Message]]:
    """Return rows with null for values that are not finite, as JSON needs."""
    table = np.column_stack([column.values for column in columns]).astype(float)
    values = table.astype(object)
    values[~np.isfinite(table)] = None
    paths = [_path(column) for column in columns]
    for at, row in zip(_nanoseconds(motion), values.tolist(), strict=True):
        message: Message = {}
        for (*outer, last), value in zip(paths, row, strict=True):
            inside = message
            for key in outer:
                inside = inside.setdefault(key, {})
            inside[last] = value
        yield at, message


def _path(column: Column) -> list[str]:
    """Return keys to a column's numbers in a message."""
    return [column.variable, *map(_key, column.labels)]
