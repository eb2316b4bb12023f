"""Analysis of a law by Warp: its functions, their hash, and integer divisions, which truncate.

Functions and types are analysed as for compilation, without generating code. Only this module uses
private parts of Warp, and may have to change with its version.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import warp as wp
from warp._src import codegen, context

from continuair.errors import InputError

Struct = codegen.Struct
"""Type of Warp's structs."""

_WHOLE = (
    *(wp.int8, wp.int16, wp.int32, wp.int64),
    *(wp.uint8, wp.uint16, wp.uint32, wp.uint64),
)


def read(control: Any) -> list[Any]:
    """Return a device function and all that it calls.

    Raises InputError if one of them divides whole numbers.
    """
    options = context.Module("law", None).options | {"output_arch": None, "block_dim": 1}
    builder = context.ModuleBuilder(context.Module("law", None), options)
    with _calls() as calls:
        control.adj.build(builder)
    for function, line in calls:
        raise InputError(
            f"law divides whole numbers in its function {function} ({line}), which truncates; "
            "convert them first, as in code.Real(n) / code.Real(m)."
        )
    return [control, *builder.functions]


@contextmanager
def _calls() -> Iterator[list[tuple[str, str]]]:
    """Collect the integer divisions that Warp analyses: function and line."""
    met: list[tuple[str, str]] = []
    add_call = codegen.Adjoint.add_call

    def noted(adj: Any, func: Any, args: Any, *rest: Any, **options: Any) -> Any:
        if func.key == "div" and all(codegen.strip_reference(x.type) in _WHOLE for x in args):
            met.append((adj.fun_name, adj.source_lines[adj.lineno].strip()))
        return add_call(adj, func, args, *rest, **options)  # type: ignore[no-untyped-call]

    setattr(codegen.Adjoint, "add_call", noted)  # noqa: B010  # as mypy knows it
    try:
        yield met
    finally:
        setattr(codegen.Adjoint, "add_call", add_call)  # noqa: B010


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
