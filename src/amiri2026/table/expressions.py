"""Formulas as expressions: variables that NumPy arrays may hold, their rates, and C++ code of both.

A formula in plain NumPy that is called with arrays of `Expression` gives expressions; equal ones
are one object, so that nothing is computed twice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import Any

import numpy as np


def _of_numbers(operator: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return an operator that leaves arrays to NumPy, which takes them entry by entry."""

    @wraps(operator)
    def found(self: Any, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else operator(self, other)

    return found


class Expression:
    """A variable or an operation on expressions and numbers, made by `variable` or operators."""

    _known: dict[tuple[Any, ...], Expression] = {}

    __slots__ = ("operation", "operands")

    operation: str
    operands: tuple[Any, ...]

    @_of_numbers
    def __add__(self, other: Any) -> Any:
        if _is(other, 0.0):
            return self
        return _made("+", self, other)

    @_of_numbers
    def __mul__(self, other: Any) -> Any:
        if _is(other, 0.0):
            return 0.0
        return self if _is(other, 1.0) else _made("*", self, other)

    @_of_numbers
    def __truediv__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else _made("/", self, other)

    @_of_numbers
    def __rtruediv__(self, other: Any) -> Any:
        return 0.0 if _is(other, 0.0) else _made("/", other, self)

    def __neg__(self) -> Any:
        return self.operands[0] if self.operation == "neg" else _made("neg", self)

    @_of_numbers
    def __sub__(self, other: Any) -> Any:
        return self + (-other)

    @_of_numbers
    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __pow__(self, exponent: int) -> Any:
        found: Any = 1.0
        for _ in range(exponent):
            found = self * found
        return found

    __radd__, __rmul__ = __add__, __mul__

    def sin(self) -> Any:
        """Return the sine, for np.sin."""
        return -self.operands[0].sin() if self.operation == "neg" else _made("sin", self)

    def cos(self) -> Any:
        """Return the cosine, for np.cos."""
        return self.operands[0].cos() if self.operation == "neg" else _made("cos", self)


def variable(name: str) -> Expression:
    """Return the variable of a name of C++, such as "q[6]"."""
    return _made("variable", name)


def rate(of: Any, rates: Mapping[Expression, Expression], known: dict[Any, Any]) -> Any:
    """Return the derivative of an expression in time, from those of variables; others are 0.

    known: these derivatives and all computed earlier; start with an empty one.
    """
    if not isinstance(of, Expression):
        return 0.0
    if of not in known:
        known[of] = _derived(of, rates, known)
    return known[of]


def _derived(of: Expression, rates: Mapping[Expression, Expression], known: dict[Any, Any]) -> Any:
    if of.operation == "variable":
        return rates.get(of, 0.0)
    a, b = of.operands[0], of.operands[-1]
    da, db = (rate(each, rates, known) for each in (a, b))
    if of.operation == "+":
        return da + db
    if of.operation == "*":
        return da * b + a * db
    if of.operation == "/":
        return da / b - of * db / b
    if of.operation == "neg":
        return -da
    return da * a.cos() if of.operation == "sin" else -(da * a.sin())


def code(results: Sequence[tuple[str, Any]]) -> str:
    """Return C++ that assigns expressions to places, such as ("J.data[0][6]", expression)."""
    names: dict[Expression, str] = {}
    lines: list[str] = []

    def name_of(part: Any) -> str:
        if not isinstance(part, Expression):
            return repr(float(part))
        if part.operation == "variable":
            return str(part.operands[0])
        if part not in names:
            operands = [name_of(each) for each in part.operands]
            names[part] = f"t{len(names)}"
            lines.append(
                f"const double {names[part]} = {_FORMS[part.operation].format(*operands)};"
            )
        return names[part]

    assigned = [f"{place} = {name_of(result)};" for place, result in results]
    return "\n".join(lines + assigned)


_FORMS = {"+": "{} + {}", "*": "{} * {}", "/": "{} / {}", "neg": "-{}"}
_FORMS |= {"sin": "wp::sin({})", "cos": "wp::cos({})"}


def _is(value: Any, number: float) -> bool:
    return not isinstance(value, Expression) and float(value) == number


def _made(operation: str, *operands: Any) -> Expression:
    """The one expression of an operation, whatever the order of a sum's or product's operands."""
    plain = tuple(each if isinstance(each, (Expression, str)) else float(each) for each in operands)
    key = (operation, *(sorted(plain, key=hash) if operation in "+*" else plain))
    if key not in Expression._known:
        found = object.__new__(Expression)
        found.operation, found.operands = operation, plain
        Expression._known[key] = found
    return Expression._known[key]
