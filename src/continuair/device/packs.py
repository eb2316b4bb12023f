"""Packs of runs in C++, as vectors of the CPU; see device/numbers.py.

Warp has no type for packs. The preamble below replaces its bfloat16, which is not used otherwise,
by a pack.
"""

from typing import Any

import warp as wp

from continuair.device.options import OPTIONS
from continuair.device.single import BITS, filled

_PREAMBLE = """
namespace wp {
typedef REAL lane;
static const int LANES = COUNT;
struct pack {
    typedef lane V __attribute__((ext_vector_type(LANES)));
    V v;
    pack() = default;
    pack(V of) : v(of) {}
    template <typename T> pack(T all) : v((V)(lane)all) {}
};
inline pack operator+(pack a, pack b) { return a.v + b.v; }
inline pack operator-(pack a, pack b) { return a.v - b.v; }
inline pack operator*(pack a, pack b) { return a.v * b.v; }
inline pack operator/(pack a, pack b) { return a.v / b.v; }
inline pack operator-(pack a) { return -a.v; }
inline pack& operator+=(pack& a, pack b) { a.v += b.v; return a; }
inline pack& operator-=(pack& a, pack b) { a.v -= b.v; return a; }
inline pack& operator*=(pack& a, pack b) { a.v *= b.v; return a; }
inline pack& operator/=(pack& a, pack b) { a.v /= b.v; return a; }
inline pack add(pack a, pack b) { return a + b; }
inline pack sub(pack a, pack b) { return a - b; }
inline pack mul(pack a, pack b) { return a * b; }
inline pack div(pack a, pack b) { return a / b; }
inline pack neg(pack a) { return -a; }
inline pack sqrt(pack a) { return __builtin_elementwise_sqrt(a.v); }
inline pack abs(pack a) { return __builtin_elementwise_abs(a.v); }
inline pack floor(pack a) { return __builtin_elementwise_floor(a.v); }
inline pack min(pack a, pack b) { return a.v < b.v ? a.v : b.v; }
inline pack max(pack a, pack b) { return a.v > b.v ? a.v : b.v; }
template <typename F> inline pack each(F of) {
    pack x;
    for (int i = 0; i < LANES; ++i) x.v[i] = of(i);
    return x;
}
template <typename F> inline void for_each(int run, int runs, F what) {
    for (int i = 0; i < LANES && run + i < runs; ++i) what(i);
}
inline int within(int at, int size) { return at < size ? at : size - 1; }
template <typename A> inline auto& cell(A& a, int i, int j) {
    return a.data[(long)i * a.shape[1] + j];
}
template <typename A> inline auto& cell(A& a, int i, int j, int k) {
    return a.data[((long)i * a.shape[1] + j) * a.shape[2] + k];
}
}
#define bfloat16 pack
"""


