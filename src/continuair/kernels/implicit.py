"""Device code of the linearly implicit step, whose length stiff modes of the arms do not limit."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.dynamics import Dynamics, dynamics_code
from continuair.kernels.elastic import elastic_code
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.pilot import PilotCode

GAMMA = 1.0 - np.sqrt(0.5)
"""Coefficient γ with which a mode much faster than the step is fully damped."""


@dataclass(frozen=True)
class Stage:
    """stage_of(y, along, flight, row, push, before, h): k₁ of a step of length h, or k₂ + 2 k₁."""

    stage_of: Any


@cache
def stage_code(numbers: Numbers, tree: Tree, model: str) -> Stage:
    """Return the stages of ROS2, a W-method (Verwer, Spee, Blom, Hundsdorfer 1999).

    With J, any approximation of the Jacobian of f, a step is of second order:

        (1 - γ h J) k₁ = f(y)        (1 - γ h J) k₂ = f(y + h k₁) - 2 k₁
        y + h (3 k₁ + k₂) / 2        = y + h (k₁ + k) / 2, with k = k₂ + 2 k₁

    J here is the Jacobian of the elastic and damping accelerations -M⁻¹ (K b + D ḃ). The rows of k
    are then those of the dynamics (kernels/dynamics.py), with γ h (D + γ h K) added to the inertia
    of each bend, and an additional force on it.
    """
    types, dynamics = device_types(numbers, tree), dynamics_code(numbers, tree, model)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Bends = flight_code(numbers, tree).Flight, types.Bends
    elastic = elastic_code(numbers, tree)
    pairs, first, second = elastic.pairs, elastic.first, elastic.second
    bends_of, bend_rates_of = types.bends_of, types.bend_rates_of
    load_of, total_of = dynamics.loads.load_of, dynamics.total_of
    accelerations_of, rates = dynamics.accelerations_of, dynamics.rates
    B, DB, bends = types.layout.bend.start, types.layout.bend_rate.start, types.layout.bends
    two, gamma = Real(2.0), Real(float(GAMMA))

    @wp.func
    def stage_of(
        y: State, along: Along, flight: Flight, row: int, push: Push, before: State, h: Real
    ):
        """Return k of a state; before: k₁ in the second stage, 0 in the first."""
        load = load_of(y, along, flight, row, push)
        total = total_of(y, flight.coefficients, flight.plant, flight.vehicle)
        reach, turned, turning = gamma * h, bends_of(before), bend_rates_of(before)
        rate, explicit = bend_rates_of(y), Bends()
        for j in range(bends):
            K, D = flight.plant.stiffness[j], flight.plant.damping[j]
            explicit[j] = rate[j] - two * reach * turning[j]
            ahead = K * (two * turned[j] - explicit[j]) + two * D * turning[j]
            load.bend[j] = load.bend[j] + reach * ahead
            total.M[j, j] = total.M[j, j] + reach * (D + reach * K)
        if wp.static(pairs > 0):
            for p in range(pairs):
                # The same for what one coordinate exerts on the other.
                a = first[p]
                b = second[p]
                K, D = flight.plant.stiffness_between[p], flight.plant.damping_between[p]
                on_a = K * (two * turned[b] - explicit[b]) + two * D * turning[b]
                on_b = K * (two * turned[a] - explicit[a]) + two * D * turning[a]
                load.bend[a] = load.bend[a] + reach * on_a
                load.bend[b] = load.bend[b] + reach * on_b
                total.M[a, b] = total.M[a, b] + reach * (D + reach * K)
                total.M[b, a] = total.M[b, a] + reach * (D + reach * K)
        k = rates(y, flight, accelerations_of(y, flight, total, load))
        for j in range(bends):
            k[B + j] = explicit[j] + reach * k[DB + j]
        return k

    if dynamics.loads.with_rates is not None:
        of_bodies, with_rates = stage_of, dynamics.loads.with_rates

        @wp.func
        def stage_with_states(
            y: State, along: Along, flight: Flight, row: int, push: Push, before: State, h: Real
        ):
            """Return k with states of terms by Heun's method: J has no part for them."""
            k = of_bodies(y, along, flight, row, push, before, h)
            return with_rates(k, y, flight, row, push)

        stage_of = stage_with_states

    return holding(Stage, locals())


def implicit_step_code(numbers: Numbers, tree: Tree, dynamics: Dynamics, pilot: PilotCode) -> Any:
    """Return the function `step`, as in kernels/step.py, of the linearly implicit step."""
    types = device_types(numbers, tree)
    stage_of = stage_code(numbers, tree, dynamics.model).stage_of
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Flight, Pilot, push_at = flight_code(numbers, tree).Flight, pilot.Pilot, pilot.push_at
    half = Real(0.5)

    @wp.func
    def step(
        i: int, time: Real, h: Real, y: State, along: Along, flight: Flight, pilot: Pilot,
        held: Push,
    ):  # fmt: skip
        """Return the change of the state in step i, which starts at a time and lasts h."""
        k = State()
        before = State()
        # A loop that the compiler does not unroll: the code of the rate is compiled once.
        for stage in range(2 + wp.min(flight.stride, 0)):
            before = Real(stage) * k
            at = y + h * before
            ahead = 2 * stage
            push = push_at(3 * i + ahead, time + Real(stage) * h, at, along, flight, pilot, held)
            row = i * flight.stride + wp.min(flight.stride, ahead)
            k = stage_of(at, along, flight, row, push, before, h)
        return half * h * (before + k)

    return step
