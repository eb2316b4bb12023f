"""Vehicles and scenarios from the rows of a design, in batches as large as possible."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.controllers.classic import classic
from continuair.controllers.controller import Controller, stack
from continuair.controllers.gains import design, designs
from continuair.controllers.servoing import servoing, servoings
from continuair.equations.camera import facing
from continuair.errors import InputError
from continuair.flight.rotors import still
from continuair.scenario import paths
from continuair.scenario.excitations import inputs, plus
from continuair.scenario.scenarios import Scenario
from continuair.scenario.targets import Target, square
from continuair.scenario.tracking_task import START_OFFSET
from continuair.sweeps.design import Design
from continuair.sweeps.tables import TABLES, TargetTable, changed
from continuair.typing import Array
from continuair.vehicle.bending import evenly_moving
from continuair.vehicle.layout import COORDINATES
from continuair.vehicle.vehicle import Vehicle

_SHARED = {
    "scenario.test", "scenario.f1", "scenario.excitation", "scenario.on", "scenario.duration",
    "scenario.gravity", "controller.law", "controller.gains", "controller.integral",
}  # fmt: skip
"""Fields that have one value per launch; runs are grouped by these values."""

_DESIGN = ("bandwidth", "damping_ratio", "conditioning", "rate_gain", "sliding")
"""Fields of a controller that determine its gains."""

_ANGLES = COORDINATES[3:6]

_AT_REST = dict(zip(COORDINATES, (0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.1, 0.0), strict=True))
# Most seconds of time-dependent inputs that differ between runs, as these fill a table over steps.
_SECONDS_OF_INPUTS = 128.0


def batches(
    design: Design, runs: NDArray[np.intp]
) -> Iterator[tuple[NDArray[np.intp], Vehicle, Scenario]]:
    """Yield vehicles and scenarios of some runs, with the indices into `runs` of each batch.

    Raises InputError if the parameters of a run cannot be used.
    """
    rows = design.rows(runs)
    apart = [values for name, values in rows.items() if name in _SHARED or values.dtype.kind == "U"]
    groups: dict[tuple[Any, ...], list[int]] = {}
    for index, key in enumerate(zip(*apart, strict=True) if apart else [()] * len(runs)):
        groups.setdefault(key, []).append(index)
    for group in groups.values():
        for at in _parts(design, np.array(group), rows):
            yield (at, *assemble(design, {name: values[at] for name, values in rows.items()}))


def assemble(design: Design, rows: dict[str, Array]) -> tuple[Vehicle, Scenario]:
    """Return one batch from the values of its variables; equal values are shared."""
    changes = {
        name.removeprefix("vehicle."): _shared(values)
        for name, values in rows.items()
        if name.startswith("vehicle.")
    }
    vehicle = design.vehicle.replace(changes) if changes else design.vehicle
    fields = {name: _fields(design, name, rows) for name in TABLES}
    if design.base.target is None:
        return vehicle, _open_loop(vehicle, fields["scenario"])
    count = len(next(iter(rows.values()), np.zeros(1)))
    return vehicle, _closed_loop(vehicle, fields, count)


def _parts(
    design: Design, group: NDArray[np.intp], rows: dict[str, Array]
) -> list[NDArray[np.intp]]:
    """Return the group in parts that fit into memory."""
    timed = ("scenario.amplitude", "scenario.frequency", "scenario.end_frequency", "scenario.phase")
    table = design.base.scenario
    steady = table.excitation in ("none", "constant") and table.test in (None, "A", "B")
    switched = {"scenario.test", "scenario.excitation"} & set(rows)
    if not any(name in rows for name in timed) or (steady and not switched):
        return [group]
    longest = np.max(rows.get("scenario.duration", table.duration))
    most = max(1, int(_SECONDS_OF_INPUTS / longest))
    return np.array_split(group, -(-len(group) // most))


def _fields(design: Design, name: str, rows: dict[str, Array]) -> dict[str, Any]:
    """Return the fields of a table: those of the base, with arrays over runs for those that vary.

    Raises InputError as the table does, for the first invalid run.
    """
    table = getattr(design.base, name)
    if table is None:
        return {}
    varied = {
        field.removeprefix(f"{name}."): values
        for field, values in rows.items()
        if field.startswith(f"{name}.")
    }
    plain = {field: getattr(table, field) for field in type(table).model_fields}
    for run in range(len(next(iter(varied.values()), ()))):
        try:
            changed(table, {field: values[run].item() for field, values in varied.items()})
        except InputError as error:
            raise error.within(f"{name}.") from None
    return plain | {field: _shared(values) for field, values in varied.items()}


def _shared(values: Array) -> Any:
    """Return a single value if all are equal, as a launch requires of some fields."""
    return values[0].item() if (values == values[0]).all() else values


def _open_loop(vehicle: Vehicle, fields: dict[str, Any]) -> Scenario:
    """Return an open-loop scenario."""
    given = {name: _AT_REST[name] if fields[name] is None else fields[name] for name in COORDINATES}
    # The paper's tests have no lift.
    resting = {} if fields["test"] is None else still(vehicle)
    return _scenario(vehicle, fields, given, **_inputs(vehicle, fields), **resting)


def _inputs(vehicle: Vehicle, fields: dict[str, Any]) -> dict[str, Any]:
    """Return the excitation, with a lift in weights of the vehicle."""
    excited = inputs(fields, vehicle.layout)
    if np.any(fields["lift"]):
        weight = np.asarray(fields["lift"]) * vehicle.mass * fields["gravity"]
        lift = np.zeros((*np.shape(weight), 3))
        lift[..., 2] = weight
        excited["force"] = plus(excited.get("force"), lift)
    return excited


def _scenario(
    vehicle: Vehicle, fields: dict[str, Any], state: dict[str, Any], **rest: Any
) -> Scenario:
    """Return a scenario in which all sections start with the same bend."""
    found = np.broadcast_arrays(*(state[name] for name in COORDINATES))
    rates = np.broadcast_arrays(*(fields[f"{name}_rate"] for name in COORDINATES))
    q, qd = evenly_moving(vehicle, found, rates)
    if q.ndim != qd.ndim:
        runs = max(len(np.atleast_2d(q)), len(np.atleast_2d(qd)))
        q, qd = (np.broadcast_to(rows, (runs, rows.shape[-1])) for rows in (q, qd))
    options = {"duration": fields["duration"], "gravity": fields["gravity"]}
    return Scenario("sweep", q, qd, **options, **rest)


def _closed_loop(vehicle: Vehicle, fields: dict[str, dict[str, Any]], runs: int) -> Scenario:
    """Return a closed-loop scenario with a target and a controller."""
    scenario = fields["scenario"]
    targets, of_run = _targets(fields["target"], runs)
    start = np.array([target.path(0.0)[0][0] for target in targets])[of_run]
    distance = np.array([target.distance for target in targets])[of_run]
    state = {name: scenario[name] for name in COORDINATES}
    above, turned = facing(vehicle, start, distance)
    state |= {name: turned[..., k] + state[name] for k, name in enumerate(_ANGLES)}
    for axis, name in enumerate("xyz"):
        off = START_OFFSET[axis] if scenario[name] is None else scenario[name]
        state[name] = above[:, axis] + off
    return _scenario(
        vehicle,
        scenario,
        state,
        **_inputs(vehicle, scenario),
        controller=_controller(vehicle, fields["controller"], targets, of_run),
        target=[targets[each] for each in of_run],
    )


def _each(fields: dict[str, Any], runs: int) -> Iterator[dict[str, Any]]:
    """Yield the fields of each run."""
    for run in range(runs):
        yield {
            name: value[run].item() if isinstance(value, np.ndarray) else value
            for name, value in fields.items()
        }


def _targets(fields: dict[str, Any], runs: int) -> tuple[list[Target], NDArray[np.intp]]:
    """Return the distinct targets, and the index of each run's target (runs,)."""
    made: dict[tuple[Any, ...], Target] = {}
    keys = [tuple(one.values()) for one in _each(fields, runs)]
    for key in dict.fromkeys(keys):
        made[key] = _target(dict(zip(fields, key, strict=True)))
    places = {key: place for place, key in enumerate(made)}
    return list(made.values()), np.array([places[key] for key in keys])


