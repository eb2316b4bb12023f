"""Roll-outs by an embedded pair, with adaptive steps for each run.

Between two ticks, the times of controller updates, every run of a pack has its own time. A step
ends at the run's next breakpoint or at the tick, and never skips a piece of its signals. Samples
are evaluated by the pair's interpolant, so that they do not change the steps.
"""

from typing import Any

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.embedded import stage_code
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.pilot import PilotCode
from continuair.kernels.signals import signal_code
from continuair.kernels.step import (
    NOT_FINITE,
    OVERTURNED,
    STEP_LIMIT,
    UNSEEN,
    stepping_code,
)
from continuair.kernels.step_control import LARGEST_ERROR, control_arguments, control_code

COUNTS = 5
"""Number of counts per run: accepted steps, rejected steps, evaluations of the rates, time reached
[s], and the largest demand of thrust beyond the rotors' limits."""

STEPS, REJECTED, EVALUATIONS, REACHED, SATURATION = range(COUNTS)

_LARGEST_TURN = 2.0
"""Largest rotation of the UAV in a step, so that whole turns are counted [rad]."""

_BISECTIONS = 40
"""Bisections of a step in which a run stops: to 1e-12 of its length."""


def adaptive_kernel(
    numbers: Numbers,
    tree: Tree,
    dynamics: Dynamics,
    pilot: PilotCode,
    log_row: Any,
    every_stage: bool = False,
    name: str = "adaptive",
) -> Any:
    """Return the kernel of a roll-out of a model with adaptive steps, under a controller.

    log_row, name: as in `rollout_kernel`. every_stage: whether the controller acts at every stage.
    log: (runs, samples, columns); samples that a run does not reach stay unchanged. status:
    (runs,). counts: (runs, COUNTS).
    """
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    stepping, begins = stepping_code(numbers, tree), arguments(numbers.precision)
    own, signals_of = control_arguments(numbers.precision), signal_code(numbers)
    code, sums, steer = number_code(numbers), stage_code(numbers, tree), control_code(numbers, tree)
    Cell, Real, State, Push = types.Cell, types.Real, types.State, types.Push
    Vehicles, Drive, Start = structs.Vehicles, begins.Drive, begins.Start
    Method, Control, Ticks, Signals = own.Method, own.Control, own.Ticks, signals_of.Signals
    Flight, flight_of, freeze = structs.Flight, structs.flight_of, structs.freeze
    load_state, Branch, branch_at = types.load_state, stepping.Branch, stepping.branch_at
    Path, followed, end_of = stepping.Path, stepping.followed, stepping.end_of
    added, compensated = stepping.added, stepping.compensated
    Loop, Pilot, pilot_of = pilot.Loop, pilot.Pilot, pilot.pilot_of
    decide, push_at = pilot.decide, pilot.push_at
    Stages, Interpolant = sums.Stages, sums.Interpolant
    combined, weighed, store, stored = sums.combined, sums.weighed, sums.store, sums.stored
    interpolate, between, mixed = sums.interpolate, sums.at, sums.mixed
    evaluate, longest_at = signals_of.evaluate, signals_of.longest
    next_break, stepped = signals_of.next_break, steer.stepped
    allowed_of, error_of, first_of = steer.allowed_of, steer.error_of, steer.first_of
    factor_of = steer.factor_of
    above, any_above, all_above = code.above, code.any_above, code.all_above
    at, of_run, keep_whole, keep_of_run = code.at, code.of_run, code.keep_whole, code.keep_of_run
    lanes, chosen = code.lanes, stepping.chosen
    rate_of, excess_of = dynamics.rate_of, dynamics.loads.excess_of
    misdirected, coarse = dynamics.loads.misdirected, numbers.precision == "float32"
    limited, misleading = excess_of is not None, misdirected is not None
    switched, switches = dynamics.switched, dynamics.switched is not None
    settled, remembers = dynamics.loads.settled, dynamics.loads.settled is not None
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)
    last_node, almost = Real(1.0 - 1e-6), Real(1.0 + 1e-6)
    # Shortest step that resolves on which side a direction turns, and shortest step of all.
    followable, shortest = Real(1e-6 if coarse else 1e-9), Real(1e-7 if coarse else 1e-12)
    not_finite, step_limit = Real(float(NOT_FINITE)), Real(float(STEP_LIMIT))
    unseen, overturned = Real(float(UNSEEN)), Real(float(OVERTURNED))
    largest_turn, slowest, spin_of = Real(_LARGEST_TURN), Real(1e-9), types.spin_of
    beyond_any, least_error, bisections = Real(0.5 * LARGEST_ERROR), Real(1e-4), _BISECTIONS

    @wp.struct
    class Course:
        """Arguments of a run: signals of inputs and target motion, method, error control, ticks and
        the control loop."""

        signals: Signals
        motion: Signals
        method: Method
        control: Control
        ticks: Ticks
        loop: Loop

    @wp.struct
    class Progress:
        """Progress of a run. rest: rounding error of y, in single precision. upcoming, sample:
        indices of its next breakpoint and next sample. before, rejected: error of the previous
        step, and 1 if the last one was rejected. fresh: 1 if the first stage must be evaluated
        again. waiting: 1 until the next tick; ended: its status."""

        y: State
        rest: State
        branch: Branch
        push: Push
        stages: Stages
        inside: Interpolant
        t: Real
        h: Real
        upcoming: Real
        sample: Real
        before: Real
        rejected: Real
        fresh: Real
        waiting: Real
        ended: Real
        taken: Real
        refused: Real
        evaluated: Real
        excess: Real

    @wp.struct
    class Attempt:
        """A step from t to its end, and the state y there. reaches: 1 if it ends at a breakpoint or
        the tick; path: of the state; good: 1 if it is accepted; status: with which the run stops in
        it, or 0."""

        step: Real
        end: Real
        reaches: Real
        y: State
        path: Path
        error: Real
        good: Real
        status: Real

    @wp.func
    def put_inputs(course: Course, flight: Flight, time: Real, before: Real):
        """Write inputs and target motion at a time; before: 1 for the left limit."""
        if course.signals.driven.shape[0] > 0:
            evaluate(course.signals, flight.inputs, flight.run, time, before)
        if wp.static(every_stage):
            evaluate(course.motion, course.loop.motion, flight.run, time, before)

    @wp.func
    def longest_of(course: Course, flight: Flight, t: Real, y: State):
        """Return the longest step: Euler angles cannot be followed over a larger rotation."""
        spin = wp.max(wp.length(spin_of(y)), slowest)
        out = wp.min(of_run(course.control.longest, flight.run, 1), largest_turn / spin)
        if course.signals.driven.shape[0] > 0:
            out = wp.min(out, longest_at(course.signals, flight.run, t))
        if wp.static(every_stage):
            out = wp.min(out, longest_at(course.motion, flight.run, t))
        return out

    @wp.func
    def is_left(course: Course, sample: Real):
        """Return 1 if there is another sample."""
        return above(Real(Cell(course.ticks.samples.shape[0])), sample, one, zero)

    @wp.func
    def log_now(
        course: Course, flight: Flight, p: wp.ref[Progress], log: wp.array3d(dtype=Cell), push: Push
    ):
        """Log the sample that is due, if any."""
        due = is_left(course, p.sample) * above(at(course.ticks.samples, p.sample), p.t, zero, one)
        due = above(p.ended, zero, zero, due)
        log_row(log, p.sample, due, p.y, flight, p.branch, push)
        p.sample = p.sample + due

    @wp.func
    def begin_tick(
        i: int, course: Course, flight: Flight, pilot: Pilot, p: wp.ref[Progress],
        log: wp.array3d(dtype=Cell),
    ):  # fmt: skip
        """Update the controller."""
        if wp.static(every_stage):
            evaluate(course.motion, course.loop.motion, flight.run, p.t, zero)
        decision = decide(i, p.t, p.y, p.branch.direction, flight, pilot, p.push)
        p.push = decision.push
        log_now(course, flight, p, log, p.push)
        gone = above(decision.lost, one, overturned, unseen * decision.lost)
        p.ended = p.ended + above(p.ended, zero, zero, gone)
        p.fresh = one
        p.waiting = above(p.ended, zero, zero, one)

    @wp.func
    def begin_step(flight: Flight, p: wp.ref[Progress]):
        """Switch terms, such as a payload that is picked up."""
        y, now = switched(p.y, flight, p.t)
        now = now * p.waiting
        if any_above(now, half):
            p.y = mixed(now, y, p.y)
            p.fresh = above(now, half, one, p.fresh)

    @wp.func
    def attempt(
        course: Course,
        flight: Flight,
        pilot: Pilot,
        p: wp.ref[Progress],
        allowed: State,
        tick: Real,
    ):
        """Evaluate all stages of a step, and its error."""
        out = Attempt()
        method, along = course.method, p.branch.direction
        target = wp.min(next_break(course.signals, flight.run, p.upcoming), tick)
        most = longest_of(course, flight, p.t, p.y)
        trial = stepped(wp.min(p.h, most), p.t, target)
        count = method.nodes.shape[0]
        begin = wp.int32(1)
        if any_above(p.fresh, half):
            begin = wp.int32(0)
        out.y = p.y
        for stage in range(begin, count):
            node = Real(method.nodes[stage])
            at_end = above(node, last_node, one, zero)
            time = above(at_end, half, trial.end, p.t + node * trial.step)
            out.y = added(p.y, trial.step * combined(p.stages, method.stages, stage))
            put_inputs(course, flight, time, at_end)
            push = push_at(0, time, out.y, along, flight, pilot, p.push)
            k = rate_of(out.y, along, flight, 0, push)
            if stage == 0:
                k = mixed(p.fresh, k, stored(p.stages, 0))
            store(p.stages, stage, k)
            if stage == 0 and any_above(zero, p.h):
                # The length of the first step follows from the initial rates.
                first = wp.min(
                    first_of(k, p.y, allowed, course.control),
                    of_run(course.control.longest, flight.run, 0),
                )
                p.h = above(zero, p.h, first, p.h)
                trial = stepped(wp.min(p.h, most), p.t, target)
        out.step = trial.step
        out.end = trial.end
        out.reaches = trial.reaches
        off = out.step * weighed(p.stages, method.error, count)
        out.error = error_of(off, p.y, out.y, allowed, Real(course.control.relative))
        if wp.static(misleading):
            # Loads along followed directions: short steps resolve how these turn.
            doubt = misdirected(p.y, out.y, along, flight, 0, p.push, out.step)
            doubt = doubt / Real(course.control.absolute)
            out.error = wp.max(out.error, above(out.step, followable, doubt, zero))
        out.good = above(out.error, one, zero, p.waiting)
        out.path.change = out.y - p.y
        out.path.begins = out.step * stored(p.stages, 0)
        out.path.ends = out.step * stored(p.stages, count - 1)
        p.evaluated = p.evaluated + p.waiting * (Real(Cell(count - 1)) + p.fresh)
        return out

    @wp.func
    def choose_step(course: Course, p: wp.ref[Progress], tried: wp.ref[Attempt]):
        """Choose the next step from the error of this one; stop a run that cannot continue."""
        factor = factor_of(tried.error, p.before, p.rejected, tried.good, course.method)
        proposed = factor * tried.step
        # The error of a step that was cut short says little about the next one.
        cut = above(p.h, almost * tried.step, tried.good, zero)
        kept = above(cut, half, wp.max(proposed, p.h), proposed)
        p.h = above(p.waiting, half, kept, p.h)
        p.before = above(tried.good, half, wp.max(tried.error, least_error), p.before)
        p.rejected = above(p.waiting, half, one - tried.good, p.rejected)
        p.taken = p.taken + tried.good
        p.refused = p.refused + p.waiting - tried.good
        # Too short to continue: rates are not finite, or there is a kink.
        why = above(tried.error, beyond_any, not_finite, step_limit)
        tried.status = above(shortest, p.h, p.waiting * why, zero)
        many = above(p.taken + p.refused, Real(course.control.most), p.waiting, zero)
        tried.status = above(many, half, step_limit, tried.status)

    @wp.func
    def locate_end(course: Course, p: wp.ref[Progress], tried: wp.ref[Attempt]):
        """Shorten a step in which its run stops."""
        ends = tried.good * end_of(tried.y)
        if any_above(ends, zero):
            interpolate(p.inside, p.stages, course.method.dense, course.method.nodes.shape[0])
            low = zero
            high = one
            for _ in range(bisections):
                middle = half * (low + high)
                there = end_of(added(p.y, tried.step * between(p.inside, middle)))
                low = above(there, zero, low, middle)
                high = above(there, zero, middle, high)
            last = added(p.y, tried.step * between(p.inside, high))
            tried.y = mixed(ends, last, tried.y)
            tried.end = above(ends, zero, p.t + high * tried.step, tried.end)
            tried.status = above(ends, zero, ends, tried.status)

    @wp.func
    def due_within(course: Course, p: wp.ref[Progress], tried: wp.ref[Attempt]):
        """Return 1 if the next sample is within an accepted step."""
        there = above(tried.end, at(course.ticks.samples, p.sample), tried.good, zero)
        return there * is_left(course, p.sample)

    @wp.func
    def log_samples(
        course: Course, flight: Flight, pilot: Pilot, p: wp.ref[Progress], tried: wp.ref[Attempt],
        log: wp.array3d(dtype=Cell),
    ):  # fmt: skip
        """Log the samples within a step, by the interpolant."""
        due = due_within(course, p, tried)
        if any_above(due, half):
            interpolate(p.inside, p.stages, course.method.dense, course.method.nodes.shape[0])
            while any_above(due, half):
                time = at(course.ticks.samples, p.sample)
                y = added(p.y, tried.step * between(p.inside, (time - p.t) / tried.step))
                if wp.static(every_stage):
                    evaluate(course.motion, course.loop.motion, flight.run, time, zero)
                push = push_at(0, time, y, p.branch.direction, flight, pilot, p.push)
                share = (time - p.t) / tried.step
                branch = followed(p.branch, p.y, tried.path, share, y)
                log_row(log, p.sample, due, y, flight, branch, push)
                p.sample = p.sample + due
                due = due_within(course, p, tried)

    @wp.func
    def accept(
        i: int, course: Course, flight: Flight, pilot: Pilot, p: wp.ref[Progress],
        tried: wp.ref[Attempt],
    ):  # fmt: skip
        """Advance to the end of an accepted step."""
        good, count = tried.good, course.method.nodes.shape[0]
        if wp.static(limited or remembers):
            put_inputs(course, flight, tried.end, one)
            push = push_at(0, tried.end, tried.y, p.branch.direction, flight, pilot, p.push)
            if wp.static(limited):
                p.excess = wp.max(p.excess, good * excess_of(tried.y, flight, 0, push))
            if wp.static(remembers):
                tried.y = settled(tried.y, flight, 0, push)
        if wp.static(coarse):
            change = tried.step * combined(p.stages, course.method.stages, count - 1)
            summed, rest = compensated(p.y, p.rest, change)
            p.rest = mixed(good, rest, p.rest)
            tried.y = mixed(above(tried.status, zero, zero, one), summed, tried.y)
        share = (tried.end - p.t) / tried.step
        p.branch = chosen(good, followed(p.branch, p.y, tried.path, share, tried.y), p.branch)
        p.y = mixed(good, tried.y, p.y)
        p.t = above(good, half, tried.end, p.t)
        store(p.stages, 0, mixed(good, stored(p.stages, count - 1), stored(p.stages, 0)))
        if wp.static(every_stage):
            evaluate(course.motion, course.loop.motion, flight.run, p.t, zero)
            decision = decide(i, p.t, p.y, p.branch.direction, flight, pilot, p.push)
            lost = above(good, half, unseen * decision.lost, zero)
            tried.status = above(tried.status, zero, tried.status, lost)

    @wp.func
    def settle(
        course: Course, flight: Flight, p: wp.ref[Progress], tried: wp.ref[Attempt], tick: Real
    ):
        """Advance to the next breakpoint if one was reached, and wait at the tick."""
        arrived = tried.good * tried.reaches
        there = above(next_break(course.signals, flight.run, p.upcoming), p.t, zero, arrived)
        p.upcoming = p.upcoming + there
        p.fresh = above(p.waiting, half, there, p.fresh)
        p.ended = p.ended + p.waiting * tried.status
        short_of = above(arrived, half, above(tick, p.t, one, zero), p.waiting)
        p.waiting = above(p.ended, zero, zero, short_of)

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
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(start.frozen, run, 0, flight.plant.unit))
        pilot = pilot_of(loop, run)
        allowed = allowed_of(control, run)
        course = Course()
        course.signals = signals
        course.motion = motion
        course.method = method
        course.control = control
        course.ticks = ticks
        course.loop = loop
        p = Progress()
        p.y = load_state(start.states, run, 0, flight.plant.unit)
        p.branch = branch_at(start.angle, run)
        p.t = Real(ticks.starts[0])
        p.h = Real(-1.0)
        p.before = one
        for i in range(ticks.starts.shape[0]):
            tick = Real(ticks.ends[i])
            begin_tick(i, course, flight, pilot, p, log)
            while any_above(p.waiting, half):
                if wp.static(switches):
                    begin_step(flight, p)
                tried = attempt(course, flight, pilot, p, allowed, tick)
                choose_step(course, p, tried)
                if any_above(tried.good, half):
                    locate_end(course, p, tried)
                    log_samples(course, flight, pilot, p, tried, log)
                    accept(i, course, flight, pilot, p, tried)
                settle(course, flight, p, tried, tick)
            if all_above(p.ended, zero):
                break
        log_now(
            course, flight, p, log, push_at(0, p.t, p.y, p.branch.direction, flight, pilot, p.push)
        )
        keep_whole(status, run, p.ended)
        keep_of_run(counts, run, 0, p.taken)
        keep_of_run(counts, run, 1, p.refused)
        keep_of_run(counts, run, 2, p.evaluated)
        keep_of_run(counts, run, 3, p.t)
        keep_of_run(counts, run, 4, p.excess)

    return adaptive
