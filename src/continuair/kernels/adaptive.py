"""The roll-out by an embedded pair: each run takes the steps that its own error allows.

Between two ticks, instants at which a controller acts on all runs of a pack, every run has a time
of its own. A step ends at the run's next break or at the tick, and never passes over a piece of
its signals. Samples are read from the pair's interpolant, and so do not change the steps.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arguments import arguments
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.embedded import stage_code
from continuair.kernels.flight import flight_code
from continuair.kernels.numbers import Numbers, holding, number_code
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.signals import signal_code
from continuair.kernels.step import NOT_FINITE, OVERTURNED, STEP_LIMIT, UNSEEN, stepping_code
from continuair.kernels.types import Tree, device_types

COUNTS = 5
"""Columns of what is counted of each run: steps taken, steps rejected, evaluations of the rates,
time reached [s], and the most that rotors were asked for beyond their limits."""

STEPS, REJECTED, EVALUATIONS, REACHED, SATURATION = range(COUNTS)

GROWTH = (-0.3, 0.1)
"""Exponents, times one over the order, of the error of this step and of the one before in the next
step: gentle ones, as errors swing with a vibration."""

SAFETY, LEAST, MOST = 0.9, 0.2, 5.0
"""Factor of a step's length that the error allows, and by what a step may differ from the last."""

FIRST = 0.01
"""Share of the allowed error that the first step is chosen for."""

_LARGEST_ERROR = 1e10
_SMALLEST_ERROR = 1e-10
_BISECTIONS = 40


@dataclass(frozen=True)
class Adaptive:
    """Structs of the kernel's arguments besides those of any roll-out."""

    Method: Any
    Control: Any
    Ticks: Any


@cache
def adaptive_arguments(precision: str) -> Adaptive:
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

    return holding(Adaptive, locals())


@dataclass(frozen=True)
class _Control:
    """error_of(off, y, new, allowed, relative), the largest error over what is allowed;
    first_of(rate, y, allowed, control), a first step [s]; grown(error, before, rejected, method)
    and shrunk(error, method), factors of the next step."""

    error_of: Any
    first_of: Any
    grown: Any
    shrunk: Any


@cache
def _control_code(numbers: Numbers, tree: Tree) -> _Control:
    """How long steps are."""
    types, code, sums = device_types(numbers, tree), number_code(numbers), stage_code(numbers, tree)
    Real, State, width, power = types.Real, types.State, types.layout.state, sums.power
    above, finite = code.above, code.finite
    Control, Method = (
        adaptive_arguments(numbers.precision).Control,
        adaptive_arguments(numbers.precision).Method,
    )
    zero, one, half = Real(0.0), Real(1.0), Real(0.5)
    smallest, largest = Real(_SMALLEST_ERROR), Real(_LARGEST_ERROR)
    safety, least, most = Real(SAFETY), Real(LEAST), Real(MOST)

    @wp.func
    def error_of(off: State, y: State, new: State, allowed: State, relative: Real):
        """The largest error of a component, over what is allowed; very large if not finite."""
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
    def grown(error: Real, before: Real, rejected: Real, method: Method):
        """The factor by which the next step is longer than one that was accepted."""
        factor = safety * power(error, method.own) * power(before, method.before)
        factor = wp.min(wp.max(factor, least), most)
        return above(rejected, half, wp.min(factor, one), factor)

    @wp.func
    def shrunk(error: Real, method: Method):
        """The factor by which a rejected step is tried again."""
        return wp.min(wp.max(safety * power(error, method.rejected), least), one)

    return holding(_Control, locals())


