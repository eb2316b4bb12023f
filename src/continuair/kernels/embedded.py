"""Embedded Runge-Kutta pairs, and device code for sums over their stages."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.single import BITS
from continuair.device.types import Tree, device_types

MOST_STAGES = 7


@dataclass(frozen=True, eq=False)
class Pair:
    """An embedded pair whose last stage is the first of the next step (FSAL).

    order: power of h in the error estimate. stages: A (S, S), whose last row has the weights of the
    solution. nodes: C (S,). error: weights (S,) of the difference of both solutions. dense: (S, 4),
    coefficients of θ to θ⁴ in y(t + θ h) = y + h Σᵢ kᵢ Σₚ dense[i, p] θᵖ⁺¹.
    """

    order: int
    stages: np.ndarray
    nodes: np.ndarray
    error: np.ndarray
    dense: np.ndarray


def _tsit5() -> Pair:
    """Return the pair and interpolant of Tsitouras.

    Ch. Tsitouras, Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying
    assumption, Computers & Mathematics with Applications 62, 2011.
    """
    stages = np.zeros((7, 7))
    stages[1, 0] = 0.161
    stages[2, :2] = -0.008480655492356989, 0.335480655492357
    stages[3, :3] = 2.8971530571054935, -6.359448489975075, 4.3622954328695815
    stages[4, :4] = 5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525
    stages[5, :5] = (
        5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401,
        -0.028269050394068383,
    )  # fmt: skip
    stages[6, :6] = (
        0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081,
        2.324710524099774,
    )  # fmt: skip
    nodes = np.array([0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0])
    error = np.array([
        -0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995,
        -0.1447110071732629, 0.5823571654525552, -0.45808210592918697, 1.0 / 66.0,
    ])  # fmt: skip

    def of_roots(one: float, other: float) -> list[float]:
        return [1.0, -(one + other), one * other]

    # Each a factor times a quadratic in θ, times θ²; the first stage's has a linear term besides.
    quadratics = [
        (0.1017, [1.0, -2.1966568338249754, 1.2949852507374631]),
        (2.490627285651252793, [1.0, -2.38535645472061657, 1.57803468208092486]),
        (-16.54810288924490272, of_roots(1.21712927295533244, 0.61620406037800089)),
        (47.37952196281928122, of_roots(1.203071208372362603, 0.658047292653547382)),
        (-34.87065786149660974, of_roots(1.2, 2.0 / 3.0)),
        (2.5, of_roots(1.0, 0.6)),
    ]
    dense = np.zeros((7, 4))
    linear, quadratic = [1.0, -1.3299890189751412], [1.0, -1.4364028541716351, 0.7139816917074209]
    dense[0] = -1.0530884977290216 * np.polymul(linear, quadratic)[::-1]
    for stage, (factor, of) in enumerate(quadratics, start=1):
        dense[stage, 1:] = factor * np.array(of)[::-1]
    return Pair(5, stages, nodes, error, dense)


TSIT5 = _tsit5()


@dataclass(frozen=True)
class StageCode:
    """Stages, a struct of the rates at all stages, and its functions.

    combined(stages, weights (S, S), row): Σ weights[row, j] kⱼ over j < row. weighed(stages,
    weights (S,), count): the same over `count` stages. store(stages, at, rate), stored(stages, at).
    interpolate(of, stages, dense, count) fills an Interpolant; at(interpolant, θ) is
    (y(t + θ h) - y) / h. power(x, p): x to the power p within 6 %, equal on every processor.
    mixed(which, x, y): x where which > 0, else y.
    """

    Stages: Any
    Interpolant: Any
    combined: Any
    weighed: Any
    store: Any
    stored: Any
    interpolate: Any
    at: Any
    power: Any
    mixed: Any


@cache
def stage_code(numbers: Numbers, tree: Tree) -> StageCode:
    """Return the functions for states of a tree."""
    types, code = device_types(numbers, tree), number_code(numbers)
    Cell, Real, State = types.Cell, types.Real, types.State
    width, above, zero = types.layout.state, code.above, Real(0.0)
    Rates, Powers = wp.types.vector(MOST_STAGES * width, Real), wp.types.vector(4 * width, Real)
    packed = numbers.lanes > 1
    number = BITS[numbers.precision]["real"]
    pack = "wp::pack" if packed else number
    state = f"wp::vec_t<{width},{pack}> out;"
    # Unrolled sums take longer to compile than the rest, and run no faster.
    rolled = "\n#if defined(__clang__)\n#pragma clang loop unroll(disable)\n#endif\n"

    @wp.struct
    class Stages:
        """Rates of the state at all stages, one after the other."""

        rates: Rates

    @wp.struct
    class Interpolant:
        """Coefficients of θ to θ⁴, one after the other."""

        powers: Powers

    def summed(weight: str, count: str) -> str:
        return (
            f"{state} {rolled} for (int j = 0; j < {count}; ++j) {{ {number} a = {weight};"
            f" for (int i = 0; i < {width}; ++i)"
            f" out.c[i] += stages.rates.c[j * {width} + i] * ({pack})(a); }} return out;"
        )

    @wp.func_native(summed("weights.data[(long)row * weights.shape[1] + j]", "row"))
    def combined(stages: wp.ref[Stages], weights: wp.array2d(dtype=Cell), row: int) -> State: ...

    @wp.func_native(summed("weights.data[j]", "count"))
    def weighed(stages: wp.ref[Stages], weights: wp.array(dtype=Cell), count: int) -> State: ...

    @wp.func_native(
        f"for (int i = 0; i < {width}; ++i) stages.rates.c[at * {width} + i] = rate.c[i];"
    )
    def store(stages: wp.ref[Stages], at: int, rate: State): ...

    @wp.func_native(
        f"{state} for (int i = 0; i < {width}; ++i) out.c[i] = stages.rates.c[at * {width} + i];"
        " return out;"
    )
    def stored(stages: wp.ref[Stages], at: int) -> State: ...

    @wp.func_native(
        f"{rolled} for (int p = 0; p < 4; ++p) {rolled} for (int i = 0; i < {width}; ++i) {{"
        f" {pack} s(({number})0); {rolled} for (int j = 0; j < count; ++j)"
        f" s = s + stages.rates.c[j * {width} + i] * ({pack})(dense.data[j * dense.shape[1] + p]);"
        f" of.powers.c[p * {width} + i] = s; }}"
    )
    def interpolate(
        of: wp.ref[Interpolant], stages: wp.ref[Stages], dense: wp.array2d(dtype=Cell), count: int
    ): ...

    @wp.func_native(
        f"{state} const auto* c = &of.powers.c[0]; for (int i = 0; i < {width}; ++i) out.c[i] ="
        f" x * (c[i] + x * (c[{width} + i] + x * (c[{2 * width} + i] + x * c[{3 * width} + i])));"
        " return out;"
    )
    def at(of: wp.ref[Interpolant], x: Real) -> State: ...

    @wp.func_native(_power_text(numbers.precision, packed))
    def power(x: Real, p: Cell) -> Real: ...

    @wp.func
    def mixed(which: Real, x: State, y: State):
        out = State()
        for j in range(width):
            out[j] = above(which, zero, x[j], y[j])
        return out

    return holding(StageCode, locals())


def _power_text(precision: str, packed: bool) -> str:
    """Return C++ code of x^p for x > 0, from the bits of x, which approximate its logarithm."""
    number, bits = (BITS[precision][name] for name in ("real", "bits"))
    mantissa, bias = {"float64": (52, 1023), "float32": (23, 127)}[precision]
    scale, unscale = repr(2.0**-mantissa), repr(2.0**mantissa)
    if packed:
        kind, convert = "wp::pack::V", "__builtin_convertvector(as.i, wp::pack::V)"
        whole, argument, result = "__builtin_convertvector(l, bits)", "x.v", "wp::pack(as.x)"
        vector = f"typedef {bits} bits __attribute__((ext_vector_type(wp::LANES)));"
    else:
        kind, convert, whole, argument, result = number, f"({number})as.i", "(bits)l", "x", "as.x"
        vector = f"typedef {bits} bits;"
    return (
        f"{vector} union {{ {kind} x; bits i; }} as; as.x = {argument};"
        f" {kind} l = {convert} * ({number}){scale} - ({number}){bias};"
        f" l = (l * p + ({number}){bias}) * ({number}){unscale};"
        f" as.i = {whole}; return {result};"
    )
