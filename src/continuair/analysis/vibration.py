"""Roots and shapes of q'' + D q' + K q = 0, with a reproducible choice among equal modes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from continuair.errors import InputError, shown

_EQUAL = 1e-6
"""Relative difference below which roots are equal."""
_COUNTS = 0.1
"""Bends above this fraction of a mode's largest bend are significant; no symmetry makes just this.
"""
_NOTHING = 1e-13
"""Damping ratio, or fraction of the largest squared frequency, that is 0 but for rounding."""


class Vibration(NamedTuple):
    """Modes with stiffness, in order of frequency, then damping.

    frequencies, ratios (modes,): |λ| [rad/s] and -Re λ / |λ| of motions exp(λ t); roots λ (modes,)
    [1/s], of an overdamped mode the slower one; shapes (n, modes), complex.
    """

    frequencies: np.ndarray
    ratios: np.ndarray
    roots: np.ndarray
    shapes: np.ndarray


def vibration(
    stiffness: np.ndarray, damping: np.ndarray, first: np.ndarray, at: np.ndarray
) -> Vibration:
    """Return the vibration of motions q (n,) with q'' = -D q' - K q, the last of which are the
    bends.

    stiffness, damping: K and D (n, n) [1/s², 1/s]. Neither is symmetric in a hover, where the
    constant moment that holds an off-centre arm has no potential. first: of equal modes, that with
    most of the largest of these numbers (bends,) comes first. at: the configuration, for error
    messages. Raises InputError if it buckles, topples or flutters undamped.
    """
    squares, undamped = _undamped(stiffness, at)
    # Some rotations have no stiffness: about a level arm through the centre of mass, or of a
    # leaning arm about the vertical.
    vibrates = squares > 0.0
    slowed = np.linalg.inv(undamped)[vibrates] @ damping @ undamped[:, vibrates]
    frequency, undamped = np.sqrt(squares[vibrates]), undamped[:, vibrates]
    frequencies, ratios, roots = _roots(frequency, slowed)
    shapes = np.empty(undamped.shape, complex)
    for alike in _alike(roots):
        space = undamped @ _motions(roots[alike].mean(), len(alike), frequency, slowed)
        shapes[:, alike] = _apart(np.linalg.qr(space)[0], first)
    return Vibration(frequencies, ratios, roots, shapes)


def real_shapes(shapes: np.ndarray, bends: int) -> np.ndarray:
    """Return real shapes (n, modes) of unit norm at the phase of their largest motion.

    The first significant bend is positive.
    """
    turned = shapes * np.exp(-0.5j * np.angle(np.sum(shapes**2, axis=0)))
    real = turned.real / np.linalg.norm(turned.real, axis=0)
    bend = real[-bends:]
    counts = np.abs(bend) > _COUNTS * np.abs(bend).max(axis=0)
    first = np.take_along_axis(bend, counts.argmax(axis=0)[None], axis=0)
    return np.asarray(real * np.where(first < 0.0, -1.0, 1.0))


def _undamped(stiffness: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the squared frequencies (n,), 0 without stiffness, and their shapes (n, n)."""
    values, vectors = np.linalg.eig(stiffness)
    resisted = np.abs(values) > _NOTHING * np.abs(values).max()
    _check_vibrates(values[resisted], at)
    values, order = np.where(resisted, values.real, 0.0), np.argsort(values.real)
    values, vectors = values[order], vectors.real[:, order]
    for equal in _alike(values):
        # A solver may return nearly parallel vectors for equal values.
        if len(equal) > 1:
            vectors[:, equal] = _nothing_left(
                stiffness - values[equal].mean() * np.eye(len(values)), len(equal)
            )
    return values, vectors


