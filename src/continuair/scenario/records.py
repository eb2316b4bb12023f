"""Dataclasses whose arguments are checked before Python's own TypeError."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from continuair.errors import InputError, nearest

_Record = TypeVar("_Record")


def with_known_fields(called: str, remedy: str) -> Callable[[type[_Record]], type[_Record]]:
    """Make a dataclass raise InputError for unknown, missing and repeated fields.

    called: name of the class in messages, with its article; remedy: end of those messages.
    """

    def decorated(record: type[_Record]) -> type[_Record]:
        signature = inspect.signature(record)
        create = record.__init__

        @functools.wraps(create)
        def checked(self: _Record, *values: Any, **fields: Any) -> None:
            for name in fields:
                if name not in signature.parameters:
                    known = nearest(name, signature.parameters)
                    raise InputError(name, f"is not a field of {called}", known)
            try:
                signature.bind(*values, **fields)
            except TypeError as error:
                raise InputError(called, f"cannot be made ({error})", remedy) from None
            create(self, *values, **fields)

        record.__init__ = checked  # type: ignore[assignment, method-assign]
        return record

    return decorated
