"""C++ of a section with a strain field: sums over its nodes, for any kind of numbers.

Loops over nodes and coordinates hold arrays, which device code in Python would copy at each access.
The text is made for given orders, so that every loop has a constant number of turns.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leg2poly

from continuair.vehicle.strain import Orders

_TOOLS = """
    typedef decltype(q.c[0] + q.c[0]) R;
    const R zero = R(0.0), one = R(1.0);
    // Without a constructor, as that of Warp's vectors sets arrays of them to zero.
    struct V {{
        R c[3];
        CUDA_CALLABLE V operator+(const V& a) const {{
            return {{c[0] + a.c[0], c[1] + a.c[1], c[2] + a.c[2]}};
        }}
        CUDA_CALLABLE V operator-(const V& a) const {{
            return {{c[0] - a.c[0], c[1] - a.c[1], c[2] - a.c[2]}};
        }}
        CUDA_CALLABLE operator wp::vec_t<3, R>() const {{ return {{c[0], c[1], c[2]}}; }}
    }};
    struct Axes {{ V x, y, z; }};
    auto dot = [](const V& a, const V& b) {{
        return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2];
    }};
    auto cross = [](const V& a, const V& b) {{
        return V{{a.c[1] * b.c[2] - a.c[2] * b.c[1], a.c[2] * b.c[0] - a.c[0] * b.c[2],
                 a.c[0] * b.c[1] - a.c[1] * b.c[0]}};
    }};
    auto add_dot = [](R& to, const V& a, const V& b) {{
        to += a.c[0] * b.c[0]; to += a.c[1] * b.c[1]; to += a.c[2] * b.c[2];
    }};
    auto add_cross = [](V& to, const V& a, const V& b) {{
        to.c[0] += a.c[1] * b.c[2]; to.c[0] -= a.c[2] * b.c[1];
        to.c[1] += a.c[2] * b.c[0]; to.c[1] -= a.c[0] * b.c[2];
        to.c[2] += a.c[0] * b.c[1]; to.c[2] -= a.c[1] * b.c[0];
    }};
    auto scaled = [](const R& s, const V& a) {{ return V{{s * a.c[0], s * a.c[1], s * a.c[2]}}; }};
    auto legendre = [&](const R& y, R* of) {{
        R square = y * y;
        of[0] = one;
        of[1] = y;
        of[2] = R(1.5) * square - R(0.5);
        of[3] = y * (R(2.5) * square - R(1.5));
    }};
    // Quaternions x y z w of the axes, as a power series in y about the middle.
    R powers[{powers}][3], series[{terms}][4];
{of_powers}
    for (int c = 0; c < 3; ++c) series[0][c] = zero;
    series[0][3] = one;
    for (int k = 0; k + 1 < {terms}; ++k) {{
        R a = zero, b = zero, c = zero, d = zero;
        for (int p = 0; p < {powers}; ++p) {{
            if (p > k) break;
            const R *s = series[k - p], *u = powers[p];
            a += s[3] * u[0]; b += s[3] * u[1]; c += s[0] * u[1]; d -= s[0] * u[0];
            a -= s[2] * u[1]; b += s[2] * u[0]; c -= s[1] * u[0]; d -= s[1] * u[1];
            if ({twists}) {{
                a += s[1] * u[2]; b -= s[0] * u[2]; c += s[3] * u[2]; d -= s[2] * u[2];
            }}
        }}
        R part = R(1.0 / (k + 1));
        series[k + 1][0] = part * a; series[k + 1][1] = part * b;
        series[k + 1][2] = part * c; series[k + 1][3] = part * d;
    }}
    auto quaternion = [&](const R& y, R* out) {{
        for (int c = 0; c < 4; ++c) out[c] = series[{terms} - 1][c];
        for (int k = {terms} - 2; k >= 0; --k)
            for (int c = 0; c < 4; ++c) out[c] = y * out[c] + series[k][c];
    }};
    R base[4];
    quaternion(R(-1.0), base);
    auto attitude = [&](const R& y, R* out) {{
        R a[4];
        quaternion(y, a);
        out[0] = base[3] * a[0] - base[0] * a[3] - base[1] * a[2] + base[2] * a[1];
        out[1] = base[3] * a[1] - base[1] * a[3] - base[2] * a[0] + base[0] * a[2];
        out[2] = base[3] * a[2] - base[2] * a[3] - base[0] * a[1] + base[1] * a[0];
        out[3] = base[3] * a[3] + base[0] * a[0] + base[1] * a[1] + base[2] * a[2];
    }};
    auto axes = [&](const R& y) {{
        R a[4];
        attitude(y, a);
        const R two = R(2.0);
        R xx = two * a[0] * a[0], yy = two * a[1] * a[1], zz = two * a[2] * a[2];
        R xy = two * a[0] * a[1], xz = two * a[0] * a[2], yz = two * a[1] * a[2];
        R wx = two * a[3] * a[0], wy = two * a[3] * a[1], wz = two * a[3] * a[2];
        return Axes{{V{{one - yy - zz, xy + wz, xz - wy}}, V{{xy - wz, one - xx - zz, yz + wx}},
                     V{{xz + wy, yz - wx, one - xx - yy}}}};
    }};
    // Columns per coordinate of what turns, and moves, the cross-section.
    auto columns = [&](const R& y, const Axes& R_, V* out) {{
        R of[4];
        legendre(y, of);
        for (int p = 0; p < {bending}; ++p) {{
            out[p] = scaled(zero - of[p], R_.y);
            out[{bending} + p] = scaled(of[p], R_.x);
        }}
        for (int p = 0; p < {twist}; ++p) out[2 * {bending} + p] = scaled(zero - of[p], R_.z);
        for (int p = 0; p < {stretch}; ++p) out[{turning} + p] = scaled(zero - of[p], R_.z);
        for (int p = 0; p < {shear}; ++p) {{
            out[{turning} + {stretch} + p] = scaled(of[p], R_.x);
            out[{turning} + {stretch} + {shear} + p] = scaled(of[p], R_.y);
        }}
    }};
    auto advance = [&](const Axes& R_, const V* of) {{
        V t = scaled(R(-1.0), R_.z);
        for (int c = {turning}; c < {n}; ++c) t = t + scaled(q.c[c], of[c]);
        return t;
    }};
