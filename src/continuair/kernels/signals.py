"""Device code of signals: their values at a time, and the longest step over them."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.single import BITS


@dataclass(frozen=True)
class SignalCode:
    """Signals, a struct of kernel arguments, and its functions.

    evaluate(signals, table, run, time, left) writes the values at a time into row 0 of a table (1,
    runs, columns); left: 1.0 for the left limit at a breakpoint. longest(signals, run, time):
    longest step from a time. next_break(signals, run, index): breakpoint of an index, 1e30 after
    the last.
    """

    Signals: Any
    evaluate: Any
    longest: Any
    next_break: Any


@cache
def signal_struct(precision: str) -> Any:
    """Return the struct `Signals` of one precision."""
    Cell = getattr(wp, precision)

    @wp.struct
    class Signals:
        """Tracks of piecewise signals, which are added in columns of a table.

        index (runs or 1, tracks, 2): first piece of a run's track, and number of pieces. kinds
        (tracks, 3): terms of a polynomial, number of columns, and index of the first in `columns`.
        driven: all columns to which tracks are added. edges (pieces, 2): start and end [s]. offsets
        (pieces,): of each piece's first coefficient. breaks: breakpoints [s]; break_index (runs or
        1, 2): first breakpoint of a run, and their number. cursor (runs, tracks): the piece
        evaluated last.
        """

        index: wp.array3d(dtype=wp.int32)
        kinds: wp.array2d(dtype=wp.int32)
        columns: wp.array(dtype=wp.int32)
        driven: wp.array(dtype=wp.int32)
        edges: wp.array2d(dtype=Cell)
        offsets: wp.array(dtype=wp.int32)
        coefficients: wp.array(dtype=Cell)
        breaks: wp.array(dtype=Cell)
        break_index: wp.array2d(dtype=wp.int32)
        cursor: wp.array2d(dtype=wp.int32)

    return Signals


@cache
def signal_code(numbers: Numbers) -> SignalCode:
    """Return the functions for one kind of numbers; in packs each run has its own time."""
    code, Signals = number_code(numbers), signal_struct(numbers.precision)
    Cell, Real = code.Cell, code.Real
    packed = numbers.lanes > 1
    number = BITS[numbers.precision]["real"]
    pack, many = ("wp::pack", "wp::LANES") if packed else (number, "1")

    def lane(name: str) -> str:
        return f"{name}.v[i]" if packed else name

    # A run's row of the index, and the piece of a track that contains a time. The search starts at
    # the previous piece; the result does not depend on it.
    find = (
        " int runs = signals.cursor.shape[0], tracks = signals.kinds.shape[0];"
        f" for (int i = 0; i < {many}; ++i) {{"
        " int r = run + i; if (r >= runs) break;"
        " int row = signals.index.shape[0] == 1 ? 0 : r;"
        f" {number} t = {lane('time')};"
        " for (int q = 0; q < tracks; ++q) {"
        " const auto* own = &signals.index.data[((long)row * tracks + q) * 2];"
        f" const {number}* edges = &signals.edges.data[2 * (long)own[0]];"
        " int last = own[1] - 1; auto& k = signals.cursor.data[(long)r * tracks + q];"
    )
    right = " while (k < last && t >= edges[2 * k + 2]) ++k; while (k > 0 && t < edges[2 * k]) --k;"
    left = " while (k < last && t > edges[2 * k + 2]) ++k; while (k > 0 && t <= edges[2 * k]) --k;"

    @wp.func_native(
        " int columns = table.shape[2], driven = signals.driven.shape[0];"
        f" for (int i = 0; i < {many}; ++i) {{ int r = run + i; if (r >= table.shape[1]) break;"
        " for (int m = 0; m < driven; ++m)"
        " table.data[(long)r * columns + signals.driven.data[m]] = 0; }"
        + find
        + f" if ({lane('before')} > 0) {{ {left} }} else {{ {right} }}"
        f" {number} u = 2 * (t - edges[2 * k]) / (edges[2 * k + 1] - edges[2 * k]) - 1;"
        " const auto* kind = &signals.kinds.data[q * 3]; int terms = kind[0], width = kind[1];"
        f" const {number}* c = &signals.coefficients.data[signals.offsets.data[own[0] + k]];"
        " const auto* to = &signals.columns.data[kind[2]];"
        f" for (int m = 0; m < width; ++m, c += terms) {{ {number} x = c[0];"
        " for (int d = 1; d < terms; ++d) x = x * u + c[d];"
        " table.data[(long)r * columns + to[m]] += x; } } }"
    )
    def evaluate(
        signals: Signals, table: wp.array3d(dtype=Cell), run: int, time: Real, before: Real
    ): ...

    # A step is at most as long as its own piece, and ends within the next one at most.
    @wp.func_native(
        f" {pack} out(({number})1e30);"
        + find
        + right
        + f" {number} own_length = edges[2 * k + 1] - edges[2 * k], reach = own_length;"
        " if (k < last) {"
        f" {number} own_left = edges[2 * k + 1] - t; own_left = own_left > 0 ? own_left : 0;"
        " reach = own_left + edges[2 * k + 3] - edges[2 * k + 2]; }"
        " reach = reach < own_length ? reach : own_length;"
        f" if (last > 0 && reach < {lane('out')}) {lane('out')} = reach; }} }}"
        " return out;"
    )
    def longest(signals: Signals, run: int, time: Real) -> Real: ...

    @wp.func_native(
        f" {pack} out(({number})1e30); int rows = signals.break_index.shape[0];"
        f" for (int i = 0; i < {many}; ++i) {{"
        " int r = rows == 1 ? 0 : (run + i < rows ? run + i : rows - 1);"
        f" int k = (int){lane('at')}; const auto* own = &signals.break_index.data[2 * r];"
        f" if (k < own[1]) {lane('out')} = signals.breaks.data[own[0] + k]; }}"
        " return out;"
    )
    def next_break(signals: Signals, run: int, at: Real) -> Real: ...

    return holding(SignalCode, locals())
