"""The one automatic step: of the fastest rate of a vehicle and its start."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError
from continuair.flight.inputs import told_rate
from continuair.flight.loaded_rates import drag_rate, linear_drag_rate, pull_rate, term_rate
from continuair.flight.resolution import UNSEEN, in_runs
from continuair.kernels.integrators import INTEGRATORS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import FIELDS, GENERAL
from continuair.vehicle.runs import per_run
from continuair.warning import warn

Array = np.ndarray

# Configurations whose bends are pushed at once: bounds the memory of large batches.
_AT_ONCE = 1024

LOOP_STEP = 1e-4
"""Largest automatic step of control at every stage: the loop may be faster than the arm [s]."""


def bend_compliance(engine: Engine, q: Any) -> np.ndarray:
    """Bend block of M⁻¹, (runs, bends, bends) [1/(kg m⁴)], at rest in the configurations q.

    It is the acceleration of the bend under a unit bend moment: for an engine of `coupled` on the
    free base, for one of `independent` on a clamped one.
    """
    return _compliance(engine, np.atleast_2d(q)[None])[0]


def fastest_frequency(engine: Engine, q: Any) -> np.ndarray:
    """ω_max (runs,) [rad/s] from the pencil (K, M) at q: the largest √eig([M⁻¹]_bend K)."""
    stiffness, _ = _of_bends(engine)
    return np.sqrt(_largest(_symmetric(bend_compliance(engine, q), stiffness)))


def fastest_rate(engine: Engine, q: Any) -> np.ndarray:
    """Largest |λ| (runs,) [1/s] of the bends at q with their damping, base free or clamped.

    With one section |λ| is ω of its stiffest mode, λ² + 2 γ λ + ω² = 0, while that oscillates, and
    the decay γ + √(γ² - ω²) when it is overdamped. q: of the runs, or (configurations, runs,
    coordinates): then it is the largest of all configurations of a run.
    """
    q = np.atleast_2d(q)
    compliance = _compliance(engine, q.reshape(-1, *q.shape[-2:]))
    stiffness, damping = _of_bends(engine)
    rates = _fastest(_symmetric(compliance, stiffness), damping / stiffness)
    largest: np.ndarray = np.fmax.reduce(rates)
    return largest


def first_frequency(engine: Engine, q: Any) -> np.ndarray:
    """ω (runs,) [rad/s] of the first mode of every arm, undamped, the fastest of the arms' and in
    the faster plane; q as for `fastest_rate`."""
    q = np.atleast_2d(q)
    compliance = _compliance(engine, q.reshape(-1, *q.shape[-2:]))
    squares, found = _symmetric(compliance, _of_bends(engine)[0]), []
    for of_arm in engine.layout.of_arm:
        found.append(_eigenvalues(squares[..., of_arm, of_arm])[..., 1])
    largest: np.ndarray = np.fmax.reduce(np.sqrt(np.max(found, axis=0)))
    return largest


def _fastest(squares: Array, share: Array) -> Array:
    """Largest |λ| (..., runs) of bends, by √K [M⁻¹] √K (..., runs, bends, bends).

    share: D over K of each bend (runs or 1, bends).
    """
    if not (share == share[:, :1]).all():
        return _largest_of_pencil(squares, share)
    # Damping in proportion to stiffness leaves the modes apart.
    largest = _largest(squares)
    decay, frequency = 0.5 * share[:, 0] * largest, np.sqrt(largest)
    over = np.sqrt(np.maximum(decay**2 - frequency**2, 0.0))
    return np.where(decay > frequency, decay + over, frequency)


def _largest_of_pencil(squares: Array, share: Array) -> Array:
    """Largest |λ| of λ² + S diag(share) λ + S, with S (..., bends, bends)."""
    n = squares.shape[-1]
    known = np.isfinite(squares).all((-1, -2))
    filled = np.where(known[..., None, None], squares, 0.0)
    companion = np.zeros((*squares.shape[:-2], 2 * n, 2 * n))
    companion[..., :n, n:] = np.eye(n)
    companion[..., n:, :n] = -filled
    companion[..., n:, n:] = -filled * share[:, None, :]
    found = np.abs(np.linalg.eigvals(companion)).max(axis=-1)
    return np.asarray(np.where(known, found, np.nan))


def _of_bends(engine: Engine) -> tuple[Array, Array]:
    """E I l and d l (runs or 1, bends) [N m³, N m³ s] of each bend."""
    runs = len(engine.plants)
    sections = [section for arm in engine.vehicle.arms for section in arm.section]
    stiffness, damping = (
        np.stack(
            [per_run(getattr(each, name), runs) * per_run(each.length, runs) for each in sections],
            axis=-1,
        ).repeat(2, axis=1)
        for name in ("bending_stiffness", "structural_damping")
    )
    return stiffness, damping


def _symmetric(compliance: Array, stiffness: Array) -> Array:
    """√K [M⁻¹]_bend √K (..., bends, bends) [1/s²], symmetric; its eigenvalues are ω²."""
    root = np.sqrt(stiffness)
    found: Array = root[:, :, None] * compliance * root[:, None, :]
    return 0.5 * (found + found.swapaxes(-1, -2))


def _compliance(engine: Engine, q: Array) -> Array:
    """Bend blocks (configurations, runs, bends, bends) of `bend_compliance`.

    q: (configurations, runs or 1, coordinates).
    """
    flat, plants = q.reshape(-1, q.shape[-1]), len(engine.plants)
    states, angles = state_from_paper(flat, np.zeros(flat.shape)), branches_of(flat)
    runs = max(q.shape[1], plants)
    states, angles = (
        np.broadcast_to(each.reshape(*q.shape[:-1], -1), (len(q), runs, each.shape[-1]))
        for each in (states, angles)
    )
    blocks = [slice(first, first + _AT_ONCE) for first in range(0, runs, _AT_ONCE)]
    return np.concatenate(
        [_pushed(engine, states[:, at], angles[:, at], np.arange(runs)[at]) for at in blocks],
        axis=1,
    )


def _pushed(engine: Engine, states: Array, angles: Array, runs: Array) -> Array:
    """`_compliance` of some runs, all in one launch, which costs more than few runs do.

    states: (configurations, runs, state); angles: what names their branches.
    """
    layout, shape = engine.layout, angles.shape[:2]
    pushes = np.vstack([np.zeros(layout.bends), np.eye(layout.bends)])
    # Unit moments would be lost in the rounding of what a bent arm of large stiffness does.
    size, _ = _of_bends(engine)
    size = size[np.minimum(runs, len(size) - 1)]
    inputs = np.zeros((len(pushes), *shape, layout.inputs))
    inputs[..., layout.bend_moment] = pushes[:, None, None] * size
    many = len(pushes) * shape[0] * shape[1]
    start = Start(
        *(
            np.broadcast_to(each, (len(pushes), *each.shape)).reshape(many, -1)
            for each in (states, angles)
        )
    )
    acting = Drive(inputs.reshape(1, many, -1), False, GENERAL, 0.0)
    rates = engine.derivative(start, acting, np.resize(runs, many))[:, layout.bend_rate]
    still, *pushed = rates.reshape(len(pushes), *shape, layout.bends)
    return np.stack([rate - still for rate in pushed], axis=-1) / size[:, None]


def _largest(squares: Array) -> Array:
    """The largest eigenvalue (...) of each; NaN for a configuration past a full circle."""
    return _eigenvalues(squares)[..., -1]


def _eigenvalues(squares: Array) -> Array:
    """Eigenvalues (..., bends) ascending; NaN for a configuration past a full circle."""
    known = np.isfinite(squares).all((-1, -2))
    filled = np.where(known[..., None, None], squares, 0.0)
    return np.asarray(np.where(known[..., None], np.linalg.eigvalsh(filled), np.nan))


def declared_rate(scenario: Scenario) -> Any:
    """Fastest rate (runs or 1) [rad/s] of inputs that tell theirs, by an attribute `fastest`."""
    told = [told_rate(getattr(scenario, field)) for field in FIELDS]
    rates = [0.0, *(rate for rate in told if rate is not None)]
    return np.max(np.broadcast_arrays(*rates), axis=0)


_IN_WASH = 0.5
"""Of the automatic step, where an arm may cross the edge of a rotor's wash."""