"""

_SECTION = """
    const R length = rows.data[{m} + 5][0];
    V normal[{m}], t[{m}], c[{m}][{n}], p[{m} + 1], W[{m} + 1][{room}], P[{m} + 1][{n}];
    V w[{m} + 1], v[{m} + 1], alpha[{m} + 1], a[{m} + 1], at[{m}];
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        R y = R(2.0) * rows.data[{m} + 1][i] - R(1.0);
        Axes R_ = axes(y);
        normal[i] = R_.z;
        columns(y, R_, c[i]);
        t[i] = scaled(length, advance(R_, c[i]));
        for (int k = {turning}; k < {n}; ++k) c[i][k] = scaled(length, c[i][k]);
    }}
    // Integrals to each node and to the end: of what advances and turns, then of what moves, whose
    // columns replace the others. Loops over columns are kept as loops: unrolled, all columns would
    // be loaded first, and stored again, as they do not fit in registers.
    auto integral = [&](int i, auto of) {{
        V sum = scaled(rows.data[i][0], of(0));
        for (int k = 1; k < {m}; ++k) sum = sum + scaled(rows.data[i][k], of(k));
        return sum;
    }};
    auto at_node = [&](int k) -> const V& {{ return at[k]; }};
    #pragma unroll 1
    for (int i = 0; i <= {m}; ++i) {{
        p[i] = integral(i, [&](int k) -> const V& {{ return t[k]; }});
        V turned = {{zero, zero, zero}};
        #pragma unroll 1
        for (int j = 0; j < {turning}; ++j) {{
            const V sum = integral(i, [&](int k) -> const V& {{ return c[k][j]; }});
            turned = turned + scaled(rates.c[j], sum);
            W[i][j] = sum;
        }}
        w[i] = turned;
    }}
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        V turn = {{zero, zero, zero}};
        for (int j = 0; j < {turning}; ++j) {{
            turn = turn + scaled(rates.c[j], c[i][j]);
            c[i][j] = cross(W[i][j], t[i]);
        }}
        at[i] = cross(w[i], turn);
    }}
    #pragma unroll 1
    for (int i = 0; i <= {m}; ++i) {{
        V moved = {{zero, zero, zero}};
        #pragma unroll 1
        for (int j = 0; j < {n}; ++j) {{
            const V sum = integral(i, [&](int k) -> const V& {{ return c[k][j]; }});
            moved = moved + scaled(rates.c[j], sum);
            P[i][j] = sum;
        }}
        v[i] = moved;
    }}
    #pragma unroll 1
    for (int i = 0; i <= {m}; ++i) alpha[i] = integral(i, at_node);
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        V swept = cross(w[i], t[i]);
        for (int j = {turning}; j < {n}; ++j) swept = swept + scaled(R(2.0) * rates.c[j], c[i][j]);
        at[i] = cross(alpha[i], t[i]) + cross(w[i], swept);
    }}
    #pragma unroll 1
    for (int i = 0; i <= {m}; ++i) a[i] = integral(i, at_node);
    // Sums over the bodies at the nodes, and the symmetric forms of z = (w_, rates) and z' there.
    const R half = R(0.5);
    const V w0{{w_.c[0], w_.c[1], w_.c[2]}}, v0{{v_.c[0], v_.c[1], v_.c[2]}};
    const V none{{zero, zero, zero}}, only = w0 - v0;
    V H = none, force = none, moment = none, turning_force = none, turning_moment = none;
    V f[{m}], couple[{m}];
    R I[6], trace = zero;
    for (int k = 0; k < 6; ++k) I[k] = zero;
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        const R mass = rows.data[{m} + 2][i], aside = rows.data[{m} + 3][i];
        const R along = rows.data[{m} + 4][i] - aside;
        const V z = normal[i], r = p[i], mr = scaled(mass, r), jz = scaled(along, z);
        const R rr = dot(mr, r);
        H = H + mr;
        trace += aside + rr;
        I[0] += jz.c[0] * z.c[0] - mr.c[0] * r.c[0]; I[1] += jz.c[0] * z.c[1] - mr.c[0] * r.c[1];
        I[2] += jz.c[0] * z.c[2] - mr.c[0] * r.c[2]; I[3] += jz.c[1] * z.c[1] - mr.c[1] * r.c[1];
        I[4] += jz.c[1] * z.c[2] - mr.c[1] * r.c[2]; I[5] += jz.c[2] * z.c[2] - mr.c[2] * r.c[2];
        // Force and moment of inertia for z' that turns the base by `by`, and moves and turns the
        // node relative to it by `swept` and `spun`; a0, alpha0: accelerations on a base at rest.
        auto inertial = [&](const V& by, const V& swept, const V& spun, const V& a0,
                            const V& alpha0) {{
            const V of_w = scaled(half, cross(w0, r)) + v[i], s = w0 + w[i];
            const V of_by = scaled(half, cross(by, r)) + swept, other = by + spun;
            f[i] = scaled(mass, a0 + cross(w0, of_by) + cross(by, of_w));
            const V turn = alpha0 + scaled(half, cross(w0, spun) + cross(by, w[i]));
            const V gyro = scaled(half * dot(z, other), cross(s, jz))
                + scaled(half * dot(z, s), cross(other, jz));
            couple[i] = scaled(aside, turn) + scaled(dot(jz, turn), z) + gyro;
        }};
        inertial(only, none, none, none, none);
        turning_force = turning_force + f[i];
        turning_moment = turning_moment + cross(r, f[i]) + couple[i];
        inertial(v0, v[i], w[i], a[i], alpha[i]);
        force = force + f[i];
        moment = moment + cross(r, f[i]) + couple[i];
    }}
    // Column by column: the sums of one column stay in registers.
    for (int j = 0; j < {n}; ++j) {{
        V F = none, L = none;
        R N[{n}], b = zero;
        for (int k = 0; k <= j; ++k) N[k] = zero;
        #pragma unroll 1
        for (int i = 0; i < {m}; ++i) {{
            const R aside = rows.data[{m} + 3][i], along = rows.data[{m} + 4][i] - aside;
            const V mP = scaled(rows.data[{m} + 2][i], P[i][j]), &z = normal[i];
            F = F + mP;
            add_cross(L, p[i], mP);
            add_dot(b, P[i][j], f[i]);
            for (int k = 0; k <= j; ++k) add_dot(N[k], P[i][k], mP);
            if (j < {turning}) {{
                const V& Wj = W[i][j];
                const V spin = scaled(aside, Wj) + scaled(along * dot(z, Wj), z);
                L = L + spin;
                add_dot(b, Wj, couple[i]);
                for (int k = 0; k <= j; ++k) add_dot(N[k], W[i][k], spin);
            }}
        }}
        for (int k = 0; k < 3; ++k) {{
            out.F.data[k][j] = F.c[k];
            out.L.data[k][j] = L.c[k];
            out.P.data[k][j] = P[{m}][j].c[k];
            out.W.data[k][j] = zero;
        }}
        out.coordinates.c[j] = b;
        for (int k = 0; k <= j; ++k) out.N.data[k][j] = out.N.data[j][k] = N[k];
    }}
    out.H = H;
    out.I = wp::mat_t<3, 3, R>(I[0] + trace, I[1], I[2], I[1], I[3] + trace, I[4], I[2], I[4],
                               I[5] + trace);
    out.force = force;
    out.moment = moment;
    out.turning_force = turning_force;
    out.turning_moment = turning_moment;
    for (int j = 0; j < {turning}; ++j)
        for (int k = 0; k < 3; ++k) out.W.data[k][j] = W[{m}][j].c[k];
    Axes tip = axes(R(1.0));
    for (int k = 0; k < 3; ++k) {{
        out.R.data[k][0] = tip.x.c[k]; out.R.data[k][1] = tip.y.c[k]; out.R.data[k][2] = tip.z.c[k];
    }}
    out.p = p[{m}];
    out.moved = v[{m}];
    out.turned = w[{m}];
    out.base = a[{m}];
    out.spin = alpha[{m}];
