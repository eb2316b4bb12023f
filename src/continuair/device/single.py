"""Numbers of single runs, for CUDA and for laws with branches; see device/numbers.py."""

from typing import Any

import warp as wp

from continuair.device.options import OPTIONS

BITS: dict[str, dict[str, Any]] = {
    "float64": {
        "real": "double",
        "bits": "long long",
        "large": "6755399441055744.0 + 1023.0",
        "shift": 52,
    },
    "float32": {"real": "float", "bits": "int", "large": "12582912.0f + 127.0f", "shift": 23},
}
"""C++ types of numbers, and constants of 2^k: k is added to a number so large that k occupies the
lowest bits, which are then shifted to the exponent."""


def filled(Struct: Any, Cell: Any, fill: Any) -> Any:
    """Return read(rows, run) -> Struct, from fill(struct, rows, run)."""

    @wp.func
    def read(rows: wp.array2d(dtype=Cell), run: int):
        out = Struct()
        fill(out, rows, run)
        return out

    return read


def numbers_of_runs(precision: str, lanes: int) -> dict[str, Any]:
    """Return the parts of a NumberCode for single runs."""
    Cell = Real = getattr(wp, precision)
    number = BITS[precision]

    @wp.func
    def above(a: Real, b: Real, x: Real, y: Real):
        """Return x where a > b, else y."""
        return wp.where(a > b, x, y)

    @wp.func
    def all_above(a: Real, b: Real):
        return a > b

    @wp.func
    def finite(a: Real, x: Real, y: Real):
        """Return x where a is finite, else y."""
        return wp.where(a - a == Real(0.0), x, y)

    @wp.func_native(
        f"union {{ {number['real']} x; {number['bits']} i; }} as; as.x = k + ({number['large']});"
        f" as.i <<= {number['shift']}; return as.x;"
    )
    def two_to(k: Real) -> Real: ...

    @wp.func
    def of_run(cells: wp.array2d(dtype=Cell), run: int, column: int):
        return cells[wp.min(run, cells.shape[0] - 1), column]

    @wp.func
    def of_row(cells: wp.array3d(dtype=Cell), row: int, run: int, column: int):
        return cells[row, wp.min(run, cells.shape[1] - 1), column]

    @wp.func
    def of_sample(cells: wp.array3d(dtype=Cell), run: int, sample: int, column: int):
        return cells[run, sample, column]

    @wp.func
    def keep(cells: wp.array3d(dtype=Cell), run: int, sample: int, column: int, x: Real):
        cells[run, sample, column] = x

    @wp.func
    def keep_where(
        cells: wp.array3d(dtype=Cell), run: int, sample: Real, column: int, x: Real, due: Real
    ):
        if due > Real(0.0):
            cells[run, wp.int32(sample), column] = x

    @wp.func
    def at(cells: wp.array(dtype=Cell), index: Real):
        return cells[wp.min(wp.int32(index), cells.shape[0] - 1)]

    @wp.func
    def keep_of_run(cells: wp.array2d(dtype=Cell), run: int, column: int, x: Real):
        cells[run, column] = x

    @wp.func
    def keep_whole(cells: wp.array(dtype=wp.int32), run: int, x: Real):
        cells[run] = wp.int32(x)

    @wp.func
    def mark(cells: wp.array(dtype=wp.int32), run: int, x: Real, value: int):
        if x > Real(0.0):
            cells[run] = value

    @wp.func
    def randn(seeds: wp.array(dtype=wp.int32), run: int, frame: int, which: int):
        """Return normal number `which` of a frame, which depends on seed and frame only."""
        generator = wp.rand_init(seeds[run], frame)
        out = Real(0.0)
        for _ in range(which + 1):
            out = Real(wp.randn(generator))
        return out

    def rows_of(Struct: Any) -> Any:
        return wp.array(dtype=Struct)

    def reader_of(Struct: Any) -> Any:
        @wp.func
        def read(rows: wp.array(dtype=Struct), run: int):
            return rows[wp.min(run, rows.shape[0] - 1)]

        return read

    def table_of(Row: Any) -> Any:
        return wp.array2d(dtype=Row)

    def row_reader(Row: Any) -> Any:
        @wp.func
        def read(table: wp.array2d(dtype=Row), vehicle: int, term: int):
            return table[vehicle, term]

        return read

    any_above, options = all_above, OPTIONS
    return locals()
