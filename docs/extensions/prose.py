"""Docstrings of prose, for Sphinx: as they stand in the code, names between single backticks."""

import inspect
import re
from typing import Any

from sphinx.application import Sphinx

import continuair as ca

_SPACES = ("continuair.equations", "continuair.paths", "continuair", "amiri2026")
_PUBLIC = {
    *(f"continuair.{name}" for name in ca.__all__),
    *(f"continuair.equations.{name}" for name in ca.equations.__all__),
}
_SECTION = re.compile(r"^\w[\w ]*\n-{3,}$", re.MULTILINE)
"""The heading of a section of a numpydoc docstring."""

# What tells of a result or an error ends the list of parameters before it.
_OUTCOME = re.compile(r"(?<=[.]) +(?=(?:Returns?|Raises) )")


def restructured(docstring: str, name: str, parameters: tuple[str, ...]) -> str:
    """A docstring of a named object as reStructuredText, its parameters in a list."""
    space = next(each for each in _SPACES if name.startswith(each))
    paragraphs = docstring.strip().split("\n\n")
    return "\n\n".join(_paragraph(each, space, parameters) for each in paragraphs)


def _paragraph(text: str, space: str, parameters: tuple[str, ...]) -> str:
    if text.lstrip().startswith(">>>"):
        return text
    parts = _OUTCOME.split(" ".join(text.split()))
    return "\n\n".join(_listed(part, space, parameters) for part in parts)


def _listed(text: str, space: str, parameters: tuple[str, ...]) -> str:
    """Text, and a list of what follows `parameter: ` in it."""
    if not parameters:
        return _marked(text, space)
    one = "|".join(map(re.escape, parameters))
    head = re.compile(rf"(?:^|(?<=[.;] ))((?:{one})(?:, (?:{one}))*(?: \([^()]*\))?): ")
    before, *items = head.split(text)
    lines = [_marked(before.strip(), space)] if before.strip() else []
    for names, meaning in zip(items[::2], items[1::2], strict=True):
        shown = re.sub(rf"\b({one})\b(?![^(]*\))", r"**\1**", names)
        lines.append(f"* {shown}: {_marked(meaning.strip().rstrip(';.'), space)}")
    return "\n\n".join(lines)


def _marked(text: str, space: str) -> str:
    """Text whose backticks are code or links, and in which nothing else is markup."""
    pieces = re.split(r"`([^`]+)`", text)
    plain = [re.sub(r"([\\*|]|_(?!\w))", r"\\\1", piece) for piece in pieces[::2]]
    code = [_code(piece, space) for piece in pieces[1::2]] + [""]
    return "".join(a + b for a, b in zip(plain, code, strict=True))


def _code(text: str, space: str) -> str:
    called = text.removeprefix("ca.").removeprefix("continuair.")
    for path in (f"{space}.{called}", f"continuair.{called}"):
        if path in _PUBLIC:
            # Outer backslashes keep a role apart from letters beside it.
            return rf"\ :py:obj:`{called} <{path}>`\ "
    return rf"\ ``{text}``\ "


def _process(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    if _SECTION.search(inspect.getdoc(obj) or ""):
        return  # numpydoc, which sphinx.ext.napoleon reads
    try:
        parameters = tuple(inspect.signature(obj).parameters) if callable(obj) else ()
    except (TypeError, ValueError):
        parameters = ()
    lines[:] = restructured("\n".join(lines), name, parameters).split("\n") + [""]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True}