"""

_PLACE = """
    const double points[{m}] = {{{points}}}, weights[{m}] = {{{weights}}};
    const double to_nodes[{m}][{m}] = {{{to_nodes}}};
    V t[{m}], c[{m}][{n}], none{{zero, zero, zero}}, end = none;
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        R y = R(2.0 * points[i]) * share - R(1.0);
        Axes R_ = axes(y);
        columns(y, R_, c[i]);
        t[i] = scaled(share * length, advance(R_, c[i]));
        for (int j = 0; j < {turning}; ++j) c[i][j] = scaled(share, c[i][j]);
        for (int j = {turning}; j < {n}; ++j) c[i][j] = scaled(share * length, c[i][j]);
        end = end + scaled(R(weights[i]), t[i]);
    }}
    V P[{n}], W[{room}];
    for (int j = 0; j < {n}; ++j) P[j] = none;
    for (int j = 0; j < {turning}; ++j) W[j] = none;
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        V lever = end;
        for (int k = 0; k < {m}; ++k) lever = lever - scaled(R(to_nodes[i][k]), t[k]);
        for (int j = 0; j < {turning}; ++j) {{
            const V turn = scaled(R(weights[i]), c[i][j]);
            W[j] = W[j] + turn;
            P[j] = P[j] + cross(turn, lever);
        }}
        for (int j = {turning}; j < {n}; ++j) P[j] = P[j] + scaled(R(weights[i]), c[i][j]);
    }}
    R turn[4];
    attitude(R(2.0) * share - R(1.0), turn);
    out.turn = wp::quat_t<R>(turn[0], turn[1], turn[2], turn[3]);
    out.point = end;
    for (int j = 0; j < {n}; ++j)
        for (int k = 0; k < 3; ++k) {{
            out.P.data[k][j] = P[j].c[k];
            out.W.data[k][j] = j < {turning} ? W[j].c[k] : zero;
        }}
