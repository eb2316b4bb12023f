"""Replace fields of immutable parameter models by dotted name, for one run or for many.

A *tree* is a model as nested dicts and lists, in which a field that differs between runs is a
`_Runs`. Each run is validated by building its models from the tree.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from continuair import checks
from continuair.errors import InputError, named_fields, nearest, shown
from continuair.vehicle.effect import Effect, numbers_of
from continuair.vehicle.fields import dimensions, kinds, label, mixed, named
from continuair.vehicle.runs import pick
from continuair.warning import collected, warn

Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class _Runs:
    values: list[Any]
    note: str = ""
    """how ambiguous values were interpreted"""


class _EffectTree(dict[str, Any]):
    """Tree of an effect; kind: its class."""

    def __init__(self, effect: Effect) -> None:
        kind: Any = type(effect)
        self.kind, numbers = kind, numbers_of(kind)
        for each in fields(effect):
            value = getattr(effect, each.name)
            self[each.name] = _tree(value) if each.name in numbers else value

    def built(self, path: str) -> Effect:
        """Return the effect, with arrays where runs differ."""
        given = {name: _array_or_value(node) for name, node in self.items()}
        try:
            return self.kind(**given)
        except InputError as error:
            raise error.within(f"{path}.") from None


def replace(model: Model, changes: Mapping[str, object], implied: Mapping[str, object]) -> Model:
    """Return a copy of `model` with dotted fields changed; arrays over runs make a batched copy.

    implied: fields that follow from the changes, unless the changes contain them.
    """
    tree = _tree(model)
    for path, value in implied.items():
        _set(type(model), tree, path, value)
    places: dict[tuple[str | int, ...], str] = {}
    # Names last: paths are those of the parts before.
    for path, value in sorted(changes.items(), key=lambda each: str(each[0]).endswith(".name")):
        place = _set(type(model), tree, path, value)
        _check_once(place, path, places)
        places[place] = path
    runs = _common_length(tree)
    parts = dict(model)
    for name in {path.split(".")[0] for path in (*implied, *changes)}:
        parts[name] = _rebuilt(type(model), name, tree[name], runs)
    # pydantic validates a model again inside another, which works for one run only.
    checked = type(model)(**{name: pick(part, 0) for name, part in parts.items()})
    return type(model).model_construct(**(dict(checked) | parts)) if runs else checked


def value_of(model: BaseModel, path: str) -> Any:
    """Return the value of a plain model at a dotted name: number, None, text, or lists of them."""
    node, keys = _tree(model), _keys(path)
    for depth, key in enumerate(keys):
        node = node[_index(node, key, keys[:depth])]
    return node


def of_run(model: type[BaseModel], described: Mapping[str, Any], run: int) -> dict[str, Any]:
    """Return the fields of one run from a description, whose arrays over runs are lists."""
    return {name: _of_run(model, name, value, run) for name, value in described.items()}


def _of_run(model: type[BaseModel], field: str, value: Any, run: int) -> Any:
    of_table, of_entries = kinds(model, field)
    if of_table and isinstance(value, Mapping):
        return of_run(of_table, value, run)
    if of_entries and isinstance(value, list):
        return [of_run(of_entries, entry, run) for entry in value]
    # A batch holds several numbers of one run in rows (vehicle/runs.py).
    least = 0 if mixed(model, field) else dimensions(model, field)
    return value[run] if np.ndim(value) > least else value


def _tree(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return {name: _tree(child) for name, child in value}
    if isinstance(value, Effect):
        return _EffectTree(value)
    if isinstance(value, Mapping):
        return {name: _tree(child) for name, child in value.items()}
    if isinstance(value, np.ndarray) and value.ndim:
        return _Runs(value.tolist())
    if isinstance(value, (np.ndarray, np.generic)):
        return value.item()
    return [_tree(child) for child in value] if isinstance(value, (tuple, list)) else value


def _set(model: type[BaseModel], tree: Any, path: str, value: object) -> tuple[str | int, ...]:
    """Set a field, and return its place, which is the same for all its names."""
    node: Any = tree
    *parents, last = _keys(path)
    place: list[str | int] = []
    for depth, key in enumerate(parents):
        place.append(_index(node, key, parents[:depth]))
        node = node[place[-1]]
    index = _index(node, last, parents)
    template = node[index].values[0] if isinstance(node[index], _Runs) else node[index]
    size = _size(model, [*parents, last], value, template)
    node[index] = _over_runs(path, value, template, size)
    return (*place, index)


def _size(model: type[BaseModel], keys: list[str], value: object, template: Any) -> tuple[int, ...]:
    """Return a shape with as many dimensions as a field at a path has, if it is known.

    Of a field that holds one number or several, the value decides: a row is an array over runs
    unless a row of this length was there before.
    """
    part = model
    *parents, last = keys
    for key in parents:
        # Other keys are indices and names of entries, which are of the same class.
        if key in named_fields(part):
            part = next((kind for kind in kinds(part, key) if kind), part)
    if last in named_fields(part) and mixed(part, last):
        given = _shape(value)
        return (0,) if len(given) == 2 or (given and given == np.shape(template)) else ()
    if template is not None:
        return np.shape(template)
    return (0,) * (dimensions(part, last) if last in named_fields(part) else 0)


def _shape(value: Any) -> tuple[int, ...]:
    """Return the shape of a value, and nothing for a ragged one."""
    try:
        return np.shape(value)
    except (TypeError, ValueError):
        return ()


def _check_once(
    place: tuple[str | int, ...], path: str, places: Mapping[tuple[str | int, ...], str]
) -> None:
    """Raise InputError for a change that overwrites a previous one."""
    for other, before in places.items():
        if other[: len(place)] == place:
            raise InputError(
                path, f"overwrites {before}", "give one of them, or the whole before its part"
            )


def _keys(path: object) -> list[str]:
    if not isinstance(path, str):
        raise InputError(
            f"{shown(path)}", "is not the name of a field", "give text like 'arm.radius'"
        )
    return path.split(".")


def _index(node: Any, key: str, parents: list[str]) -> str | int:
    """Return the key into a tree node, or raise InputError with the valid keys."""
    path = ".".join([*parents, key])
    if isinstance(node, dict):
        if key in node:
            return key
        valid = [".".join([*parents, name]) for name in node]
        raise InputError(f"{path or repr(path)}", "is not a known field", nearest(path, valid))
    owner = ".".join(parents)
    if not isinstance(node, list):
        whole = "differs between runs" if isinstance(node, _Runs) else "has no parts"
        raise InputError(path, f"cannot be set because {owner} {whole}", f"give {owner} as a whole")
    names = [label(entry, index) for index, entry in enumerate(node)]
    if key in names:
        return names.index(key)
    if key.isdecimal() and int(key) < len(node):
        return int(key)
    if names and not all(name.isdecimal() for name in names):
        valid = [".".join([*parents, name]) for name in names]
        raise InputError(path, "does not exist", nearest(path, valid))
    remedy = f"use an index from 0 to {len(node) - 1}" if node else f"set {owner} first"
    raise InputError(path, f"does not exist because {owner} has length {len(node)}", remedy)


def _over_runs(path: str, value: Any, template: Any, field: tuple[int, ...]) -> Any:
    """Return the node for `value`: `_Runs` if it has one dimension more than the field.

    template: value of the field before; field: its shape.
    """
    if checks.has_unit(value):
        raise InputError(path, f"is {shown(value)}, which has a unit", "give numbers in SI units")
    if isinstance(value, (np.ndarray, np.generic)) or hasattr(value, "__array__"):
        value = np.asanyarray(checks.runs_first(value)).tolist()  # None where it is masked
    if not isinstance(value, (list, tuple)) or not _numeric(template):
        return _tree(value)
    try:
        shape = np.shape(value)
    except (TypeError, ValueError):
        # Ragged or not numeric: the model rejects it by field name.
        return value
    # An inertia given by its diagonal has one dimension less than the stored matrix.
    diagonals = len(field) == 2 and len(shape) == 2 and shape != field
    if len(shape) != len(field) + 1 and not diagonals:
        return list(value)
    if not value:
        raise InputError(
            path, "is [], but an array over runs is not empty", "give at least one value"
        )
    if None in value:
        run = value.index(None)
        raise InputError(path, f"is None in run {run}", "give a number for every run")
    note = f"{path} holds {len(value)} rows, read as the diagonals of {len(value)} runs"
    return _Runs(list(value), note if diagonals else "")


def _numeric(template: Any) -> bool:
    if isinstance(template, list):
        return bool(template) and all(_numeric(child) for child in template)
    return template is None or isinstance(template, Real)


def _lengths(node: Any, path: str) -> Iterator[tuple[str, int]]:
    if isinstance(node, _Runs):
        yield path, len(node.values)
    elif isinstance(node, dict):
        for name, child in node.items():
            yield from _lengths(child, f"{path}.{name}" if path else name)
    elif isinstance(node, list):
        for index, child in enumerate(node):
            yield from _lengths(child, f"{path}.{label(child, index)}")


def _common_length(tree: Any) -> int:
    lengths = list(_lengths(tree, ""))
    for path, length in lengths[1:]:
        first_path, first = lengths[0]
        if length != first:
            raise InputError(
                path,
                f"holds {length} runs while {first_path} holds {first}",
                "give arrays of the same length",
            )
    return lengths[0][1] if lengths else 0


def _varies(node: Any) -> bool:
    return next(_lengths(node, ""), None) is not None


def _row(node: Any, run: int) -> Any:
    if isinstance(node, _Runs):
        return node.values[run]
    if isinstance(node, dict):
        return {name: _row(child, run) for name, child in node.items()}
    return [_row(child, run) for child in node] if isinstance(node, list) else node


def _array_or_value(node: Any) -> Any:
    return np.array(node.values) if isinstance(node, _Runs) else node


def _rebuilt(model: type[BaseModel], field: str, node: Any, runs: int) -> Any:
    """Return the value of a field from its tree: build parts, leave anything else unchanged."""
    of_table, of_entries = kinds(model, field)
    if of_table and isinstance(node, dict):
        return _build(of_table, node, runs, f"{field}.")
    if of_entries and isinstance(node, list) and all(isinstance(each, dict) for each in node):
        return tuple(
            _build(of_entries, named(each, index), runs, f"{field}.{label(each, index)}.")
            for index, each in enumerate(node)
        )
    if isinstance(node, list) and any(isinstance(each, _EffectTree) for each in node):
        return tuple(
            each.built(f"{field}.{index}") if isinstance(each, _EffectTree) else each
            for index, each in enumerate(node)
        )
    return node.built(field) if isinstance(node, _EffectTree) else node


def _build(model: type[Model], fields: dict[str, Any], runs: int, prefix: str) -> Model:
    if not _varies(fields):
        try:
            return model(**fields)
        except InputError as error:
            raise error.within(prefix) from None
    columns = _columns(model, fields, runs, prefix)
    stacked = {
        name: _stacked(fields.get(name), column, f"{prefix}{name}")
        for name, column in columns.items()
    }
    return model.model_construct(**stacked)


def _columns(
    model: type[Model], fields: dict[str, Any], runs: int, prefix: str
) -> dict[str, list[Any]]:
    """Return the validated values of each field over the runs."""
    columns: dict[str, list[Any]] = {name: [] for name in named_fields(model)}
    varied = {name: node for name, node in fields.items() if _varies(node)}
    warned: list[int] = []
    with collected() as caught:
        for run in range(runs):
            try:
                built = model(**fields | {name: _row(node, run) for name, node in varied.items()})
            except InputError as error:
                notes = [node.note for node in varied.values() if isinstance(node, _Runs)]
                note = "".join(f" ({text})" for text in notes if text)
                raise error.within(prefix).located(f"run {run}{note}") from None
            for name, value in built:
                columns[name].append(value)
            if len(caught) > len(warned):
                warned.append(run)
    if warned:
        text = f"run {warned[0]} (of {len(warned)} that warn): {caught[0]}"
        warn(text, stacklevel=5)
    return columns


def _stacked(node: Any, column: list[Any], path: str) -> Any:
    """Return one value for all runs: an array if the values, or the tree, vary."""
    first = column[0]
    if not _varies(node) and all(value == first for value in column):
        return first
    if isinstance(first, BaseModel):
        rows = [dict(value) for value in column]
        fields = {
            name: _stacked(_child(node, name), [row[name] for row in rows], f"{path}.{name}")
            for name in rows[0]
        }
        return type(first).model_construct(**fields)
    if isinstance(first, tuple) and any(isinstance(entry, BaseModel) for entry in first):
        lengths = {len(value) for value in column}
        if len(lengths) > 1:
            several = " or ".join(str(length) for length in sorted(lengths))
            raise InputError(path, f"holds {several} entries", "give as many in every run")
        return tuple(
            _stacked(_child(node, index), list(entries), f"{path}.{label(entries[0], index)}")
            for index, entries in enumerate(zip(*column, strict=True))
        )
    return checks.frozen(np.array(column))


def _child(node: Any, key: str | int) -> Any:
    """Return the tree of a field or an entry, or None."""
    if isinstance(node, dict):
        # A table in place of a list holds the fields that all entries share.
        return node if isinstance(key, int) else node.get(key)
    return node[key] if isinstance(node, list) and isinstance(key, int) else None
