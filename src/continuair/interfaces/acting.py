"""Inputs that acted on a vehicle at the samples of its flight, as far as they are recorded."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from continuair.analysis.motion import Motion
from continuair.errors import InputError, shown
from continuair.flight.inputs import evaluated, field_width
from continuair.flight.prepare import check_scenario
from continuair.flight.reading import BATCH_ROW, GIVEN_TO_STEPS, run_of, scenario_of
from continuair.flight.time_grid import seen_at
from continuair.interfaces.wash import was_washed
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import FIELDS, PUSH
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn

Array = np.ndarray


@dataclass(frozen=True)
class Acting:
    """The inputs that acted in a flight.

    inputs: name of the table of inputs -> (n, width), of those that acted; rotors and controller
    count as force, moment and bend moment. untold: other inputs, fields of the scenario and the
    rotors' wash.
    """

    inputs: dict[str, Array]
    untold: tuple[str, ...]


def acting_on(motion: Motion, scenario: Scenario | None = None) -> Acting:
    """Return the inputs of a flight; scenario: the simulated one, whose functions a result lacks.

    Raises InputError for a scenario of another shape, or of a batch whose run is not known.
    """
    told = told_of(motion.dataset, scenario)
    found = _pushes(motion)
    fields = (*PUSH, "tip_wrench")
    untold = [name for name in ("tau", "wind") if told.get(name) is not None]
    untold += ["the rotors' wash on the arms"] if was_washed(motion) else []
    untold += untold_of(told, motion.dataset, motion.vehicle, fields)
    for name in fields:
        value = told.get(name)
        if value is not None and not isinstance(value, str):
            sign = told["tip_wrench_sign"] if name == "tip_wrench" else 1.0
            found[name] = found.get(name, 0.0) + sign * _of_run(name, value, motion)
    return Acting(found, tuple(untold))


def untold_of(
    told: dict[str, Any], flight: xr.Dataset, vehicle: Vehicle, fields: Iterable[str]
) -> list[str]:
    """Return inputs that acted but are not recorded.

    They are wrenches that were not logged, and functions of which a result records the name alone.
    """
    found = []
    if vehicle.uav.rotors is not None and "rotor_thrust" not in flight:
        found.append("rotor_thrust")
    elif told.get("controller") is not None and "command" not in flight:
        found.append("command")
    if not told:
        found.append("the scenario's inputs, if it had any")
    found += ["force_callback"] if told.get("force_callback") else []
    return found + [name for name in fields if isinstance(told.get(name), str)]


def warn_of_lacking(names: Iterable[str], stacklevel: int, what: str) -> None:
    """Warn if a file or picture lacks inputs that acted.

    levels: of the stack up to the caller; what: the file's name, as Python shows equal warnings
    once.
    """
    if names := tuple(names):
        warn(
            f"{what} lacks {', '.join(names)}, which acted, as their values over time are not "
            "known; scenario= gives functions of time.",
            stacklevel=stacklevel + 1,
        )


def told_of(flight: xr.Dataset, scenario: Scenario | None = None) -> dict[str, Any]:
    """Return fields of the scenario of a flight.

    scenario: the simulated one, if known; it does not contain the steps of a `Simulation`. Raises
    InputError for another one.
    """
    told = scenario_of(flight)
    if scenario is None:
        return told
    check_scenario(scenario)
    _check_flown(scenario, told)
    names = (*FIELDS, "tip_wrench_sign", "controller", "force_callback")
    known = {name: getattr(scenario, name) for name in names}
    return known | {name: value for name, value in told.items() if value == GIVEN_TO_STEPS}


def _check_flown(scenario: Scenario, told: dict[str, Any]) -> None:
    """Raise InputError if a scenario disagrees with the record of a flight."""
    described = json.loads(json.dumps(scenario.describe()))
    for name in (*FIELDS, "tip_wrench_sign") if told else ():
        given, flown = getattr(scenario, name), told.get(name)
        # Rotors that nothing commands are held by the flight itself.
        filled = flown == GIVEN_TO_STEPS or (name == "rotor_command" and given is None)
        if not filled and not _may_be(described[name], flown):
            raise InputError(
                f"scenario.{name}",
                f"is {shown(given)}, but that of the flight is {shown(flown)}",
                "give the scenario that was flown",
            )


def _may_be(given: Any, flown: Any) -> bool:
    """Return whether a scenario's field may be the recorded one.

    A function is recorded by its name, which any may have, or by its components; others as they
    are.
    """
    if isinstance(given, str) or isinstance(flown, str):
        return isinstance(given, str) and isinstance(flown, str)
    if given is None or flown is None or isinstance(given, dict) or isinstance(flown, dict):
        return bool(given == flown)
    # A row for all runs may be given in two ways.
    given, flown = (np.squeeze(np.asarray(each, float)) for each in (given, flown))
    return np.array_equal(given, flown)


def sampled(field: str, value: Any, flight: xr.Dataset, vehicle: Vehicle) -> Array | None:
    """Return values (n, width) of a field of the scenario at the samples of one flight.

    None if it holds rows of the runs of a batch, and the flight does not record which it is.
    """
    times, width = flight["time"].to_numpy(), field_width(field, vehicle.layout)
    if callable(value):
        seen = seen_at(times, scenario_of(flight).get("jumps", ()))
        rows = evaluated(field, value, seen, width)
    else:
        rows = np.asarray(value, float).reshape(1, -1, width)
    row = run_of(flight) if rows.shape[1] > 1 else 0
    return None if row is None else np.broadcast_to(rows[:, row], (len(times), width))


def _of_run(name: str, value: Any, motion: Motion) -> Array:
    found = sampled(name, value, motion.dataset, motion.vehicle)
    if found is None:
        raise InputError(
            name,
            f"holds rows of many runs, and flight has no coordinate {BATCH_ROW}",
            "select the run as in flight.isel(run=0), which keeps it",
        )
    return found


def _pushes(motion: Motion) -> dict[str, Array]:
    """Return the controller's wrench, and force and moment that the rotors produce of it."""
    dataset, rotors, found = motion.dataset, motion.vehicle.uav.rotors, {}
    if "command" in dataset:
        found = dict(
            zip(PUSH, np.split(dataset["command"].to_numpy(), [3, 6], axis=1), strict=True)
        )
    if rotors is None:
        return found
    found = {name: found[name] for name in ("bend_moment",) if name in found}
    if "rotor_thrust" in dataset:
        wrench = dataset["rotor_thrust"].to_numpy() @ rotors.allocation.T
        found["force"] = Rotation.from_quat(motion.attitude).apply(wrench[:, :3])
        found["moment"] = wrench[:, 3:]
    return found
