"""Dual numbers in C++: values with several directional derivatives; see device/numbers.py.

A dual number is x + ε x'. Operations follow the rules of differentiation, so that device code
computes derivatives to rounding, through loops and selections. Like packs, dual numbers replace
Warp's bfloat16 by name; indices of runs become indices of directions.
"""

from typing import Any

import warp as wp

from continuair.device.options import OPTIONS
from continuair.device.single import BITS, filled

_PREAMBLE = """
namespace wp {
typedef REAL lane;
static const int LANES = COUNT;
struct dual {
    typedef lane V __attribute__((ext_vector_type(LANES), aligned(sizeof(lane))));
    lane v;
    V d;
    dual() = default;
    dual(lane of, V along) : v(of), d(along) {}
    template <typename T> dual(T all) : v((lane)all), d((V)(lane)0) {}
};
inline dual operator+(dual a, dual b) { return dual(a.v + b.v, a.d + b.d); }
inline dual operator-(dual a, dual b) { return dual(a.v - b.v, a.d - b.d); }
inline dual operator*(dual a, dual b) { return dual(a.v * b.v, a.d * b.v + a.v * b.d); }
inline dual operator/(dual a, dual b) {
    lane x = a.v / b.v;
    return dual(x, (a.d - x * b.d) / b.v);
}
inline dual operator-(dual a) { return dual(-a.v, -a.d); }
inline dual& operator+=(dual& a, dual b) { return a = a + b; }
inline dual& operator-=(dual& a, dual b) { return a = a - b; }
inline dual& operator*=(dual& a, dual b) { return a = a * b; }
inline dual& operator/=(dual& a, dual b) { return a = a / b; }
inline dual add(dual a, dual b) { return a + b; }
inline dual sub(dual a, dual b) { return a - b; }
inline dual mul(dual a, dual b) { return a * b; }
inline dual div(dual a, dual b) { return a / b; }
inline dual neg(dual a) { return -a; }
inline dual sqrt(dual a) {
    lane x = __builtin_elementwise_sqrt(a.v);
    return dual(x, x > 0 ? a.d / (x + x) : (dual::V)(lane)0);
}
inline dual abs(dual a) { return a.v < 0 ? -a : a; }
inline dual floor(dual a) { return dual(__builtin_elementwise_floor(a.v)); }
inline dual min(dual a, dual b) { return a.v < b.v ? a : b; }
inline dual max(dual a, dual b) { return a.v > b.v ? a : b; }
template <typename A> inline auto& cell(A& a, int i, int j) {
    return a.data[(long)i * a.shape[1] + j];
}
template <typename A> inline auto& cell(A& a, int i, int j, int k) {
    return a.data[((long)i * a.shape[1] + j) * a.shape[2] + k];
}
inline dual seeded(dual x, int direction, int first) {
    if (direction >= first && direction < first + LANES) x.d[direction - first] += 1;
    return x;
}
template <typename T> inline void read_duals(dual* to, const T* at, int count) {
    for (int k = 0; k < count; ++k, at += 1 + LANES) to[k] = dual(at[0], *(const dual::V*)(at + 1));
}
}
#define bfloat16 dual
"""


def numbers_of_duals(precision: str, lanes: int) -> dict[str, Any]:
    """Return the parts of a NumberCode for one run and `lanes` directions, from `run` on.

    Columns of inputs are directions: `of_row` returns each with a derivative of 1 along its own.
    Readers of structs and tables read each value followed by its derivatives, in blocks of
    directions. `keep` and `keep_of_run` write derivatives only, one row per direction.
    """
    Cell, Real, number = getattr(wp, precision), wp.bfloat16, BITS[precision]

    @wp.func_native("return a.v > b.v ? x : y;")
    def above(a: Real, b: Real, x: Real, y: Real) -> Real: ...

    @wp.func_native("return a.v > b.v;")
    def all_above(a: Real, b: Real) -> bool: ...

    @wp.func_native("return a.v - a.v == 0 ? x : y;")
    def finite(a: Real, x: Real, y: Real) -> Real: ...

    @wp.func_native(
        f"union {{ wp::lane x; {number['bits']} i; }} as; as.x = k.v + ({number['large']});"
        f" as.i <<= {number['shift']}; return wp::dual(as.x);"
    )
    def two_to(k: Real) -> Real: ...

    @wp.func_native("return wp::dual(cells.data[column]);")
    def of_run(cells: wp.array2d(dtype=Cell), run: int, column: int) -> Real: ...

    @wp.func_native("return wp::seeded(wp::cell(cells, row, 0, column), column, run);")
    def of_row(cells: wp.array3d(dtype=Cell), row: int, run: int, column: int) -> Real: ...

    @wp.func_native("return wp::dual(wp::cell(cells, 0, sample, column));")
    def of_sample(cells: wp.array3d(dtype=Cell), run: int, sample: int, column: int) -> Real: ...

    @wp.func_native(
        "for (int i = 0; i < wp::LANES && run + i < cells.shape[0]; ++i)"
        " wp::cell(cells, run + i, sample, column) = x.d[i];"
    )
    def keep(cells: wp.array3d(dtype=Cell), run: int, sample: int, column: int, x: Real): ...

    @wp.func_native(
        "for (int i = 0; i < wp::LANES && run + i < cells.shape[0]; ++i)"
        " wp::cell(cells, run + i, column) = x.d[i];"
    )
    def keep_of_run(cells: wp.array2d(dtype=Cell), run: int, column: int, x: Real): ...

    def rows_of(Struct: Any) -> Any:
        """Return the type of arrays (blocks, numbers times 1 + lanes)."""
        return wp.array2d(dtype=Cell)

    def reader_of(Struct: Any) -> Any:
        """Return the reader of a struct, whose fields are all numbers."""

        @wp.func_native(
            "wp::read_duals((wp::dual*)&out, &wp::cell(rows, run / wp::LANES, 0),"
            " rows.shape[1] / (1 + wp::LANES));"
        )
        def fill(out: wp.ref[Struct], rows: wp.array2d(dtype=Cell), run: int): ...

        return filled(Struct, Cell, fill)

    def table_of(Row: Any) -> Any:
        """Return the type of arrays (blocks, terms, functions times 1 + lanes)."""
        return wp.array3d(dtype=Cell)

    def row_reader(Row: Any) -> Any:
        width = Row._length_

        @wp.func_native(
            f"wp::vec_t<{width},wp::dual> out;"
            f" wp::read_duals(&out.c[0], &wp::cell(table, block, term, 0), {width});"
            " return out;"
        )
        def read(table: wp.array3d(dtype=Cell), block: int, term: int) -> Row: ...

        return read

    preamble = _PREAMBLE.replace("REAL", number["real"]).replace("COUNT", str(lanes))
    flags = OPTIONS["cpu_compiler_flags"] + " -Wno-psabi"
    build = wp.ModuleBuildOptions(extra_cpu_preamble=preamble)
    options = {"cpu_compiler_flags": flags, "extra_build_options": build}
    any_above = all_above
    # Dual numbers are not used in roll-outs or with a camera.
    keep_where = keep_whole = mark = at = randn = None
    return locals()


def seeding() -> Any:
    """Return seeded(x, direction, first), which adds a derivative of 1 along a direction.

    It applies if the direction is among the `DIRECTIONS` from the first on.
    """
    Real = wp.bfloat16

    @wp.func_native("return wp::seeded(x, direction, first);")
    def seeded(x: Real, direction: int, first: int) -> Real: ...

    return seeded
