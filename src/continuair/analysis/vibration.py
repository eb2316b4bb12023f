"""Vibration: the roots and shapes of q'' + D q' + K q = 0, those alike told apart the same way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from continuair.errors import InputError, shown
from continuair.vehicle.arc import bend_vectors

_EQUAL = 1e-6
"""Roots that differ by less than this share are those of modes alike."""
_COUNTS = 0.1
"""A bend of a mode counts from this share of its largest; no symmetry makes just this share."""
_NOTHING = 1e-13
"""A damping ratio, or share of the largest square of a frequency, that is 0 but for rounding."""


class Vibration(NamedTuple):
    """Modes that something resists, by frequency, and of one frequency by damping.

    frequencies, ratios (modes,): |λ| [rad/s] and -Re λ / |λ| of a swing that decays as exp(λ t);
    roots λ (modes,) [1/s], of a mode that creeps back the slower one; shapes (n, modes), complex.
    """

    frequencies: np.ndarray
    ratios: np.ndarray
    roots: np.ndarray
    shapes: np.ndarray


def vibration(stiffness: np.ndarray, damping: np.ndarray, bends: int, at: np.ndarray) -> Vibration:
    """How motions q (n,) vibrate of which q'' = -D q' - K q; the last of them are the bends.

    stiffness, damping: K and D (n, n) [1/s², 1/s], neither of which is symmetric in a hover, where
    the constant moment that holds an arm off the centre has no potential; at: the configuration,
    for the words of an error. Raises InputError where it buckles, topples or flutters undamped.
    """
    squares, undamped = _undamped(stiffness, at)
    # Nothing resists, of some vehicles, a turn about a level arm through the centre of mass, or of
    # an upright arm that leans over about the vertical.
    vibrates = squares > 0.0
    slowed = np.linalg.inv(undamped)[vibrates] @ damping @ undamped[:, vibrates]
    frequency, undamped = np.sqrt(squares[vibrates]), undamped[:, vibrates]
    frequencies, ratios, roots = _roots(frequency, slowed)
    shapes = np.empty(undamped.shape, complex)
    for alike in _alike(roots):
        space = undamped @ _motions(roots[alike].mean(), len(alike), frequency, slowed)
        shapes[:, alike] = _apart(np.linalg.qr(space)[0], bends)
    return Vibration(frequencies, ratios, roots, shapes)


def real_shapes(shapes: np.ndarray, bends: int) -> np.ndarray:
    """Shapes (n, modes) of unit norm at the phase of a swing where they are largest, the first
    bend that counts positive."""
    turned = shapes * np.exp(-0.5j * np.angle(np.sum(shapes**2, axis=0)))
    real = turned.real / np.linalg.norm(turned.real, axis=0)
    bend = real[-bends:]
    counts = np.abs(bend) > _COUNTS * np.abs(bend).max(axis=0)
    first = np.take_along_axis(bend, counts.argmax(axis=0)[None], axis=0)
    return np.asarray(real * np.where(first < 0.0, -1.0, 1.0))


def _undamped(stiffness: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squares of frequencies (n,), 0 where nothing resists, and their shapes (n, n)."""
    values, vectors = np.linalg.eig(stiffness)
    resisted = np.abs(values) > _NOTHING * np.abs(values).max()
    _check_vibrates(values[resisted], at)
    values, order = np.where(resisted, values.real, 0.0), np.argsort(values.real)
    values, vectors = values[order], vectors.real[:, order]
    for equal in _alike(values):
        # A solver may leave vectors of equal values almost parallel.
        if len(equal) > 1:
            vectors[:, equal] = _nothing_left(
                stiffness - values[equal].mean() * np.eye(len(values)), len(equal)
            )
    return values, vectors