def _roots(frequency: np.ndarray, slowed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frequencies, damping ratios and roots (modes,) of undamped modes with damping
    `slowed`."""
    zero, diagonal = np.zeros(slowed.shape), np.diag(frequency)
    state = np.block([[zero, diagonal], [-diagonal, -slowed]])
    roots, left, right = eig(state, left=True, right=True)
    complex_roots = roots[roots.imag > 0.0]
    real = np.flatnonzero(roots.imag == 0.0)
    real = real[np.argsort(roots[real].real)]
    slower, damping = _slower(roots.real, left.real, right.real, real, slowed)
    # λ² + d λ + ω² = 0, with d and ω² of the root's motion.
    squares = -slower * (slower + damping)
    found = np.concatenate([np.abs(complex_roots), np.sqrt(squares)])
    ratio = np.concatenate(
        [-complex_roots.real / np.abs(complex_roots), damping / (2.0 * np.sqrt(squares))]
    )
    ratio = np.where(np.abs(ratio) > _NOTHING, ratio, 0.0)
    order = np.argsort(found)
    equal = np.cumsum(np.diff(found[order], prepend=0.0) > _EQUAL * found[order])
    order = order[np.lexsort([ratio[order], equal])]
    return found[order], ratio[order], np.concatenate([complex_roots, slower])[order]


def _slower(
    roots: np.ndarray, left: np.ndarray, right: np.ndarray, real: np.ndarray, slowed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the slower half of real roots, and the damping of their motions (modes,) [1/s].

    Slower: the root that approaches 0 as all damping grows; the other root of an overdamped motion
    goes to infinity. real: indices of the real roots, in order; left, right: eigenvectors (2 modes,
    roots).
    """
    n, damping = len(slowed), np.empty(len(real))
    for alike in _alike(roots[real]):
        y, x = left[n:, real[alike]], right[n:, real[alike]]
        # At critical damping both roots, and their motions, are equal.
        found, _, rank, _ = np.linalg.lstsq(y.T @ x, y.T @ slowed @ x, rcond=_EQUAL)
        damping[alike] = np.trace(found) / rank
    # λ² + s d λ + ω² = 0 changes by dλ/ds = -d λ / (2 λ + d).
    nearing = roots[real] + 0.5 * damping
    slower = np.sort(np.argsort(-nearing, kind="stable")[: len(real) // 2])
    return roots[real[slower]], damping[slower]


def _alike(roots: np.ndarray) -> list[np.ndarray]:
    """Return the indices of equal roots, which are neighbours."""
    apart = np.abs(np.diff(roots)) > _EQUAL * np.abs(roots[1:])
    return np.split(np.arange(len(roots)), np.flatnonzero(apart) + 1) if len(roots) else []


def _motions(root: complex, count: int, frequency: np.ndarray, slowed: np.ndarray) -> np.ndarray:
    """Return motions (modes, count) of undamped modes that belong to a root."""
    left = np.diag(root**2 + frequency**2) + root * slowed
    return _nothing_left(left / (np.abs(root) ** 2 + frequency**2)[:, None], count)


def _nothing_left(of: np.ndarray, count: int) -> np.ndarray:
    """Return orthonormal vectors (n, count) of a matrix's smallest singular values."""
    return np.asarray(np.linalg.svd(of)[2][-count:].conj().T)


def _apart(space: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return a reproducible basis of equal modes (n, k), in the order of `first` (bends,).

    A solver leaves the choice to rounding.
    """
    bend = space[-len(first) :]
    return np.asarray(space @ np.linalg.eigh(-bend.conj().T @ (first[:, None] * bend))[1])


def _check_vibrates(squares: np.ndarray, at: np.ndarray) -> None:
    """Raise InputError unless all squares of frequencies are real and above 0."""
    grows = np.abs(squares.imag) > _EQUAL * np.abs(squares)
    if (grows & (squares.real > 0.0)).any():
        rate = np.sqrt(squares[grows]).max()
        raise InputError(
            "q",
            (
                f"is {shown(at)}, where the hovering vehicle flutters at {rate.real:.3g} "
                f"rad/s, growing by {abs(rate.imag):.2g} 1/s"
            ),
            "mount the arm nearer the centre, or add a controller",
        )
    if not (squares.real > 0.0).all():
        raise InputError(
            "q",
            f"is {shown(at)}, where the vehicle buckles or topples",
            (
                "give a configuration near a stable equilibrium: a hanging or stiffer "
                "arm, or less gravity"
            ),
        )
