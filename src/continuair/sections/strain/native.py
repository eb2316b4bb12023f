"""C++ of a section with a strain field: sums over its nodes, for any kind of numbers.

Loops over nodes and coordinates hold arrays, which device code in Python would copy at each access.
The text is made for given orders, so that every loop has a constant number of turns.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leg2poly

from continuair.vehicle.strain import Orders

_TOOLS = """
    auto zero = q.c[0] - q.c[0];
    typedef decltype(zero) R;
    typedef wp::vec_t<3, R> V;
    struct Axes {{ V x, y, z; }};
    auto dot = [](const V& a, const V& b) {{
        return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2];
    }};
    auto cross = [](const V& a, const V& b) {{
        return V(a.c[1] * b.c[2] - a.c[2] * b.c[1], a.c[2] * b.c[0] - a.c[0] * b.c[2],
                 a.c[0] * b.c[1] - a.c[1] * b.c[0]);
    }};
    auto scaled = [](const R& s, const V& a) {{ return V(s * a.c[0], s * a.c[1], s * a.c[2]); }};
    auto legendre = [&](const R& y, R* of) {{
        R square = y * y;
        of[0] = zero + R(1.0);
        of[1] = y;
        of[2] = R(1.5) * square - R(0.5);
        of[3] = y * (R(2.5) * square - R(1.5));
    }};
    // Quaternions x y z w of the axes, as a power series in y about the middle.
    R powers[{powers}][3], series[{terms}][4];
{of_powers}
    for (int c = 0; c < 3; ++c) series[0][c] = zero;
    series[0][3] = zero + R(1.0);
    for (int k = 0; k + 1 < {terms}; ++k) {{
        R a = zero, b = zero, c = zero, d = zero;
        for (int p = 0; p < {powers}; ++p) {{
            if (p > k) break;
            const R *s = series[k - p], *u = powers[p];
            a += s[3] * u[0] - s[2] * u[1];
            b += s[3] * u[1] + s[2] * u[0];
            c += s[0] * u[1] - s[1] * u[0];
            d -= s[0] * u[0] + s[1] * u[1];
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
        R one = zero + R(1.0), two = R(2.0);
        R xx = two * a[0] * a[0], yy = two * a[1] * a[1], zz = two * a[2] * a[2];
        R xy = two * a[0] * a[1], xz = two * a[0] * a[2], yz = two * a[1] * a[2];
        R wx = two * a[3] * a[0], wy = two * a[3] * a[1], wz = two * a[3] * a[2];
        return Axes{{V(one - yy - zz, xy + wz, xz - wy), V(xy - wz, one - xx - zz, yz + wx),
                     V(xz + wy, yz - wx, one - xx - yy)}};
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
    V w[{m} + 1], v[{m} + 1], alpha[{m} + 1], a[{m} + 1], at[{m}], spent[{m}][{n}];
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        R y = R(2.0) * rows.data[{m} + 1][i] - R(1.0);
        Axes R_ = axes(y);
        normal[i] = R_.z;
        columns(y, R_, c[i]);
        t[i] = scaled(length, advance(R_, c[i]));
        for (int k = {turning}; k < {n}; ++k) c[i][k] = scaled(length, c[i][k]);
    }}
    // Integrals to each node and to the end: of what advances and turns, then of what moves.
    #pragma unroll 1
    for (int i = 0; i <= {m}; ++i) {{
        V sum = scaled(rows.data[i][0], t[0]);
        for (int k = 1; k < {m}; ++k) sum = sum + scaled(rows.data[i][k], t[k]);
        p[i] = sum;
        for (int j = 0; j < {turning}; ++j) {{
            sum = scaled(rows.data[i][0], c[0][j]);
            for (int k = 1; k < {m}; ++k) sum = sum + scaled(rows.data[i][k], c[k][j]);
            W[i][j] = sum;
        }}
    }}
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        for (int j = 0; j < {turning}; ++j) spent[i][j] = cross(W[i][j], t[i]);
        for (int j = {turning}; j < {n}; ++j) spent[i][j] = c[i][j];
    }}
    #pragma unroll 1
    for (int i = 0; i <= {m}; ++i) {{
        V turned = scaled(rates.c[0], W[i][0]), moved = V(zero, zero, zero);
        for (int j = 1; j < {turning}; ++j) turned = turned + scaled(rates.c[j], W[i][j]);
        for (int j = 0; j < {n}; ++j) {{
            V sum = scaled(rows.data[i][0], spent[0][j]);
            for (int k = 1; k < {m}; ++k) sum = sum + scaled(rows.data[i][k], spent[k][j]);
            P[i][j] = sum;
            moved = moved + scaled(rates.c[j], sum);
        }}
        w[i] = turned;
        v[i] = moved;
    }}
    auto integrate = [&](V* to) {{
        #pragma unroll 1
        for (int i = 0; i <= {m}; ++i) {{
            V sum = scaled(rows.data[i][0], at[0]);
            for (int k = 1; k < {m}; ++k) sum = sum + scaled(rows.data[i][k], at[k]);
            to[i] = sum;
        }}
    }};
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        V turn = scaled(rates.c[0], c[i][0]);
        for (int j = 1; j < {turning}; ++j) turn = turn + scaled(rates.c[j], c[i][j]);
        at[i] = cross(w[i], turn);
    }}
    integrate(alpha);
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        V swept = cross(w[i], t[i]);
        for (int j = {turning}; j < {n}; ++j) swept = swept + scaled(R(2.0) * rates.c[j], c[i][j]);
        at[i] = cross(alpha[i], t[i]) + cross(w[i], swept);
    }}
    integrate(a);
    // Sums over the bodies at the nodes.
    const R half = R(0.5);
    V none(zero, zero, zero), H = none, f0 = none, n0 = none, F[{n}], L[{n}], across[{n}];
    R I[6], E[3][3], N[{n}][{n}], b0[{n}], S[{n}][6], trace = zero;
    for (int k = 0; k < 6; ++k) I[k] = zero;
    for (int k = 0; k < 9; ++k) E[k / 3][k % 3] = zero;
    for (int j = 0; j < {n}; ++j) {{
        F[j] = L[j] = across[j] = none;
        b0[j] = zero;
        for (int k = 0; k < 6; ++k) S[j][k] = zero;
        for (int k = 0; k < {n}; ++k) N[j][k] = zero;
    }}
    #pragma unroll 1
    for (int i = 0; i < {m}; ++i) {{
        const R mass = rows.data[{m} + 2][i], aside = rows.data[{m} + 3][i];
        const R along = rows.data[{m} + 4][i] - aside;
        const V z = normal[i], r = p[i], turned = w[i], moved = v[i];
        const V mr = scaled(mass, r), jz = scaled(along, z);
        const R rr = dot(mr, r), zt = dot(z, turned);
        const V tz = cross(turned, z);
        H = H + mr;
        trace += aside + rr;
        I[0] += jz.c[0] * z.c[0] - mr.c[0] * r.c[0]; I[1] += jz.c[0] * z.c[1] - mr.c[0] * r.c[1];
        I[2] += jz.c[0] * z.c[2] - mr.c[0] * r.c[2]; I[3] += jz.c[1] * z.c[1] - mr.c[1] * r.c[1];
        I[4] += jz.c[1] * z.c[2] - mr.c[1] * r.c[2]; I[5] += jz.c[2] * z.c[2] - mr.c[2] * r.c[2];
        const V force = scaled(mass, a[i]);
        const V moment = scaled(aside, alpha[i]) + scaled(dot(jz, alpha[i]), z)
            + scaled(along * zt, tz);
        f0 = f0 + force;
        n0 = n0 + cross(r, force) + moment;
        // The part linear in x = v + share w of the moment, r×m(x×v) and the turning of the slice.
        const R mrv = dot(mr, moved), at_ = half * aside;
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j)
                E[k][j] += half * (tz.c[k] * jz.c[j] + jz.c[k] * tz.c[j]) - moved.c[k] * mr.c[j];
        for (int k = 0; k < 3; ++k) E[k][k] += mrv;
        const V turn = scaled(at_, turned) + scaled(half * zt, jz);
        E[0][1] += turn.c[2]; E[1][0] -= turn.c[2]; E[0][2] -= turn.c[1];
        E[2][0] += turn.c[1]; E[1][2] += turn.c[0]; E[2][1] -= turn.c[0];
        for (int j = 0; j < {n}; ++j) {{
            const V& Pj = P[i][j];
            const V mP = scaled(mass, Pj);
            V about = cross(r, mP), lever = cross(moved, mP);
            R pushed = dot(Pj, force);
            R* s = S[j];
            const R mPr = dot(mP, r);
            s[0] += mP.c[0] * r.c[0] - mPr;
            s[3] += mP.c[1] * r.c[1] - mPr;
            s[5] += mP.c[2] * r.c[2] - mPr;
            s[1] += half * (mP.c[0] * r.c[1] + mP.c[1] * r.c[0]);
            s[2] += half * (mP.c[0] * r.c[2] + mP.c[2] * r.c[0]);
            s[4] += half * (mP.c[1] * r.c[2] + mP.c[2] * r.c[1]);
            F[j] = F[j] + mP;
            for (int k = 0; k <= j; ++k) N[k][j] += dot(P[i][k], mP);
            if (j < {turning}) {{
                const V& Wj = W[i][j];
                const V spin = scaled(aside, Wj) + scaled(dot(jz, Wj), z), u = cross(z, Wj);
                const V ju = scaled(along, u);
                about = about + spin;
                pushed += dot(Wj, moment);
                for (int k = 0; k <= j; ++k) N[k][j] += dot(W[i][k], spin);
                lever = lever + scaled(half, cross(turned, spin))
                    + scaled(half * dot(tz, Wj), jz) + scaled(half * zt, ju);
                s[0] += ju.c[0] * z.c[0]; s[3] += ju.c[1] * z.c[1]; s[5] += ju.c[2] * z.c[2];
                s[1] += half * (ju.c[0] * z.c[1] + ju.c[1] * z.c[0]);
                s[2] += half * (ju.c[0] * z.c[2] + ju.c[2] * z.c[0]);
                s[4] += half * (ju.c[1] * z.c[2] + ju.c[2] * z.c[1]);
            }}
            L[j] = L[j] + about;
            b0[j] += pushed;
            across[j] = across[j] + lever;
        }}
    }}
    out.H = H;
    out.I = wp::mat_t<3, 3, R>(I[0] + trace, I[1], I[2], I[1], I[3] + trace, I[4], I[2], I[4],
                               I[5] + trace);
    for (int k = 0; k < 3; ++k) for (int j = 0; j < 3; ++j) out.exchange.data[k][j] = E[k][j];
    out.force = f0;
    out.moment = n0;
    for (int j = 0; j < {n}; ++j) {{
        for (int k = 0; k < 3; ++k) {{
            out.F.data[k][j] = F[j].c[k];
            out.L.data[k][j] = L[j].c[k];
            out.across.data[k][j] = across[j].c[k];
            out.P.data[k][j] = P[{m}][j].c[k];
            out.W.data[k][j] = zero;
        }}
        for (int k = 0; k < 6; ++k) out.centrifugal.data[k][j] = S[j][k];
        out.coordinates.c[j] = b0[j];
        for (int k = 0; k <= j; ++k) out.N.data[k][j] = out.N.data[j][k] = N[k][j];
    }}
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
    V t[{m}], c[{m}][{n}], none(zero, zero, zero), end = none;
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

    Its arguments: out, the sums; rows, the section's table; q and rates, its coordinates.
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
