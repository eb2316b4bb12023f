"""Checks of user-defined terms: they return an Acting, and their constants keep all digits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types
from continuair.engine.compiling import made_once
from continuair.engine.law_names import names_of
from continuair.engine.law_numbers import check_numbers
from continuair.engine.law_parts import is_ours
from continuair.engine.law_reading import read
from continuair.errors import InputError
from continuair.kernels.device import Device
from continuair.kernels.term_sum import Acting
from continuair.terms import TERMS


@made_once
def check_terms(tree: Tree) -> None:
    """Raise InputError for an invalid user-defined term.

    It must return an Acting, declare its energy, and have constants that keep all digits.
    """
    numbers = Numbers("float64")
    for term in (each for each in tree.terms if type(each) not in TERMS):
        name = type(term).__name__
        acting = _made(name, partial(term.device, Device(numbers, tree)))
        if not isinstance(acting, Acting):
            raise InputError(
                f"term {name}",
                f"returns {type(acting).__name__} from device(code)",
                "return a continuair.terms.Acting",
            )
        if acting.energy is not None and not term.has_energy:
            raise InputError(
                f"term {name}",
                "returns an energy, but has_energy is False",
                "set has_energy = True in its class, or leave the energy out",
            )
        real = device_types(numbers, tree).Real
        parts = _made(name, partial(_parts, acting, tree))
        for function in _functions(parts, set()):
            check_numbers(function, real, f"term {name}")
        for function in parts:
            if isinstance(function, wp.Function):
                read(function, f"term {name}")


def _made(name: str, make: Callable[[], Any]) -> Any:
    """Return what a term's own code makes, or raise InputError with what it raises."""
    try:
        return make()
    except InputError:
        raise
    except Exception as error:  # whatever a user's code raises
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(
            f"term {name}",
            f"cannot be made ({said})",
            "compare its device(code) with the page on custom forces",
        ) from error


def _parts(acting: Acting, tree: Tree) -> list[Any]:
    found = [acting.on_uav, acting.rates, acting.excess, acting.misdirected, acting.settled]
    found.append(acting.energy)
    if acting.on_arm is not None:
        found += [acting.on_arm(arm) for arm in range(len(tree.sections))]
    return found


def _functions(values: Any, known: set[int]) -> Iterator[Any]:
    """Yield user-defined device functions among values, and in functions that these call."""
    for value in values:
        if not isinstance(value, wp.Function) or getattr(value, "func", None) is None:
            continue
        if id(value) in known:
            continue
        known.add(id(value))
        if not is_ours(value.func):
            yield value
        yield from _functions(names_of(value).values(), known)