def adaptive_kernel(
    numbers: Numbers,
    tree: Tree,
    dynamics: Dynamics,
    pilot: PilotCode,
    log_row: Any,
    every_stage: bool = False,
    name: str = "adaptive",
) -> Any:
    """The kernel of a roll-out of a model under a pilot, by an embedded pair.

    log_row, name: as `rollout_kernel` has them. every_stage: whether the pilot acts at every stage.
    log: (runs, samples, columns), of which samples that a run does not reach stay as they are.
    status: (runs,); counts: (runs, COUNTS).
    """
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    stepping, begins = stepping_code(numbers, tree), arguments(numbers.precision)
    own, signals_of = adaptive_arguments(numbers.precision), signal_code(numbers)
    code, sums, steer = (
        number_code(numbers),
        stage_code(numbers, tree),
        _control_code(numbers, tree),
    )
    Cell, Real, State, Push = types.Cell, types.Real, types.State, types.Push
    Vehicles, Drive, Start = structs.Vehicles, begins.Drive, begins.Start
    Method, Control, Ticks, Signals = own.Method, own.Control, own.Ticks, signals_of.Signals
    flight_of, freeze, load_state = structs.flight_of, structs.freeze, types.load_state
    Branch, branch_at, followed = stepping.Branch, stepping.branch_at, stepping.followed
    end_of, added, compensated = stepping.end_of, stepping.added, stepping.compensated
    Loop, pilot_of, decide, push_at = pilot.Loop, pilot.pilot_of, pilot.decide, pilot.push_at
    Stages, Interpolant, combined, weighed = (
        sums.Stages, sums.Interpolant, sums.combined, sums.weighed,
    )  # fmt: skip
    store, stored, interpolate, between = sums.store, sums.stored, sums.interpolate, sums.at
    mixed = sums.mixed
    evaluate, longest_at, next_break = (
        signals_of.evaluate,
        signals_of.longest,
        signals_of.next_break,
    )
    error_of, first_of, grown, shrunk = (
        steer.error_of, steer.first_of, steer.grown, steer.shrunk,
    )  # fmt: skip
    above, any_above, all_above = code.above, code.any_above, code.all_above
    at, of_run, keep_whole, keep_of_run = code.at, code.of_run, code.keep_whole, code.keep_of_run
    width, sections, lanes = types.layout.state, types.layout.sections, code.lanes
    rate_of, excess_of = dynamics.rate_of, dynamics.loads.excess_of
    misdirected, coarse = dynamics.loads.misdirected, numbers.precision == "float32"
    limited, misleading = excess_of is not None, misdirected is not None
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)
    almost, last_node = Real(1.0 + (1e-4 if coarse else 1e-6)), Real(1.0 - 1e-6)
    followable = Real(1e-6 if coarse else 1e-9)
    shortest = Real(1e-7 if coarse else 1e-12)
    not_finite, step_limit = Real(float(NOT_FINITE)), Real(float(STEP_LIMIT))
    unseen, overturned = Real(float(UNSEEN)), Real(float(OVERTURNED))
    beyond_any = Real(0.5 * _LARGEST_ERROR)
    least_memory, bisections = Real(1e-4), _BISECTIONS

    @wp.func
    def allowed_of(control: Control, run: int):
        out = State()
        for j in range(width):
            out[j] = of_run(control.allowed, run, j)
        return out

    @wp.func
    def stepped(trial: Real, t: Real, target: Real):
        """A step from a time towards a target: its length, its end, and whether it gets there.

        Two steps that are left are of one length. Ends are numbers, and lengths their difference.
        """
        left = target - t
        reaches = above(trial * almost, left, one, zero)
        step = above(two * trial, left, half * left, trial)
        end = above(reaches, half, target, t + step)
        return end - t, end, reaches

    @wp.func
    def due_until(samples: wp.array(dtype=Cell), sample: Real, t: Real):
        """1 where the next sample is not after a time."""
        there = above(at(samples, sample), t, zero, one)
        return above(Real(Cell(samples.shape[0])), sample, there, zero)

    @wp.func
    def due_before(samples: wp.array(dtype=Cell), sample: Real, t: Real):
        """1 where the next sample is before a time."""
        there = above(t, at(samples, sample), one, zero)
        return above(Real(Cell(samples.shape[0])), sample, there, zero)

    @wp.func
    def mixed_branches(which: Real, x: Branch, y: Branch):
        out = y
        for j in range(2 * sections + 2):
            out.direction[j] = above(which, half, x.direction[j], y.direction[j])
        for j in range(sections):
            out.turns[j] = above(which, half, x.turns[j], y.turns[j])
        return out

    @wp.kernel(name=name, enable_backward=False, module="unique", module_options=code.options)
    def adaptive(
        vehicles: Vehicles,
        start: Start,
        drive: Drive,
        signals: Signals,
        motion: Signals,
        method: Method,
        control: Control,
        ticks: Ticks,
        loop: Loop,
        log: wp.array3d(dtype=Cell),
        status: wp.array(dtype=wp.int32),
        counts: wp.array2d(dtype=Cell),
    ):
        run = wp.tid() * lanes
        flight = flight_of(vehicles, drive, run)
        unit = flight.plant.unit
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(start.frozen, run, 0, unit))
        y = load_state(start.states, run, 0, unit)
        rest = State()
        branch = branch_at(start.angle, run)
        pilot = pilot_of(loop, run)
        push = Push()
        allowed = allowed_of(control, run)
        relative, absolute = Real(control.relative), Real(control.absolute)
        stages = Stages()
        inside = Interpolant()
        count = method.nodes.shape[0]
        timed = signals.driven.shape[0] > 0
        first_step = of_run(control.longest, run, 0)
        longest = of_run(control.longest, run, 1)
        h = Real(-1.0)
        t = Real(ticks.starts[0])
        upcoming = Real(0.0)
        sample = Real(0.0)
        ended = Real(0.0)
        before = Real(1.0)
        rejected = Real(0.0)
        taken = Real(0.0)
        refused = Real(0.0)
        evaluated = Real(0.0)
        excess = Real(0.0)
        for i in range(ticks.starts.shape[0]):
            tick = Real(ticks.ends[i])
            if wp.static(every_stage):
                evaluate(motion, loop.motion, run, t, zero)
            decision = decide(i, t, y, branch.direction, flight, pilot, push)
            push = decision.push
            due = above(ended, zero, zero, due_until(ticks.samples, sample, t))
            log_row(log, sample, due, y, flight, branch, push)
            sample += due
            gone = above(decision.lost, one, overturned, unseen * decision.lost)
            ended += above(ended, zero, zero, gone)
            fresh = Real(1.0)
            waiting = above(ended, zero, one, zero)
            while not all_above(waiting, half):
                active = one - waiting
                target = wp.min(next_break(signals, run, upcoming), tick)
                most = longest
                if timed:
                    most = wp.min(most, longest_at(signals, run, t))
                if wp.static(every_stage):
                    most = wp.min(most, longest_at(motion, run, t))
                begin = wp.int32(1)
                if any_above(fresh, half):
                    begin = wp.int32(0)
                step, end, reaches = stepped(wp.min(h, most), t, target)
                new = y
                for stage in range(begin, count):
                    node = Real(method.nodes[stage])
                    time = above(node, last_node, end, t + node * step)
                    new = added(y, step * combined(stages, method.stages, stage))
                    before_break = above(node, last_node, one, zero)
                    if timed:
                        evaluate(signals, flight.inputs, run, time, before_break)
                    if wp.static(every_stage):
                        evaluate(motion, loop.motion, run, time, before_break)
                    pushing = push_at(0, time, new, branch.direction, flight, pilot, push)
                    k = rate_of(new, branch.direction, flight, 0, pushing)
                    if stage == 0:
                        k = mixed(fresh, k, stored(stages, 0))
                    store(stages, stage, k)
                    if stage == 0 and any_above(zero, h):
                        # The first step of all follows from the rates at the start.
                        h = above(zero, h, wp.min(first_of(k, y, allowed, control), first_step), h)
                        step, end, reaches = stepped(wp.min(h, most), t, target)
                evaluated += active * (Real(Cell(count - 1)) + fresh)
                off = step * weighed(stages, method.error, count)
                error = error_of(off, y, new, allowed, relative)
                if wp.static(misleading):
                    # Loads along directions that are followed: short steps see where these turn.
                    doubt = misdirected(y, new, branch.direction, flight, 0) / absolute
                    error = wp.max(error, above(step, followable, doubt, zero))
                good = above(error, one, zero, active)
                factor = above(
                    good, half, grown(error, before, rejected, method), shrunk(error, method)
                )
                proposed = factor * step
                # A step that something else cut short tells little of the next one.
                kept = above(
                    good, half, above(h, almost * step, wp.max(proposed, h), proposed), proposed
                )
                h = above(active, half, kept, h)
                before = above(good, half, wp.max(error, least_memory), before)
                rejected = above(active, half, one - good, rejected)
                taken += good
                refused += active - good
                # A step that is too short to go on: of rates that are no numbers, or of kinks.
                why = above(error, beyond_any, not_finite, step_limit)
                failed = above(shortest, h, active * why, zero)
                failed = above(taken + refused, Real(control.most), active * step_limit, failed)
                now = above(good, half, end_of(new), zero)
                whole = one
                if any_above(good, half):
                    if any_above(now, zero):
                        # Where in the step the status begins.
                        interpolate(inside, stages, method.dense, count)
                        low = zero
                        for _ in range(bisections):
                            middle = half * (low + whole)
                            there = end_of(added(y, step * between(inside, middle)))
                            low = above(there, zero, low, middle)
                            whole = above(there, zero, middle, whole)
                        whole = above(now, zero, whole, one)
                        new = mixed(now, added(y, step * between(inside, whole)), new)
                        end = above(now, zero, t + whole * step, end)
                    reached = good * due_before(ticks.samples, sample, end)
                    if any_above(reached, half):
                        interpolate(inside, stages, method.dense, count)
                        while any_above(reached, half):
                            time = at(ticks.samples, sample)
                            seen = added(y, step * between(inside, (time - t) / step))
                            if wp.static(every_stage):
                                evaluate(motion, loop.motion, run, time, zero)
                            pushing = push_at(0, time, seen, branch.direction, flight, pilot, push)
                            log_row(
                                log, sample, reached, seen, flight, followed(branch, seen), pushing
                            )
                            sample += reached
                            reached = reached * due_before(ticks.samples, sample, end)
                    if wp.static(limited):
                        if timed:
                            evaluate(signals, flight.inputs, run, end, one)
                        beyond = excess_of(
                            new,
                            flight,
                            0,
                            push_at(0, end, new, branch.direction, flight, pilot, push),
                        )
                        excess = wp.max(excess, above(good, half, beyond, zero))
                    if wp.static(coarse):
                        summed, left_over = compensated(
                            y, rest, step * combined(stages, method.stages, count - 1)
                        )
                        rest = mixed(good, left_over, rest)
                        new = mixed(above(now, zero, zero, one), summed, new)
                    branch = mixed_branches(good, followed(branch, new), branch)
                    y = mixed(good, new, y)
                    t = above(good, half, end, t)
                    store(stages, 0, mixed(good, stored(stages, count - 1), stored(stages, 0)))
                arrived = good * reaches
                on_break = above(
                    arrived, half, above(next_break(signals, run, upcoming), t, zero, one), zero
                )
                upcoming += on_break
                fresh = above(active, half, on_break, fresh)
                if wp.static(every_stage):  # noqa: SIM102 (the first is decided as code is made)
                    if any_above(good, half):
                        evaluate(motion, loop.motion, run, t, zero)
                        decision = decide(i, t, y, branch.direction, flight, pilot, push)
                        gone = above(good, half, unseen * decision.lost, zero)
                        now = above(now, zero, now, gone)
                ended += active * above(now, zero, now, failed)
                waiting = above(
                    ended, zero, one, above(arrived, half, above(tick, t, zero, one), waiting)
                )
            if all_above(ended, zero):
                break
        due = above(ended, zero, zero, due_until(ticks.samples, sample, t))
        pushing = push_at(0, t, y, branch.direction, flight, pilot, push)
        log_row(log, sample, due, y, flight, branch, pushing)
        keep_whole(status, run, ended)
        keep_of_run(counts, run, 0, taken)
        keep_of_run(counts, run, 1, refused)
        keep_of_run(counts, run, 2, evaluated)
        keep_of_run(counts, run, 3, t)
        keep_of_run(counts, run, 4, excess)

    return adaptive
