"""What nothing changes once it is made, as it has been checked."""

from __future__ import annotations

from typing import Any, NoReturn, Self

from continuair.errors import InputError


class Immutable:
    """Its copies are itself: NumPy would make copies of its arrays that could be edited."""

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        return self


class FixedDict(dict[str, Any]):
    """A dictionary that nothing can be put into or taken from: InputError instead."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise InputError(
            f"{', '.join(self)} cannot be changed here, where nothing would check or record it; "
            "make what holds them anew."
        )

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type[FixedDict], tuple[dict[str, Any]]]:
        return FixedDict, (dict(self),)