"""


def section_text(orders: Orders, nodes: int) -> str:
    """Return the body of a function that fills the sums of a section.

    Its arguments: out, the sums; rows, the section's table; q and rates, its coordinates; w_ and
    v_, angular velocities of the base, as in bending_bias of sections/kind.py.
    """
    return _made(_TOOLS + _SECTION, orders, nodes, {})


def place_text(orders: Orders, nodes: int, points: np.ndarray, weights: np.ndarray,
               to_nodes: np.ndarray) -> str:  # fmt: skip
    """Return the body of a function that fills a point of the backbone.

    Its arguments: out, the point; q; length; share of the length.
    """
    numbers = {"points": points, "weights": weights, "to_nodes": to_nodes.ravel()}
    listed = {name: ", ".join(map(repr, map(float, each))) for name, each in numbers.items()}
    return _made(_TOOLS + _PLACE, orders, nodes, listed)


def _made(text: str, orders: Orders, nodes: int, others: dict[str, str]) -> str:
    bending, _, twist, stretch, shear, _ = orders.counts
    return text.format(
        m=nodes, n=len(orders.coordinates), turning=orders.turning, room=max(orders.turning, 1),
        bending=bending, twist=twist, stretch=stretch, shear=shear, terms=2 * nodes + 2,
        powers=orders.highest + 1, twists=int(twist > 0), of_powers=_powers(orders), **others,
    )  # fmt: skip


def _powers(orders: Orders) -> str:
    """Return the lines that set κ/4 as a polynomial in y = 2 s/l - 1, the lowest power first."""
    bending, _, twist, *_ = orders.counts
    found = []
    for k in range(orders.highest + 1):
        for axis, (first, count, sign) in enumerate(
            ((bending, bending, 0.25), (0, bending, -0.25), (2 * bending, twist, -0.25))
        ):
            parts = [
                f"R({sign * _monomial(p, k)!r}) * q.c[{first + p}]"
                for p in range(count)
                if _monomial(p, k)
            ]
            found.append(f"    powers[{k}][{axis}] = {' + '.join(parts) or 'zero'};")
    return "\n".join(found)


def _monomial(order: int, power: int) -> float:
    """Return the coefficient of y^power in a Legendre polynomial."""
    found = leg2poly([0.0] * order + [1.0])
    return float(found[power]) if power <= order else 0.0
