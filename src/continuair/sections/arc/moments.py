"""Moments of an arc as polynomials in the squared bend, computed on the host.

The dynamics of a section of constant curvature are smooth in u = |k|², because the backbone point
is r(s) = (k A, -B) and the tangent (k B, -C) with A, B, C entire in u. The moments are integrated
over the backbone (Gauss-Legendre) and summed over the disks at Chebyshev nodes of u, and
interpolated. The device evaluates them in one Horner loop, without a singularity at bend 0.

In kernels lengths along the arc are in units of λ = l / (π √2), so that the bend b = k λ is
dimensionless, and w = |b|² - 1 ranges over [-1, 1] up to the full circle |k| l = 2π.
"""

from __future__ import annotations

from functools import cache
from math import factorial
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from continuair.device.types import FULL_LENGTH

MOMENTS = ("alpha", "beta", "P", "Q", "S", "KP", "KQ", "KW", "NP", "ND", "A", "Gamma")
"""Functions of an arc, in the order of device code: ten moments about its base, then A and Gamma at
its tip, which give position and rotation of the tip."""

TERMS = 16
"""Polynomial terms, for an interpolation error below 1e-13 of each moment's range."""

# Derivatives of high order amplify rounding of the samples near the full circle, so the host
# computes in extended precision if the platform has it.
_Fine = np.longdouble

_SAMPLES = TERMS + 4
_QUADRATURE = 40


def length_unit(length: Any) -> Any:
    """Return λ [m]; the bend vector k [1/m] times λ is the dimensionless bend b of kernels."""
    return np.asarray(length) / FULL_LENGTH


@cache
def _nodes() -> np.ndarray:
    angles = (np.arange(_SAMPLES, dtype=_Fine) + _Fine(0.5)) * (4 * np.arctan(_Fine(1.0)))
    return np.cos(angles / _SAMPLES)


@cache
def squared_bends() -> np.ndarray:
    """Return |b|² at the Chebyshev nodes (samples,)."""
    return _Fine(1.0) + _nodes()


@cache
def _interpolation() -> np.ndarray:
    nodes = _nodes()
    orders = np.arange(TERMS)
    to_chebyshev = chebyshev.chebvander(nodes, TERMS - 1).T * 2.0 / _SAMPLES
    to_chebyshev[0] *= 0.5
    to_powers = np.array(
        [np.pad(p := chebyshev.cheb2poly(np.eye(TERMS)[n]), (0, TERMS - len(p))) for n in orders]
    )
    return to_chebyshev.T @ to_powers[:, ::-1]


def interpolate(samples: np.ndarray) -> np.ndarray:
    """Return coefficients of powers of w = |b|² - 1, highest first; samples: on the last axis."""
    return (samples @ _interpolation()).astype(float)


def _stumpff(z: Any) -> tuple[Any, ...]:
    """Return c_0 … c_4, c_m(z) = Σ (-z)^j / (2j + m)!, z >= 0; c₀ = cos √z, c₁ = sin √z / √z."""
    x, far = np.sqrt(z), np.maximum(z, 1.0)
    c0, c1 = np.cos(x), _sinc(x)
    c2 = 0.5 * _sinc(0.5 * x) ** 2
    c3 = np.where(z > 1.0, (1.0 - c1) / far, _series(3, z))
    c4 = np.where(z > 1.0, (0.5 - c2) / far, _series(4, z))
    return c0, c1, c2, c3, c4


def _sinc(x: Any) -> Any:
    return np.sin(x) / np.where(x == 0.0, 1.0, x) + (x == 0.0)


def _series(order: int, z: Any) -> Any:
    """Return c_order by its power series, to full precision for z <= 1."""
    total = 0.0
    for j in reversed(range(12)):
        total = _Fine(1.0) / factorial(2 * j + order) - z * total
    return total


