"""Files that someone has damaged, or meant otherwise: mutations of real ones."""

import re
from collections.abc import Callable

import numpy as np

Rng = np.random.Generator

ODD_VALUES = (
    "0", "-1", "1e-320", "5e-324", "1e308", "-1e308", "1e400", "nan", "inf", "-inf", "true",
    "false", '""', '"x"', "[]", "{}", "[1, 2]", "[[1, 2], [3]]", "1979-05-27", "9" * 400,
    "9" * 5000, "1_000", "0x10", "-0.0", '"\\u0000"', "[true, 1, 2]", "[nan]", "1e-30", "1e30",
    "null", "'$\\frac$'",
)  # fmt: skip
"""Values that a field may be given, as TOML writes them, and some as it does not."""

ODD_TEXT = ("\x00", "\ufeff", "\r", "'", '"', "[", "]", "=", "#", "\n", "ü", "\u202e", ",", ".")

_NUMBER = re.compile(r"-?\d[\d_.]*(?:[eE][-+]?\d+)?")


def mutated(text: str, rng: Rng) -> str:
    """The text after one to three mutations."""
    for _ in range(int(rng.integers(1, 4))):
        text = _MUTATIONS[rng.integers(len(_MUTATIONS))](text, rng)
    return text


def _odd_number(text: str, rng: Rng) -> str:
    """Another value for a number."""
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    at = found[rng.integers(len(found))]
    return text[: at.start()] + str(rng.choice(ODD_VALUES)) + text[at.end() :]


def _scaled_number(text: str, rng: Rng) -> str:
    """A number of another size or sign."""
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    at = found[rng.integers(len(found))]
    try:
        value = float(at.group())
    except ValueError:
        return text
    scaled = value * float(rng.choice([-1.0, 1e-3, 1e3, 1e-9, 1e9, 0.1, 10.0]))
    return text[: at.start()] + repr(scaled) + text[at.end() :]


def _line(change: Callable[[list[str], int, Rng], list[str]]) -> Callable[[str, Rng], str]:
    def mutation(text: str, rng: Rng) -> str:
        lines = text.split("\n")
        return "\n".join(change(lines, int(rng.integers(len(lines))), rng))

    return mutation


def _slip(lines: list[str], at: int, rng: Rng) -> list[str]:
    """A letter wrong."""
    line = lines[at]
    if not line:
        return lines
    place = int(rng.integers(len(line)))
    kept = line[:place] + str(rng.choice(list("abkx_1. "))) + line[place + 1 :]
    return [*lines[:at], kept, *lines[at + 1 :]]


def _moved(lines: list[str], at: int, rng: Rng) -> list[str]:
    rest = lines[:at] + lines[at + 1 :]
    place = int(rng.integers(len(rest) + 1))
    return [*rest[:place], lines[at], *rest[place:]]


def _odd_text(text: str, rng: Rng) -> str:
    at = int(rng.integers(len(text) + 1))
    return text[:at] + str(rng.choice(ODD_TEXT)) + text[at:]


def _cut(text: str, rng: Rng) -> str:
    return text[: int(rng.integers(len(text) + 1))]


def _nested(text: str, rng: Rng) -> str:
    depth = int(rng.choice([5, 100, 3000]))
    return text + "\nodd = " + "[" * depth + "]" * depth + "\n"


_MUTATIONS: tuple[Callable[[str, Rng], str], ...] = (
    _odd_number,
    _odd_number,
    _odd_number,
    _scaled_number,
    _scaled_number,
    _line(lambda lines, at, rng: lines[:at] + lines[at + 1 :]),
    _line(lambda lines, at, rng: [*lines[: at + 1], *lines[at:]]),
    _line(_moved),
    _line(_slip),
    _odd_text,
    _cut,
    _nested,
)