def automatic_step(
    coupled: Engine,
    q: Any,
    qd: Any = None,
    driven: Any = 0.0,
    method: str = "RK4",
    wind: Any = 0.0,
    pull: Any = 0.0,
) -> Array:
    """Step (runs,) [s] of which the fastest rate of a run makes at most 0.2.

    That rate is `driven`, of its inputs, or the spin |ω| at the start, plus what is fastest seen
    from the turning body: the stiffest mode (straight or at the initial bend, with its damping), a
    tip's turning Σ |k̇| l, the decay by drag, in a wind (runs or 1) [m/s], the frequency that
    forces on the tips make, pull (runs or 1, arms) [N], or what a user's own terms make.
    coupled: an engine of the coupled model, whose free base raises the rates most. Arms that hang
    in a wash take half that step.
    q, qd: (runs or 1, 8) paper coordinates and rates, at rest by default. A run that has no finite
    rate, as a bend past a full circle has none, has the step inf. The method "implicit" has
    0.05 for 0.2, and of the modes the first of every arm, without what drag and pulls do to them:
    faster ones do not make it unstable. Raises InputError if no run has a finite rate.
    """
    q = np.atleast_2d(q)
    qd = np.zeros_like(q) if qd is None else np.atleast_2d(qd)
    straight = np.array(q)
    straight[:, 6::2] = 0.0
    taken = INTEGRATORS[method]
    rate_of = first_frequency if taken.stiff else fastest_rate
    modes = rate_of(coupled, np.stack([straight, q]))
    if not np.isfinite(modes).any():
        raise InputError(
            "vehicle has no finite bending frequency: its arm is too heavy or too "
            "soft beside its UAV; check arm.length, arm.radius and uav.mass."
        )
    q, qd = np.broadcast_arrays(q, qd)
    layout = coupled.layout
    # Rates near the largest number there is make the step 0, which the time grid refuses.
    with np.errstate(over="ignore", divide="ignore"):
        state = state_from_paper(q, qd)
        spin = np.linalg.norm(state[:, layout.angular_velocity], axis=1)
        turning = _turning_of_tips(coupled, state)
        if taken.stiff:
            loaded = linear_drag_rate(coupled)
        else:
            moves = np.linalg.norm(state[:, layout.velocity], axis=1)
            moves = moves + coupled.vehicle.reach * (spin + turning)
            loaded = _loaded_rate(coupled, q, wind + moves, np.atleast_2d(pull), len(modes))
            loaded = np.fmax(loaded, term_rate(coupled, state, branches_of(q)))
        seen = np.fmax.reduce(np.broadcast_arrays(modes, turning, loaded))
        step = taken.phase / np.fmax(seen + spin, driven)
    if coupled.tree.stirred:
        step = _IN_WASH * step
    found: Array = np.where(np.isnan(step), np.inf, step)
    return found


