"""Device code of the linearly implicit step, which no stiff mode of the arms makes shorter."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.kernels.dynamics import Dynamics, dynamics_code
from continuair.kernels.flight import flight_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.resolution import resolution_code
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.types import Tree, device_types, holding

GAMMA = 1.0 - np.sqrt(0.5)
"""With it a mode that is far too fast for the step is gone after it."""

IMPLICIT_PHASE = 0.05
"""Largest product of an automatic step and the fastest rate that it resolves, not the stiffest."""

IMPLICIT_MEASURED_EVERY = 8
"""One step of so many is measured, for all of them: it takes three times as long as another."""


@dataclass(frozen=True)
class Stage:
    """stage_of(y, along, flight, row, push, before, h): k₁ of a step of length h, or k₂ + 2 k₁."""

    stage_of: Any


@cache
def stage_code(numbers: Numbers, tree: Tree, model: str) -> Stage:
    """The stages of ROS2, a W-method (Verwer, Spee, Blom, Hundsdorfer 1999).

    With J, any approximation of the Jacobian of f, a step is of second order:

        (1 - γ h J) k₁ = f(y)        (1 - γ h J) k₂ = f(y + h k₁) - 2 k₁
        y + h (3 k₁ + k₂) / 2        = y + h (k₁ + k) / 2, with k = k₂ + 2 k₁

    J here is what springs K and dampers D of the bends do to all accelerations: -M⁻¹ (K b + D ḃ).
    The rows of k then are the rows of the dynamics (kernels/dynamics.py) with γ h (D + γ h K) more
    inertia of each bend, and a push on it.
    """
    types, dynamics = device_types(numbers, tree), dynamics_code(numbers, tree, model)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Bends = flight_code(numbers, tree).Flight, types.Bends
    bends_of, bend_rates_of = types.bends_of, types.bend_rates_of
    load_of, total_of = dynamics.loads.load_of, dynamics.total_of
    accelerations_of, rates = dynamics.accelerations_of, dynamics.rates
    B, DB, bends = types.layout.bend.start, types.layout.bend_rate.start, types.layout.bends
    two, gamma = Real(2.0), Real(float(GAMMA))

    @wp.func
    def stage_of(
        y: State, along: Along, flight: Flight, row: int, push: Push, before: State, h: Real
    ):
        """k of a state, and ω² below which no bend swings by itself [1/s²].

        before: k₁ in the second stage, nothing in the first.
        """
        load = load_of(y, along, flight, row, push)
        total = total_of(y, flight.coefficients, flight.plant, flight.vehicle)
        reach, turned, turning = gamma * h, bends_of(before), bend_rates_of(before)
        rate, explicit = bend_rates_of(y), Bends()
        slowest = flight.plant.stiffness[0] / total.M[0, 0]
        for j in range(bends):
            K, D = flight.plant.stiffness[j], flight.plant.damping[j]
            slowest = wp.min(slowest, K / total.M[j, j])
            explicit[j] = rate[j] - two * reach * turning[j]
            ahead = K * (two * turned[j] - explicit[j]) + two * D * turning[j]
            load.bend[j] = load.bend[j] + reach * ahead
            total.M[j, j] = total.M[j, j] + reach * (D + reach * K)
        k = rates(y, flight, accelerations_of(y, flight, total, load))
        for j in range(bends):
            k[B + j] = explicit[j] + reach * k[DB + j]
        return k, slowest

    if dynamics.loads.with_rates is not None:
        of_bodies, with_rates = stage_of, dynamics.loads.with_rates

        @wp.func
        def stage_with_states(
            y: State, along: Along, flight: Flight, row: int, push: Push, before: State, h: Real
        ):
            """States of terms are integrated by Heun's method: J has no part for them."""
            k, slowest = of_bodies(y, along, flight, row, push, before, h)
            return with_rates(k, y, flight, row, push), slowest

        stage_of = stage_with_states

    return holding(Stage, locals())


def implicit_step_code(numbers: Numbers, tree: Tree, dynamics: Dynamics, pilot: PilotCode) -> Any:
    """The function `step` as kernels/step.py has it, of the linearly implicit step.

    A step that is measured is also taken in two halves: its error is 4/3 of the difference. Along
    what swings, errors of places and of velocities count alike. It returns, third, what those of
    velocities become in the time of the slowest bend: they add up where something is pushed to and
    fro faster than it swings.
    """
    types, stage_of = (
        device_types(numbers, tree),
        stage_code(numbers, tree, dynamics.model).stage_of,
    )
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Pilot, push_at = flight_code(numbers, tree).Flight, pilot.Pilot, pilot.push_at
    moved = resolution_code(numbers, tree).moved
    half, zero, share, swings = Real(0.5), Real(0.0), Real(4.0 / 3.0), Real(np.sqrt(2.0))

    @wp.func
    def step(
        i: int, time: Real, h: Real, y: State, along: Along, flight: Flight, pilot: Pilot,
        held: Push, measured: wp.bool,
    ):  # fmt: skip
        """The change of the state in step i, which starts at a time and lasts h."""
        k = State()
        begun = y
        change = State()
        halves = State()
        drift = State()
        slowest = zero
        # The whole step, then its first and its second half: two stages each.
        stages = wp.int32(2)
        if measured:
            stages = 6
        for stage in range(stages):
            part = stage // 2
            later = stage % 2
            span = h
            ahead = 2 * later
            if part > 0:
                span = half * h
                ahead = later + part - 1
            before = Real(later) * k
            at = begun + span * before
            now = time + half * h * Real(ahead)
            push = push_at(3 * i + ahead, now, at, along, flight, pilot, held)
            row = i * flight.stride + wp.min(flight.stride, ahead)
            k, slowest = stage_of(at, along, flight, row, push, before, span)
            if later == 1:
                by = half * span * (before + k)
                if part == 0:
                    change = by
                else:
                    halves += by
                    begun = y + halves
        error = zero
        if measured:
            # Of changes, not of states, in whose last digits they would be lost.
            error = swings * share * wp.sqrt(moved(halves - change, flight.plant))
            drift = share * (halves - change) / wp.sqrt(slowest)
        return change, error, drift

    return step
