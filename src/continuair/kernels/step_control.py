"""Step size control of an embedded pair: structs of kernel arguments, and device code."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.embedded import stage_code

GROWTH = (-0.3, 0.1)
"""Exponents, divided by the order, of the errors of this step and the previous one in the next step
length. They are small, because errors oscillate with vibrations."""

SAFETY, LEAST, MOST = 0.9, 0.2, 5.0
"""Safety factor of a step's length, and bounds of the ratio of successive lengths."""

FIRST = 0.01
"""Share of the allowed error for which the first step is chosen."""

SMALLEST_ERROR, LARGEST_ERROR = 1e-10, 1e10
"""Bounds of errors relative to the allowed error; NaN counts as the largest."""


@dataclass(frozen=True)
class ControlArguments:
    """Structs of kernel arguments for adaptive steps."""

    Method: Any
    Control: Any
    Ticks: Any


@cache
def control_arguments(precision: str) -> ControlArguments:
    """Return the structs for one precision."""
    Cell = getattr(wp, precision)

    @wp.struct
    class Method:
        """A `Pair`: stages (S, S), nodes (S,), error (S,), dense (S, 4); exponents of the errors of
        this step, of the previous one, and of a rejected one."""

        stages: wp.array2d(dtype=Cell)
        nodes: wp.array(dtype=Cell)
        error: wp.array(dtype=Cell)
        dense: wp.array2d(dtype=Cell)
        own: Cell
        before: Cell
        rejected: Cell

    @wp.struct
    class Control:
        """Error control. allowed (runs or 1, state): allowed errors in kernel units, which are
        `absolute` in natural units. relative: share of a component that is added. longest (runs or
        1, 2): bounds of the first step and of all steps [s]. begin: target error of the first step,
        relative to the allowed one, to the power 1/order. most: steps of a run, rejected included.
        """

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
    """Functions of step size control.

    allowed_of(control, run): allowed errors of a state. error_of(off, y, new, allowed, relative):
    largest error relative to the allowed one. first_of(rate, y, allowed, control): first step [s].
    factor_of(error, before, rejected, good, method): factor of the next step. stepped(trial, t,
    target): a struct of the step's length, its end, and whether it reaches the target.
    """

    allowed_of: Any
    error_of: Any
    first_of: Any
    factor_of: Any
    stepped: Any


@cache
def control_code(numbers: Numbers, tree: Tree) -> ControlCode:
    """Return the functions for one kind of numbers and tree of arms."""
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
        """A step: length, end, and 1 if it reaches the target."""

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
        """Return the largest error of a component, relative to the allowed one."""
        worst = zero
        for j in range(width):
            bound = allowed[j] + relative * wp.max(wp.abs(y[j]), wp.abs(new[j]))
            worst = wp.max(worst, wp.abs(off[j]) / bound)
        worst = finite(wp.length_sq(off) + wp.length_sq(new), worst, largest)
        return wp.min(wp.max(worst, smallest), largest)

    @wp.func
    def first_of(rate: State, y: State, allowed: State, control: Control):
        """Return a first step, which changes the state by little."""
        fastest = smallest
        for j in range(width):
            bound = allowed[j] + Real(control.relative) * wp.abs(y[j])
            fastest = wp.max(fastest, wp.abs(rate[j]) / bound)
        return finite(fastest, Real(control.begin) / fastest, one)

    @wp.func
    def factor_of(error: Real, before: Real, rejected: Real, good: Real, method: Method):
        """Return the factor of the next step, or of the repetition of a rejected one."""
        grown = safety * power(error, method.own) * power(before, method.before)
        grown = wp.min(wp.max(grown, least), most)
        grown = above(rejected, half, wp.min(grown, one), grown)
        shrunk = wp.min(wp.max(safety * power(error, method.rejected), least), one)
        return above(good, half, grown, shrunk)

    @wp.func
    def stepped(trial: Real, t: Real, target: Real):
        """Return a step from a time towards a target; the last two steps are equal.

        The length is the difference of the rounded times.
        """
        out = Step()
        left = target - t
        out.reaches = above(trial * almost, left, one, zero)
        shorter = above(two * trial, left, half * left, trial)
        out.end = above(out.reaches, half, target, t + shorter)
        out.step = out.end - t
        return out

    return holding(ControlCode, locals())