def _target(fields: dict[str, Any]) -> Target:
    """Return the target of a table."""
    table = TargetTable(**fields)
    path = paths.word(table.letter, table.height, table.duration)
    return Target(path, square(table.side), table.distance)


def _controller(
    vehicle: Vehicle, fields: dict[str, Any], targets: list[Target], of_run: NDArray[np.intp]
) -> Controller:
    """Return the controllers of all runs, each tuned for its vehicle and target."""
    runs = len(of_run)
    if fields["law"] == "classic":
        return stack(
            [
                classic(vehicle.select(run), one["rate"], one["inner"])
                for run, one in enumerate(_each(fields, runs))
            ]
        )
    if vehicle.has_arm_list or fields["gains"] == "current":
        return _one_by_one(vehicle, fields, targets, of_run)
    gains = designs(
        vehicle,
        np.stack([target.desired for target in targets])[of_run],
        np.stack([target.depths for target in targets])[of_run],
        **{name: fields[name] for name in _DESIGN},
    )
    posture = np.broadcast_to(fields["posture_damping"], runs)
    return servoings(gains, posture, fields["integral"])


def _one_by_one(
    vehicle: Vehicle, fields: dict[str, Any], targets: list[Target], of_run: NDArray[np.intp]
) -> Controller:
    """Return controllers designed run by run.

    For vehicles that may differ in their arms, or gains that follow the current image.
    """
    laws = []
    for run, one in enumerate(_each(fields, len(of_run))):
        target = targets[of_run[run]]
        gains = design(
            vehicle.select(run),
            gains=one["gains"],
            **{name: one[name] for name in _DESIGN},
            desired=target.desired,
            distance=target.depths,
        )
        chosen = {name: one[name] for name in ("posture_damping", "integral")}
        laws.append(servoing(**gains, **chosen))
    return stack(laws)