def _roots(frequency: np.ndarray, slowed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies, damping ratios and roots (modes,) of undamped modes slowed by (modes, modes)."""
    still, swing = np.zeros(slowed.shape), np.diag(frequency)
    state = np.block([[still, swing], [-swing, -slowed]])
    roots, left, right = eig(state, left=True, right=True)
    swings = roots[roots.imag > 0.0]
    creeps = np.flatnonzero(roots.imag == 0.0)
    creeps = creeps[np.argsort(roots[creeps].real)]
    slower, damping = _slower(roots.real, left.real, right.real, creeps, slowed)
    # λ² + d λ + ω² = 0, with d and ω² of the root's own motion.
    squares = -slower * (slower + damping)
    found = np.concatenate([np.abs(swings), np.sqrt(squares)])
    ratio = np.concatenate([-swings.real / np.abs(swings), damping / (2.0 * np.sqrt(squares))])
    ratio = np.where(np.abs(ratio) > _NOTHING, ratio, 0.0)
    order = np.argsort(found)
    equal = np.cumsum(np.diff(found[order], prepend=0.0) > _EQUAL * found[order])
    order = order[np.lexsort([ratio[order], equal])]
    return found[order], ratio[order], np.concatenate([swings, slower])[order]


def _slower(
    roots: np.ndarray, left: np.ndarray, right: np.ndarray, creeps: np.ndarray, slowed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The half of some real roots that comes nearer to 0 as all damping grows, and the damping of
    their motions (modes,) [1/s].

    creeps: places of the real ones among all roots, in order; left, right: eigenvectors (2 modes,
    roots). What creeps back has two roots, of which the other one goes to infinity.
    """
    n, damping = len(slowed), np.empty(len(creeps))
    for alike in _alike(roots[creeps]):
        y, x = left[n:, creeps[alike]], right[n:, creeps[alike]]
        # At critical damping both roots are alike, and their motion is one.
        found, _, rank, _ = np.linalg.lstsq(y.T @ x, y.T @ slowed @ x, rcond=_EQUAL)
        damping[alike] = np.trace(found) / rank
    # λ² + s d λ + ω² = 0 turns by dλ/ds = -d λ / (2 λ + d).
    nearing = roots[creeps] + 0.5 * damping
    slower = np.sort(np.argsort(-nearing, kind="stable")[: len(creeps) // 2])
    return roots[creeps[slower]], damping[slower]


def _alike(roots: np.ndarray) -> list[np.ndarray]:
    """Places of equal roots, which stand side by side."""
    apart = np.abs(np.diff(roots)) > _EQUAL * np.abs(roots[1:])
    return np.split(np.arange(len(roots)), np.flatnonzero(apart) + 1) if len(roots) else []


def _motions(root: complex, count: int, frequency: np.ndarray, slowed: np.ndarray) -> np.ndarray:
    """Motions (modes, count), of undamped modes, that swing and decay by a root alike."""
    left = np.diag(root**2 + frequency**2) + root * slowed
    return _nothing_left(left / (np.abs(root) ** 2 + frequency**2)[:, None], count)


def _nothing_left(of: np.ndarray, count: int) -> np.ndarray:
    """Orthonormal vectors (n, count) of which a matrix leaves least."""
    return np.asarray(np.linalg.svd(of)[2][-count:].conj().T)


def _apart(space: np.ndarray, bends: int) -> np.ndarray:
    """Of motions alike (n, k), orthonormal, those most along x first, and of the first sections:
    a solver leaves the choice to rounding."""
    later = np.arange(len(bend_vectors(np.zeros(bends)))) / bends
    most = np.stack([2.0 - later, 1.0 - later], axis=1).ravel()
    bend = space[-bends:]
    return np.asarray(space @ np.linalg.eigh(-bend.conj().T @ (most[:, None] * bend))[1])


def _check_vibrates(squares: np.ndarray, at: np.ndarray) -> None:
    """Raise InputError unless all squares of frequencies are real and above 0."""
    grows = np.abs(squares.imag) > _EQUAL * np.abs(squares)
    if (grows & (squares.real > 0.0)).any():
        rate = np.sqrt(squares[grows]).max()
        raise InputError(
            f"q is {shown(at)}, about which the hovering vehicle flutters: it swings at "
            f"{rate.real:.3g} rad/s, wider by {abs(rate.imag):.2g} 1/s, as the moment that holds "
            "it is constant; mount the arm nearer the centre, or fly it with a controller."
        )
    if not (squares.real > 0.0).all():
        raise InputError(
            f"q is {shown(at)}, about which the vehicle does not vibrate but buckles or topples; "
            "give a configuration near a stable balance (a hanging arm, less gravity or a stiffer "
            "arm)."
        )
