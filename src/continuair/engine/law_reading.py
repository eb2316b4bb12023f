"""A law as Warp reads it: its functions, their hash, and quotients of whole numbers, which are cut
off.

Functions and types are read as for compilation, and no code is made of them. It is the one module
that uses what is private in Warp, and so may have to follow another version of it.
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
"""The type of Warp's structs."""

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
"""Names in NumPy, as of an Observation, -> fields of a law's structs."""


@dataclass
class _Met:
    """What Warp meets while it reads: function and line of quotients of whole numbers, and
    sentences on fields that a struct has not."""

    quotients: list[tuple[str, str]]
    unknown: list[str]


def read(control: Any) -> list[Any]:
    """All functions of the device that one calls, and itself; raises InputError if one of them
    divides whole numbers, or uses a field that a struct has not."""
    options = context.Module("law", None).options | {"output_arch": None, "block_dim": 1}
    builder = context.ModuleBuilder(context.Module("law", None), options)
    with _meeting() as met:
        try:
            control.adj.build(builder)
        except Exception:
            for sentence in met.unknown:
                raise InputError(sentence) from None
            raise
    for function, line in met.quotients:
        raise InputError(
            f"law divides whole numbers in its function {function} ({line}), which leaves a whole "
            "number; make them real first, as in code.Real(n) / code.Real(m)."
        )
    return [control, *builder.functions]


@contextmanager
def _meeting() -> Iterator[_Met]:
    """What Warp meets from now on that it takes otherwise than meant, or does not know."""
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
                    met.unknown.append(_unknown(adj.fun_name, attribute, kind))
            raise

    setattr(codegen.Adjoint, "add_call", noted)  # noqa: B010  # as mypy knows it
    setattr(codegen.Adjoint, "eval", named)  # noqa: B010
    try:
        yield met
    finally:
        setattr(codegen.Adjoint, "add_call", add_call)  # noqa: B010
        setattr(codegen.Adjoint, "eval", evaluate)  # noqa: B010


def _attributes(node: ast.AST) -> list[ast.Attribute]:
    """The attribute that an expression is, or those that an assignment writes to."""
    found = [node, *getattr(node, "targets", ()), getattr(node, "target", None)]
    return [each for each in found if isinstance(each, ast.Attribute)]


def _unknown(function: str, node: ast.Attribute, kind: Any) -> str:
    """A sentence on a field that a struct has not, with the name that it may have there."""
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
    return (
        f"law uses {ast.unparse(node)} in its function {function}, but {struct} has no "
        f"{node.attr}; {remedy}."
    )


def hashed(control: Any) -> bytes:
    """A hash of a function of the device, of those that it calls, and of the numbers in them."""
    found: bytes = _exactly([], {}).hash_function(control)
    return found


class _Exactly(context.ModuleHasher):
    """Warp's hash of functions, but for numbers that it takes in single precision, as a pack's."""

    def get_constant_bytes(self, value: Any) -> bytes:
        number = getattr(value, "value", value)
        return (
            repr(number).encode()
            if isinstance(number, float)
            else super().get_constant_bytes(value)
        )


_exactly: Any = _Exactly  # Warp's own has no types