def _loaded_rate(engine: Engine, q: Array, flow: Array, pull: Array, runs: int) -> Array:
    """The faster (runs,) [1/s] of what drag in a flow (runs or 1,) [m/s] and pulls on the tips
    (runs or 1, arms) [N] make."""
    runs = max(runs, len(q), len(flow), len(pull))
    drag = drag_rate(engine, q, np.broadcast_to(flow, runs))
    pulled = pull_rate(engine, q, np.broadcast_to(pull, (runs, pull.shape[1])))
    return np.asarray(np.fmax(drag, pulled))


def _turning_of_tips(engine: Engine, state: Array) -> Array:
    """The fastest turning (runs,) [rad/s] that the rates of a state's bends give a tip."""
    rates = np.linalg.norm(state[:, engine.layout.bend_rate].reshape(len(state), -1, 2), axis=2)
    found, first = [], 0
    for arm in engine.vehicle.arms:
        of_sections = (each.length * rates[:, first + i] for i, each in enumerate(arm.section))
        found.append(sum(of_sections, np.zeros(len(state))))
        first += len(arm.section)
    return np.asarray(np.max(np.broadcast_arrays(*found), axis=0))


def steps_of(
    scenario: Scenario, asked: Array | None, fine: Array, sample: float, warn: int | None
) -> Array:
    """The step (runs,) [s] that each run of a flight takes.

    asked: the user's steps (runs or 1,), or None for the automatic ones: `fine`, which vehicle and
    start allow, at most `sample`; in a closed loop a whole part of the control period. warn: frames
    up to which to warn of a step that is longer than `fine`, or None. Raises InputError.
    """
    period = scenario.period
    if asked is not None:
        if period is not None:
            check_divides(period, asked, _period_name(scenario))
        if warn is not None:
            _warn_if_coarse(asked, fine, warn + 1)
        return np.broadcast_to(asked, len(fine))
    finest = np.minimum(fine, sample)
    if scenario.controller is None:
        return finest
    if period is None:
        return np.minimum(finest, LOOP_STEP)
    return np.asarray(period / np.ceil(period / finest * (1.0 - 1e-12)))


def warn_of_fast_inputs(steps: Array, rates: Array, stacklevel: int) -> None:
    """Warn of steps (runs,) [s] that miss what an input that tells its rate (runs,) [1/s], or the
    lag of rotors, does: of no method do they follow it."""
    missed = rates * steps > UNSEEN
    if missed.any():
        of = in_runs(missed.sum(), len(steps))
        warn(
            f"step is {steps[missed].max():g} s, in which inputs or rotors change by more than it "
            f"follows{of}; use {UNSEEN / rates.max():.3g} s or less, or step='auto'.",
            stacklevel=stacklevel,
        )


def _period_name(scenario: Scenario) -> str:
    own = scenario.controller is not None and scenario.controller.period is not None
    return "the period of the controller's rate" if own else "control_period"


def check_divides(period: float, steps: Array, name: str = "control_period") -> None:
    """Raise InputError unless a control period is a multiple of every step (n,), all [s]."""
    parts = period / steps
    wrong = (np.round(parts) < 1) | (np.abs(parts - np.round(parts)) > 1e-6)
    if wrong.any():
        raise InputError(
            f"{name} is {period:g} s, which is not a multiple of the step, "
            f"{steps[wrong][0]:g} s; give one that is, or step='auto'."
        )


def _warn_if_coarse(steps: Array, fine: Array, stacklevel: int) -> None:
    coarse = steps > fine * (1.0 + 1e-9)
    if coarse.any():
        of = in_runs(coarse.sum(), len(fine))
        warn(
            f"step is {steps.max():g} s, which is too coarse for the fastest motion of vehicle and "
            f"start (stiffest bending mode, its damping, drag, initial rates){of}: RK4 will distort"
            f" it; use {fine.min():.3g} s or less, or step='auto'.",
            stacklevel=stacklevel,
        )
