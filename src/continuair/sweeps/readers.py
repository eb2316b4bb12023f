"""Choices that use fields of a design; an unused field would have no effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from continuair.errors import InputError, shown
from continuair.sweeps.tables import Base
from continuair.typing import Array

Readers = dict[str, tuple[str, ...]]
"""Choices, such as scenario.test, with their values that use a field."""

_TEST, _EXCITATION, _LAW = "scenario.test", "scenario.excitation", "controller.law"
_WAVES: Readers = {_EXCITATION: ("sine", "chirp")}
_EXCITATIONS: Readers = {_EXCITATION: ("constant", "sine", "chirp")}
_SERVOING: Readers = {_LAW: ("servoing",)}
_CLASSIC: Readers = {_LAW: ("classic",)}

_CAMERA = "vehicle.camera."
"""Fields of the camera affect only closed loops, except its arm, whose tip the metrics use."""

READERS: dict[str, Readers] = {
    "scenario.f1": {_TEST: ("D",)},
    "scenario.on": _EXCITATIONS,
    "scenario.amplitude": {_TEST: ("A", "C", "D"), **_EXCITATIONS},
    "scenario.frequency": _WAVES,
    "scenario.end_frequency": {_EXCITATION: ("chirp",)},
    "scenario.phase": _WAVES,
    "controller.gains": _SERVOING,
    "controller.bandwidth": _SERVOING,
    "controller.damping_ratio": _SERVOING,
    "controller.conditioning": _SERVOING,
    "controller.rate_gain": _SERVOING,
    "controller.sliding": _SERVOING,
    "controller.posture_damping": _SERVOING,
    "controller.integral": _SERVOING,
    "controller.rate": _CLASSIC,
    "controller.inner": _CLASSIC,
}
"""Fields that not every run uses, with the values of choices that use them."""


def check_read(base: Base, varied: Mapping[str, Array]) -> None:
    """Raise InputError for a field that a design gives or varies and that none of its runs uses.

    varied: the values of fields that [set] gives or that vary, by name.
    """
    for field in varied:
        if field.startswith(_CAMERA) and field != _CAMERA + "arm" and base.controller is None:
            raise InputError(
                field,
                "is given, but has no effect without a [controller]",
                "omit it, or give a [controller] and a [target]",
            )
    for field, readers in READERS.items():
        table, _, name = field.partition(".")
        if field not in varied and name not in _given(base, table):
            continue
        chosen = {choice: _values(base, varied, choice) for choice in readers}
        if any(set(chosen[choice]) & set(valid) for choice, valid in readers.items()):
            continue
        found = _values(base, varied, field)
        given = "varies" if len(found) > 1 else f"is {shown(found[0])}"
        raise InputError(
            field,
            f"{given}, but has no effect with {_listed(chosen, ' and ')}",
            f"omit it, or give {_listed(readers, ' or ')}",
        )


def _given(base: Base, table: str) -> set[str]:
    """Return the fields that a table of the design gives."""
    found = getattr(base, table)
    return set() if found is None else found.model_fields_set


def _values(base: Base, varied: Mapping[str, Array], field: str) -> list[Any]:
    """Return the values that a field has over all runs."""
    table, _, name = field.partition(".")
    return (
        np.unique(varied[field]).tolist()
        if field in varied
        else [getattr(getattr(base, table), name)]
    )


def _listed(choices: Mapping[str, Sequence[Any]], joined: str) -> str:
    """Return choices with their values, as in scenario.test 'A' or 'B'."""
    return joined.join(
        f"{choice} {' or '.join(map(shown, values))}" for choice, values in choices.items()
    )
