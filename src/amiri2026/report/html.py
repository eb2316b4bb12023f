"""HTML in which values are text: the one place where they are escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from string import Formatter
from typing import Any


class Html(str):
    """Text that is HTML, and stands in a page as it is."""


class _Escaping(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        return value if isinstance(value, Html) else escape(format(value, format_spec))


_ESCAPING = _Escaping()


def html(template: str, /, *values: Any, **named: Any) -> Html:
    """Return a template with values in its braces: those that are Html as they are, others escaped,
    as text or in the quotation marks of an attribute."""
    return Html(_ESCAPING.vformat(template, values, named))


def joined(parts: Iterable[str], between: str = "") -> Html:
    """Return parts one after the other, those that are not Html escaped."""
    return Html(between.join(html("{}", part) for part in parts))
