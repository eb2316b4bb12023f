"""HTML templates; the only place where values are escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from string import Formatter
from typing import Any


class Html(str):
    """Text that is HTML and is not escaped."""


class _Escaping(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        return value if isinstance(value, Html) else escape(format(value, format_spec))


_ESCAPING = _Escaping()


def html(template: str, /, *values: Any, **named: Any) -> Html:
    """Return a template with values in its braces, escaped unless they are Html.

    Escaped values can be text, or attributes in quotation marks.
    """
    return Html(_ESCAPING.vformat(template, values, named))


def joined(parts: Iterable[str], between: str = "") -> Html:
    """Return joined parts, escaped unless they are Html."""
    return Html(between.join(html("{}", part) for part in parts))
