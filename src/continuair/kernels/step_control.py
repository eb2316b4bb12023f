"""How long steps of an embedded pair are: structs of the kernel's arguments, and device code."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.embedded import stage_code

GROWTH = (-0.3, 0.1)
"""Exponents, times one over the order, of the error of this step and of the one before in the next
step: gentle ones, as errors swing with a vibration."""

SAFETY, LEAST, MOST = 0.9, 0.2, 5.0
"""Factor of a step's length that the error allows, and by what a step may differ from the last."""

FIRST = 0.01
"""Share of the allowed error that the first step is chosen for."""

SMALLEST_ERROR, LARGEST_ERROR = 1e-10, 1e10
"""Errors, over what is allowed, between which they are told apart; those of no numbers are the
largest."""


@dataclass(frozen=True)
class ControlArguments:
    """Structs of the kernel's arguments besides those of any roll-out."""

    Method: Any
    Control: Any
    Ticks: Any


@cache
def control_arguments(precision: str) -> ControlArguments:
    """The structs for one precision."""
    Cell = getattr(wp, precision)

    @wp.struct
    class Method:
        """A `Pair`: stages (S, S), nodes (S,), error (S,), dense (S, 4); exponents of the error of
        this step, of the one before, and of a rejected one."""

        stages: wp.array2d(dtype=Cell)
        nodes: wp.array(dtype=Cell)
        error: wp.array(dtype=Cell)
        dense: wp.array2d(dtype=Cell)
        own: Cell
        before: Cell
        rejected: Cell

    @wp.struct
    class Control:
        """allowed (runs or 1, state), errors of a step in the kernels' units, which are `absolute`
        in natural ones; relative, the share of a component that is added to these. longest (runs
        or 1, 2): the first step and any [s]; begin: an error of the first step in allowed ones, to
        the power of 1/order. most: steps of a run, rejected ones included."""

        allowed: wp.array2d(dtype=Cell)
        absolute: Cell
        relative: Cell
        longest: wp.array2d(dtype=Cell)
        begin: Cell
        most: Cell

    @wp.struct
    class Ticks:
        """Starts and ends of the intervals between ticks, and times of samples [s]."""

        starts: wp.array(dtype=Cell)
        ends: wp.array(dtype=Cell)
        samples: wp.array(dtype=Cell)

    return holding(ControlArguments, locals())


@dataclass(frozen=True)
class ControlCode:
    """allowed_of(control, run): errors allowed in the components of a state. error_of(off, y, new,
    allowed, relative): the largest error over what is allowed. first_of(rate, y, allowed, control):
    a first step [s]. factor_of(error, before, rejected, good, method): of the next step.
    stepped(trial, t, target): the step that is taken, a struct of its length, its end, and whether
    it reaches the target."""

    allowed_of: Any
    error_of: Any
    first_of: Any
    factor_of: Any
    stepped: Any


@cache
def control_code(numbers: Numbers, tree: Tree) -> ControlCode:
    """The functions for one kind of numbers and tree of arms."""
    types, code, own = (
        device_types(numbers, tree),
        number_code(numbers),
        control_arguments(numbers.precision),
    )
    Real, State, width = types.Real, types.State, types.layout.state
    above, finite, of_run = code.above, code.finite, code.of_run
    Control, Method, power = own.Control, own.Method, stage_code(numbers, tree).power
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)
    almost = Real(1.0 + (1e-4 if numbers.precision == "float32" else 1e-6))
    smallest, largest = Real(SMALLEST_ERROR), Real(LARGEST_ERROR)
    safety, least, most = Real(SAFETY), Real(LEAST), Real(MOST)

    @wp.struct
    class Step:
        """A step that is taken."""

        step: Real
        end: Real
        reaches: Real

    @wp.func
    def allowed_of(control: Control, run: int):
        out = State()
        for j in range(width):
            out[j] = of_run(control.allowed, run, j)
        return out

    @wp.func
    def error_of(off: State, y: State, new: State, allowed: State, relative: Real):
        """The largest error of a component, over what is allowed."""
        worst = zero
        for j in range(width):
            bound = allowed[j] + relative * wp.max(wp.abs(y[j]), wp.abs(new[j]))
            worst = wp.max(worst, wp.abs(off[j]) / bound)
        worst = finite(wp.length_sq(off) + wp.length_sq(new), worst, largest)
        return wp.min(wp.max(worst, smallest), largest)

    @wp.func
    def first_of(rate: State, y: State, allowed: State, control: Control):
        """A first step: it changes the state by little."""
        fastest = smallest
        for j in range(width):
            bound = allowed[j] + Real(control.relative) * wp.abs(y[j])
            fastest = wp.max(fastest, wp.abs(rate[j]) / bound)
        return finite(fastest, Real(control.begin) / fastest, one)

    @wp.func
    def factor_of(error: Real, before: Real, rejected: Real, good: Real, method: Method):
        """The factor by which the next step is longer, or a rejected one is tried again."""
        grown = safety * power(error, method.own) * power(before, method.before)
        grown = wp.min(wp.max(grown, least), most)
        grown = above(rejected, half, wp.min(grown, one), grown)
        shrunk = wp.min(wp.max(safety * power(error, method.rejected), least), one)
        return above(good, half, grown, shrunk)

    @wp.func
    def stepped(trial: Real, t: Real, target: Real):
        """A step from a time towards a target: two that are left are of one length.

        Ends are numbers, and lengths their difference.
        """
        out = Step()
        left = target - t
        out.reaches = above(trial * almost, left, one, zero)
        shorter = above(two * trial, left, half * left, trial)
        out.end = above(out.reaches, half, target, t + shorter)
        out.step = out.end - t
        return out

    return holding(ControlCode, locals())