def integrands(s: np.ndarray, u: np.ndarray) -> dict[str, tuple[Any, ...]]:
    """Return the contributions of the cross-section at s to every moment; s and 1/√u in units of λ.

    Each moment has three: per mass, per transverse inertia, and per axial minus transverse inertia.
    Primes are d/du; the derivative of a Stumpff function needs no division:
    c_m' = (m c_{m+2} - c_{m+1}) / 2.
    """
    s, u = np.broadcast_arrays(np.asarray(s, _Fine), u)
    c0, c1, c2, c3, c4 = _stumpff(s**2 * u)
    A, B, C, Γ = s**2 * c2, s * c1, c0, s**3 * c3
    dA, dB = s**4 * (c4 - 0.5 * c3), s**3 * 0.5 * (c3 - c2)
    none = np.zeros_like(A)
    return {
        "alpha": (A, none, none),
        "beta": (B, none, none),
        "P": (A**2, none, -(B**2)),
        "Q": (A * B, none, -B * C),
        "S": (B**2, none, -(C**2)),
        "KP": (A**2, A, -A * C),
        "KQ": (A * B, B, u * A * B),
        "KW": (dA * B - A * dB, 0.5 * Γ, -0.5 * A * B),
        "NP": (A**2, B**2 + u * A**2, u * A**2),
        "ND": (4.0 * (A * dA + u * dA**2 + dB**2), Γ * (s + B) - A**2, -(A**2)),
    }


def _gauss_legendre() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights, refined by Newton steps in extended precision."""
    x = np.polynomial.legendre.leggauss(_QUADRATURE)[0].astype(_Fine)
    for _ in range(2):
        previous: np.ndarray = np.ones_like(x)
        current: np.ndarray = x
        for n in range(2, _QUADRATURE + 1):
            previous, current = current, ((2 * n - 1) * x * current - (n - 1) * previous) / n
        slope = _QUADRATURE * (x * current - previous) / (x**2 - 1.0)
        x = x - current / slope
    return x, 2.0 / ((1.0 - x**2) * slope**2)


@cache
def _uniform_rod() -> dict[str, tuple[Any, ...]]:
    """Return the integrals of the integrands over σ = s / l in [0, 1], for unit density."""
    x, weight = _gauss_legendre()
    s = FULL_LENGTH * 0.5 * (1.0 + x)
    by_density = integrands(s, squared_bends()[:, None])
    integrate = 0.5 * weight
    return {name: tuple(f @ integrate for f in parts) for name, parts in by_density.items()}


@cache
def _end() -> tuple[np.ndarray, np.ndarray]:
    """Return A and Γ at a section's end, in units of λ, the same for every section."""
    s = _Fine(FULL_LENGTH)
    *_, c2, c3, _ = _stumpff(s**2 * squared_bends())
    return interpolate(s**2 * c2), interpolate(s**3 * c3)


def polynomials(length: np.ndarray, backbone: Any, disks: Any) -> np.ndarray:
    """Return coefficients (runs, terms, MOMENTS) of sections: uniform backbones with disks.

    length: (runs,) [m]. backbone: (mass, transverse, axial inertia) of the whole backbone, each
    (runs,) [kg, kg m², kg m²]. disks: (position, mass, transverse, axial) each, of (runs,). Moments
    are about the section's base; powers of w = |b|² - 1, the highest first.
    """
    unit = length_unit(length)[:, None]
    rods = [(*backbone, _uniform_rod())]
    for position, *inertia in disks:
        s = np.asarray(position)[:, None] / unit
        rods.append((*inertia, integrands(s, squared_bends())))
    table = np.empty((len(unit), TERMS, len(MOMENTS)))
    for index, name in enumerate(MOMENTS[:-2]):
        power = 1 if name in ("alpha", "beta") else 2
        value = np.zeros((len(unit), _SAMPLES), _Fine)
        for mass, transverse, axial, by_density in rods:
            per_mass, per_transverse, per_difference = by_density[name]
            value += (
                mass[:, None] * per_mass * unit**power
                + transverse[:, None] * per_transverse
                + (axial - transverse)[:, None] * per_difference
            )
        table[..., index] = interpolate(value)
    table[..., -2], table[..., -1] = _end()
    return table
