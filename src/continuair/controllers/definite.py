"""Device code that solves six equations with a symmetric positive definite matrix, as laws need."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.sensing.sense import LawCode

_UNDETERMINED = 1e-11
"""Share that is negligible even for small, far targets."""


@dataclass(frozen=True)
class Definite:
    """Matrix, (6, 6); determined(LᵀL); factored(A), its LDLᵀ; solved(factors, b), A⁻¹ b."""

    Matrix: Any
    determined: Any
    factored: Any
    solved: Any


def definite_code(code: LawCode) -> Definite:
    """Return the functions for the numbers of a law."""
    return _definite(code.Real, code.Twist, code.above)


@cache
def _definite(Real: Any, Twist: Any, above: Any) -> Definite:
    Matrix = wp.types.matrix((6, 6), Real)

    zero, one, share = Real(0.0), Real(1.0), Real(1.0 + _UNDETERMINED)

    @wp.func
    def determined(A: Matrix):
        """LᵀL with a slightly larger diagonal: motion that no point shows is not commanded."""
        for i in range(6):
            A[i, i] = above(A[i, i], zero, share * A[i, i], one)
        return A

    @wp.func
    def factored(A: Matrix):
        """D on the diagonal, and L, whose own diagonal is 1, below it."""
        for j in range(6):
            d = A[j, j]
            for k in range(j):
                d -= A[j, k] * A[j, k] * A[k, k]
            A[j, j] = d
            for i in range(j + 1, 6):
                s = A[i, j]
                for k in range(j):
                    s -= A[i, k] * A[j, k] * A[k, k]
                A[i, j] = s / d
        return A

    @wp.func
    def solved(A: Matrix, b: Twist):
        x = Twist()
        for i in range(6):
            s = b[i]
            for k in range(i):
                s -= A[i, k] * x[k]
            x[i] = s
        for r in range(6):
            i = 5 - r
            s = x[i] / A[i, i]
            for k in range(i + 1, 6):
                s -= A[k, i] * x[k]
            x[i] = s
        return x

    return Definite(Matrix, determined, factored, solved)
