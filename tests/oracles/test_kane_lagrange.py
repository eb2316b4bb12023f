"""Kane's biases with many digits against Christoffel symbols, with and without their blocks."""

from typing import Any

import pytest
from mpmath import mp, mpf

from tests.oracles.kane import DIGITS, equations, mass_matrix, solved, speeds
from tests.oracles.kane_algebra import Matrix, Vector, apply, exact, largest_gap
from tests.oracles.kane_body import Configuration, Piece, configuration, moved, pieces, poses
from tests.oracles.kane_motion import differences, inertia_in_world, rate
from tests.oracles.make_kane_cases import MODELS, held

SLICES = 2
"""Per section: the equations agree whatever the vehicle consists of."""
STEP = "1e-13"


@pytest.mark.long
@pytest.mark.parametrize("name", ["1+1: bent, all at once", "2: far bent, all at once"])
def test_kanes_equations_are_lagranges(name: str) -> None:
    """In coordinates that are 0 here, where their accelerations are Kane's; reached: 1e-22.

    The decoupled model zeroes the blocks of M and of the Christoffel matrix C itself.
    """
    case = held()[name]
    case = {part: exact(case[part]) for part in ("vehicle", "state", "inputs")}
    with mp.workdps(DIGITS):
        kane = equations(case["vehicle"], case["state"], case["inputs"], nodes=SLICES)
        at, u = configuration(case["vehicle"], case["state"]), speeds(case["state"])
        body = pieces(case["vehicle"], SLICES)
        M = mass_at(body, case["vehicle"], at, [mpf(0)] * len(u))
        C = christoffel_matrix(body, case["vehicle"], at, u)
        for model in MODELS:
            if model == "decoupled":
                M, C = without_blocks(M), without_blocks(C)
            left = [f - b for f, b in zip(kane.force, apply(C, u), strict=True)]
            found = list(mp.lu_solve(mp.matrix(M), mp.matrix(left)))
            assert largest_gap(solved(kane, model), found) < 1e-19


def without_blocks(X: Matrix) -> Matrix:
    """Zero between the six rows of the UAV and those of the bends."""
    n = range(len(X))
    return [[X[i][j] if (i < 6) == (j < 6) else mpf(0) for j in n] for i in n]


def christoffel_matrix(body: list[Piece], vehicle: Any, at: Configuration, u: Vector) -> Matrix:
    """C_ij = Σ ½ (∂_k M_ij + ∂_j M_ik - ∂_i M_jk) u_k. The position changes no mass."""
    n, h = len(u), mpf(STEP)
    zero = [[mpf(0)] * n for _ in range(n)]
    slopes = [zero, zero, zero]
    for j in range(3, n):
        before, after = (
            mass_at(body, vehicle, at, [s * (i == j) for i in range(n)]) for s in (-h, h)
        )
        slopes.append([rate(*rows, h) for rows in zip(before, after, strict=True)])
    return [
        [
            sum((slopes[k][i][j] + slopes[j][i][k] - slopes[i][j][k]) * u[k] for k in range(n)) / 2
            for j in range(n)
        ]
        for i in range(n)
    ]


def mass_at(body: list[Piece], vehicle: Any, at: Configuration, q: Vector) -> Matrix:
    """M of the coordinates q, a way, a rotation vector and changes of bends, from `at` on."""
    h, sides = mpf(STEP), []
    for j in range(len(q)):
        ends = ([x + s * (i == j) for i, x in enumerate(q)] for s in (-h, h))
        sides.append([poses(body, vehicle, moved(at, end, mpf(1))) for end in ends])
    here = poses(body, vehicle, moved(at, q, mpf(1)))
    inertias = [inertia_in_world(piece, axes) for piece, (_, axes) in zip(body, here, strict=True)]
    return mass_matrix(body, inertias, differences(here, sides, h))