def numbers_of_packs(precision: str, lanes: int) -> dict[str, Any]:
    """Return the parts of a NumberCode for packs of `lanes` runs."""
    Cell, Real, number = getattr(wp, precision), wp.bfloat16, BITS[precision]

    @wp.func_native("return a.v > b.v ? x.v : y.v;")
    def above(a: Real, b: Real, x: Real, y: Real) -> Real: ...

    @wp.func_native(
        "bool all = true; for (int i = 0; i < wp::LANES; ++i) all = all && a.v[i] > b.v[i];"
        " return all;"
    )
    def all_above(a: Real, b: Real) -> bool: ...

    @wp.func_native(
        "bool any = false; for (int i = 0; i < wp::LANES; ++i) any = any || a.v[i] > b.v[i];"
        " return any;"
    )
    def any_above(a: Real, b: Real) -> bool: ...

    @wp.func_native("return (a.v - a.v == (wp::lane)0) ? x.v : y.v;")
    def finite(a: Real, x: Real, y: Real) -> Real: ...

    @wp.func_native(
        f"typedef {number['bits']} bits __attribute__((ext_vector_type(wp::LANES)));"
        f" union {{ wp::pack::V x; bits i; }} as; as.x = k.v + (wp::lane)({number['large']});"
        f" as.i <<= {number['shift']}; return as.x;"
    )
    def two_to(k: Real) -> Real: ...

    @wp.func_native(
        "int n = cells.shape[0]; if (n == 1) return wp::pack(cells.data[column]);"
        " return wp::each("
        "[&](int i) { return wp::cell(cells, wp::within(run + i, n), column); });"
    )
    def of_run(cells: wp.array2d(dtype=Cell), run: int, column: int) -> Real: ...

    @wp.func_native(
        "int n = cells.shape[1]; if (n == 1) return wp::pack(wp::cell(cells, row, 0, column));"
        " return wp::each("
        "[&](int i) { return wp::cell(cells, row, wp::within(run + i, n), column); });"
    )
    def of_row(cells: wp.array3d(dtype=Cell), row: int, run: int, column: int) -> Real: ...

    @wp.func_native(
        "int n = cells.shape[0]; return wp::each("
        "[&](int i) { return wp::cell(cells, wp::within(run + i, n), sample, column); });"
    )
    def of_sample(cells: wp.array3d(dtype=Cell), run: int, sample: int, column: int) -> Real: ...

    @wp.func_native(
        "wp::for_each(run, cells.shape[0], "
        "[&](int i) { wp::cell(cells, run + i, sample, column) = x.v[i]; });"
    )
    def keep(cells: wp.array3d(dtype=Cell), run: int, sample: int, column: int, x: Real): ...

    @wp.func_native(
        "wp::for_each(run, cells.shape[0], [&](int i) {"
        " if (due.v[i] > 0) wp::cell(cells, run + i, (int)sample.v[i], column) = x.v[i]; });"
    )
    def keep_where(
        cells: wp.array3d(dtype=Cell), run: int, sample: Real, column: int, x: Real, due: Real
    ): ...

    @wp.func_native(
        "int n = cells.shape[0]; return wp::each("
        "[&](int i) { return cells.data[wp::within((int)index.v[i], n)]; });"
    )
    def at(cells: wp.array(dtype=Cell), index: Real) -> Real: ...

    @wp.func_native(
        "wp::for_each(run, cells.shape[0], "
        "[&](int i) { wp::cell(cells, run + i, column) = x.v[i]; });"
    )
    def keep_of_run(cells: wp.array2d(dtype=Cell), run: int, column: int, x: Real): ...

    @wp.func_native(
        "wp::for_each(run, cells.shape[0], [&](int i) { cells.data[run + i] = (int)x.v[i]; });"
    )
    def keep_whole(cells: wp.array(dtype=wp.int32), run: int, x: Real): ...

    @wp.func_native(
        "wp::for_each(run, cells.shape[0], "
        "[&](int i) { if (x.v[i] > 0) cells.data[run + i] = value; });"
    )
    def mark(cells: wp.array(dtype=wp.int32), run: int, x: Real, value: int): ...

    @wp.func_native(
        "int n = seeds.shape[0]; return wp::each([&](int i) {"
        " auto generator = wp::rand_init(seeds.data[wp::within(run + i, n)], frame);"
        " wp::lane x = 0; for (int k = 0; k <= which; ++k) x = wp::randn(generator); return x; });"
    )
    def randn(seeds: wp.array(dtype=wp.int32), run: int, frame: int, which: int) -> Real: ...

    def rows_of(Struct: Any) -> Any:
        return wp.array2d(dtype=Cell)

    def reader_of(Struct: Any) -> Any:
        """Return the reader of a struct, whose fields are all numbers."""

        @wp.func_native(
            "auto* to = (wp::pack*)&out; int n = rows.shape[0];"
            " for (int k = 0; k < rows.shape[1]; ++k) to[k] = wp::each("
            "[&](int i) { return wp::cell(rows, wp::within(run + i, n), k); });"
        )
        def fill(out: wp.ref[Struct], rows: wp.array2d(dtype=Cell), run: int): ...

        return filled(Struct, Cell, fill)

    def table_of(Row: Any) -> Any:
        """Return the type of arrays (packs, terms, functions times lanes)."""
        return wp.array3d(dtype=Cell)

    def row_reader(Row: Any) -> Any:
        width = Row._length_

        @wp.func_native(
            f"wp::vec_t<{width},wp::pack> out; const auto* at = &wp::cell(table, pack, term, 0);"
            " typedef wp::pack::V U __attribute__((aligned(sizeof(wp::lane))));"
            f" for (int k = 0; k < {width}; ++k, at += wp::LANES) out.c[k] = *(const U*)at;"
            " return out;"
        )
        def read(table: wp.array3d(dtype=Cell), pack: int, term: int) -> Row: ...

        return read

    preamble = _PREAMBLE.replace("REAL", number["real"]).replace("COUNT", str(lanes))
    flags = OPTIONS["cpu_compiler_flags"] + " -Wno-psabi"
    build = wp.ModuleBuildOptions(extra_cpu_preamble=preamble)
    options = {"cpu_compiler_flags": flags, "extra_build_options": build}
    return locals()
