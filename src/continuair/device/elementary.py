"""Device code of sine, cosine, arctangent, exp - 1 and tanh, without branches and the C library.

They use sums and products only, so that a run has the same bits alone and in a pack, and on every
processor with fused multiply-add. Errors are a few units in the last place.
"""

from dataclasses import dataclass
from functools import cache, reduce
from math import factorial, log
from typing import Any

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding, number_code

# Cephes, S. L. Moshier: atan(x) = x + x³ p(x²) / q(x²) for |x| up to 0.66, the highest power first.
_ATAN_P = (
    -8.750608600031904122785e-1,
    -1.615753718733365076637e1,
    -7.500855792314704667340e1,
    -1.228866684490136173410e2,
    -6.485021904942025371773e1,
)
_ATAN_Q = (
    1.0,
    2.485846490142306297962e1,
    1.650270098316988542046e2,
    4.328810604912902668951e2,
    4.853903996359136964868e2,
    1.945506571482613964425e2,
)
_ATAN_NEAR = 0.66
# π/2 minus its float64 value.
_REST_OF_HALF_PI = 6.123233995736765886130e-17


@dataclass(frozen=True)
class Elementary:
    """Elementary functions.

    sine(x) and cosine(x) for |x| up to 1e5; angle_of(y, x), atan2, in (-π, π]; tanh(x);
    grown(x), exp(x) - 1, for |x| up to 44.
    polynomial(coefficients) returns a function of x; the highest power comes first.
    """

    sine: Any
    cosine: Any
    angle_of: Any
    grown: Any
    tanh: Any
    polynomial: Any


@cache
def elementary_code(numbers: Numbers) -> Elementary:
    """Return the functions for one kind of numbers."""
    code, exact = number_code(numbers), numbers.precision == "float64"
    Real, above, two_to = code.Real, code.above, code.two_to
    zero, quarter, half, one, two = (Real(x) for x in (0.0, 0.25, 0.5, 1.0, 2.0))

    def constant(coefficient: Any) -> Any:
        @wp.func
        def value(x: Real):
            return coefficient

        return value

    def plus_power(before: Any, coefficient: Any) -> Any:
        @wp.func
        def value(x: Real):
            return before(x) * x + coefficient

        return value

    def polynomial(coefficients: Any) -> Any:
        first, *others = (Real(float(each)) for each in coefficients)
        return reduce(plus_power, others, constant(first))

    terms = 8 if exact else 5
    sine_of = polynomial([(-1.0) ** k / factorial(2 * k + 1) for k in reversed(range(terms))])
    cosine_of = polynomial([(-1.0) ** k / factorial(2 * k) for k in reversed(range(terms + 1))])
    # π/2 in parts; products of the first two with a number of turns are exact.
    first, second, third = _parts(Real, np.pi / 2.0, _REST_OF_HALF_PI, exact)
    per_quarter_turn = Real(2.0 / np.pi)

    @wp.func
    def shifted_sine(x: Real, ahead: Real):
        """Return sin(x + ahead π/2), with ahead 0 or 1."""
        k = wp.floor(x * per_quarter_turn + half)
        r = ((x - k * first) - k * second) - k * third
        z = r * r
        turn = (k + ahead) * quarter
        place = turn - wp.floor(turn)
        odd = quarter * half - wp.abs(wp.abs(place - half) - quarter)
        size = above(odd, zero, cosine_of(z), r * sine_of(z))
        return above(place, Real(0.375), -size, size)

    @wp.func
    def sine(x: Real):
        return shifted_sine(x, zero)

    @wp.func
    def cosine(x: Real):
        return shifted_sine(x, one)

    numerator, denominator = polynomial(_ATAN_P), polynomial(_ATAN_Q)
    short = 0.0 if exact else np.pi / 2.0 - float(np.float32(np.pi / 2.0))
    near, rest = Real(_ATAN_NEAR), Real(short + _REST_OF_HALF_PI)
    pi, half_pi, quarter_pi = Real(np.pi), Real(np.pi / 2.0), Real(np.pi / 4.0)

    @wp.func
    def angle_of(y: Real, x: Real):
        """Return atan2(y, x), 0 at the origin."""
        a = wp.abs(x)
        b = wp.abs(y)
        large = wp.max(a, b)
        t = wp.min(a, b) / above(large, zero, large, one)
        far = above(t, near, one, zero)
        t = above(far, zero, (t - one) / (t + one), t)
        z = t * t
        out = t + t * z * (numerator(z) / denominator(z))
        out = far * quarter_pi + (out + far * half * rest)
        out = above(b, a, half_pi - (out - rest), out)
        out = above(zero, x, pi - (out - two * rest), out)
        return above(zero, y, -out, out)

    per_doubling = Real(1.0 / log(2.0))
    doubling_1, doubling_2, doubling_3 = _parts(Real, log(2.0), 0.0, exact)
    terms_of_growth = 14 if exact else 8
    growth = polynomial([1.0 / factorial(k + 1) for k in reversed(range(terms_of_growth))])
    most = Real(22.0)

    @wp.func
    def grown(x: Real):
        """Return exp(x) - 1."""
        k = wp.floor(x * per_doubling + half)
        r = ((x - k * doubling_1) - k * doubling_2) - k * doubling_3
        scale = two_to(k)
        return scale * (r * growth(r)) + (scale - one)

    @wp.func
    def tanh(x: Real):
        """Return tanh as -g / (2 + g) with g = exp(-2 |x|) - 1, and the sign of x."""
        size = wp.abs(x)
        g = grown(-two * above(size, most, most, size))
        out = -g / (two + g)
        return above(zero, x, -out, out)

    return holding(Elementary, locals())


def _parts(Real: Any, value: float, rest: float, exact: bool) -> tuple[Any, Any, Any]:
    """Return three numbers with the sum value + rest, the first two with few digits."""
    digits = 33 if exact else 11
    first = _rounded(value, digits)
    second = _rounded(value - first, digits)
    return Real(first), Real(second), Real(value - first - second + rest)


def _rounded(value: float, digits: int) -> float:
    """Return a number rounded to binary digits."""
    mantissa, exponent = np.frexp(value)
    return float(np.ldexp(np.round(np.ldexp(mantissa, digits)), exponent - digits))
