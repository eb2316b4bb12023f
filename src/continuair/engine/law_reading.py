"""Analysis of a user's device functions by Warp: what they call, their hash, and two mistakes.

Refused are integer divisions, which truncate, and fields that a struct lacks.

Functions and types are analysed as for compilation, without generating code. Only this module uses
private parts of Warp, and may have to change with its version.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import warp as wp
from warp._src import codegen, context

from continuair.errors import InputError, nearest

Struct = codegen.Struct
"""Type of Warp's structs."""

_WHOLE = (
    *(wp.int8, wp.int16, wp.int32, wp.int64),
    *(wp.uint8, wp.uint16, wp.uint32, wp.uint64),
)


_DEVICE_NAMES = {
    "features": "image",
    "camera_position": "view.position",
    "camera_attitude": "view.attitude",
    "target_velocity": "target_twist",
    "q": "state",
    "qd": "state",
}
"""Names of an Observation in Python -> fields of a law's structs on the device."""


@dataclass
class _Met:
    """Integer divisions (function, line) and sentences on unknown fields."""

    quotients: list[tuple[str, str]]
    unknown: list[InputError]


def read(control: Any, owner: str) -> list[Any]:
    """Return a device function and all that it calls.

    owner: what has the function, for messages. Raises InputError if one of them divides whole
    numbers, or uses a field that its struct lacks.
    """
    options = context.Module("law", None).options | {"output_arch": None, "block_dim": 1}
    builder = context.ModuleBuilder(context.Module("law", None), options)
    with _meeting(owner) as met:
        try:
            control.adj.build(builder)
        except Exception:
            for error in met.unknown:
                raise error from None
            raise
    for function, line in met.quotients:
        raise InputError(
            owner,
            f"divides whole numbers in its function {function} ({line}), which truncates",
            "convert them first, as in code.Real(n) / code.Real(m)",
        )
    return [control, *builder.functions]


@contextmanager
def _meeting(of: str) -> Iterator[_Met]:
    """Collect the integer divisions and unknown fields that Warp analyses."""
    met = _Met([], [])
    add_call, evaluate = codegen.Adjoint.add_call, codegen.Adjoint.eval

    def noted(adj: Any, func: Any, args: Any, *rest: Any, **options: Any) -> Any:
        if func.key == "div" and all(codegen.strip_reference(x.type) in _WHOLE for x in args):
            met.quotients.append((adj.fun_name, adj.source_lines[adj.lineno].strip()))
        return add_call(adj, func, args, *rest, **options)  # type: ignore[no-untyped-call]

    def named(adj: Any, node: Any) -> Any:
        try:
            return evaluate(adj, node)  # type: ignore[no-untyped-call]
        except Exception:
            for attribute in [] if met.unknown else _attributes(node):
                owner = evaluate(adj, attribute.value)  # type: ignore[no-untyped-call]
                kind = codegen.strip_reference(getattr(owner, "type", None))
                if isinstance(kind, Struct) and attribute.attr not in kind.vars:
                    met.unknown.append(_unknown(of, adj.fun_name, attribute, kind))
            raise

    setattr(codegen.Adjoint, "add_call", noted)  # noqa: B010  # as mypy knows it
    setattr(codegen.Adjoint, "eval", named)  # noqa: B010
    try:
        yield met
    finally:
        setattr(codegen.Adjoint, "add_call", add_call)  # noqa: B010
        setattr(codegen.Adjoint, "eval", evaluate)  # noqa: B010


def _attributes(node: ast.AST) -> list[ast.Attribute]:
    """Return the attribute that an expression is, or those that an assignment writes."""
    found = [node, *getattr(node, "targets", ()), getattr(node, "target", None)]
    return [each for each in found if isinstance(each, ast.Attribute)]


def _unknown(of: str, function: str, node: ast.Attribute, kind: Any) -> InputError:
    """Return an error about an unknown field of a struct, with the likely name."""
    fields = list(kind.vars)
    deeper = {
        name: f"{field}.{name}"
        for field, of in reversed(kind.vars.items())
        if isinstance(of.type, Struct)
        for name in of.type.vars
    }
    meant = _DEVICE_NAMES.get(node.attr, node.attr)
    first = meant.partition(".")[0]
    found = meant if first in fields else deeper.get(meant)
    remedy = f"use {found} (known: {', '.join(fields)})" if found else nearest(node.attr, fields)
    struct = kind.key.rpartition("__")[2]
    return InputError(
        of,
        f"uses {ast.unparse(node)} in its function {function}, but {struct} has no {node.attr}",
        remedy,
    )


def hashed(control: Any) -> bytes:
    """Return a hash of a device function, of those that it calls, and of their constants."""
    found: bytes = _exactly([], {}).hash_function(control)
    return found


class _Exactly(context.ModuleHasher):
    """Warp's hash of functions, with exact constants, also those of packs."""

    def get_constant_bytes(self, value: Any) -> bytes:
        number = getattr(value, "value", value)
        return (
            repr(number).encode()
            if isinstance(number, float)
            else super().get_constant_bytes(value)
        )


_exactly: Any = _Exactly  # Warp's own has no types
