"""Base classes of objects that do not change after their validation."""

from __future__ import annotations

from typing import Any, NoReturn, Self

from continuair.errors import InputError


class Immutable:
    """Object whose copies are the object itself: copies of its arrays would be writeable."""

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        return self


class FixedDict(dict[str, Any]):
    """Dictionary whose modification raises InputError."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise InputError(
            ", ".join(self),
            "cannot be changed in place",
            "build a new object with other values",
        )

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type[FixedDict], tuple[dict[str, Any]]]:
        return FixedDict, (dict(self),)
