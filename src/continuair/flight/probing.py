"""Whether steps follow the inputs over time that do not tell how fast they are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from continuair import checks
from continuair.engine.engine import Drive
from continuair.errors import InputError
from continuair.flight.inputs import evaluated, field_width, told_rate
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import FIELDS, Layout
from continuair.warning import warn

Array = np.ndarray

BLUR = 0.01
"""Share of its largest value that a component of an input may be off the parabola through a step's
stages: a sine reaches it at six steps per period, which RK4 follows to 4e-4."""

_FELT = 1e-4
"""Share of the largest speed of a rotor by which a step may put it wrong."""

JUMP = 0.3
"""Share of an input's largest value that it may curve by within a step; one that is followed curves
by a hundredth."""

_COUNTS = 1e-4
"""A component of an input counts from this share of the largest one of its unit and arm on."""

_NOISE = 1e-10
"""Share of an input's largest component below which another is but rounding, N and N m alike."""

_WINDOWS = 100
"""Steps that are looked into."""

_HALVINGS = 8
"""An automatic step is halved as often, at most, to follow inputs."""

_RUNGS = 8
"""Steps are looked at as the shorter one of so many to each factor of two, as batches have many;
so what is seen of a run is the same in any batch."""

_ON_RUNG = 1e-6
"""Of a rung, by which rounding may put a step below it."""

INSIDE = 1e-9
"""Share of a step that is left out at both of its ends where it is looked into."""

STAGES = np.array([0.0, 0.5, 1.0])
# Between the stages, and not placed evenly, so that no sine is zero at both of them and at stages.
PROBES = np.array([0.211, 0.727])
# Of the golden section: starts that no period of an input falls in step with.
GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class Blur:
    """How far an input is off what the stages of steps show of it: shares (steps, runs or 1), at
    times (steps,) [s]."""

    field: str
    shares: Array
    times: Array


@dataclass(frozen=True, eq=False)
class Probe:
    """Looks into the inputs of a scenario over a time [s], at each step's length once."""

    scenario: Scenario
    layout: Layout
    duration: float
    _known: dict[float, list[Blur]] = field(default_factory=dict)

    def following_step(self, longest: float) -> Array:
        """The longest step (runs or 1,) [s], of halves of the longest, that follows a run's inputs.

        The longest itself where no half does. It depends on no other run of a batch.
        """
        found = np.full(1, np.nan)
        for halvings in range(_HALVINGS + 1):
            step = longest / 2**halvings
            blurred = [each.shares.max(axis=0) for each in self.blurs(step)]
            share = np.max(np.broadcast_arrays(*blurred), axis=0) if blurred else np.zeros(1)
            found = np.array(np.broadcast_to(found, np.broadcast_shapes(found.shape, share.shape)))
            found[np.isnan(found) & (share <= BLUR)] = step
            if not np.isnan(found).any():
                break
        return np.where(np.isnan(found), longest, found)

    def missed(self, steps: Array) -> Array:
        """Whether the step (runs,) [s] of a run misses what its inputs do."""
        found = np.zeros(len(steps), bool)
        for step, of in _rungs(steps):
            for blur in self.blurs(step):
                found |= of & (blur.shares.max(axis=0) > BLUR)
        return found

    def felt(self, name: str, steps: Array, rates: Any) -> Array:
        """Whether what the stages of steps (runs,) [s] do not show of an input moves what follows
        it, with a lag of first order at rates (runs or 1) [1/s], by more than nothing."""
        found = np.zeros(len(steps), bool)
        if callable(getattr(self.scenario, name)):
            for step, of in _rungs(steps):
                for blur in self.blurs(step):
                    if blur.field == name:
                        moved = blur.shares.max(axis=0) * steps * np.asarray(rates)
                        found |= of & (moved > _FELT)
        return found

    def warn_of_blur(self, steps: Array, stacklevel: int) -> None:
        """Warn if a run's step (runs,) [s] does not follow its inputs."""
        worst = None
        for step, whose in _rungs(steps):
            for blur in self.blurs(step):
                of = whose if blur.shares.shape[1] > 1 else slice(None)
                shares = blur.shares[:, of].max(axis=1)
                at = int(np.argmax(shares))
                if shares[at] > max(BLUR, worst[0] if worst else 0.0):
                    taken = float(steps[whose].min())
                    worst = float(shares[at]), blur.field, taken, float(blur.times[at])
        if worst is not None:
            share, name, step, time = worst
            warn_of_unseen(name, share, step, time, stacklevel + 1)

    def blurs(self, step: float) -> list[Blur]:
        """The blur of every input that does not tell how fast it is, in steps spread over time."""
        step = float(_rung(step))
        if step not in self._known:
            self._known[step] = self._looked(step)
        return self._known[step]

    def _looked(self, step: float) -> list[Blur]:
        starts, widths = self._windows(min(step, self.duration))
        found = []
        for name in FIELDS:
            value = getattr(self.scenario, name)
            # An input that tells its fastest rate is resolved by the automatic step.
            if not callable(value) or told_rate(value) is not None:
                continue
            try:
                shares = _blur_of(name, value, self.layout, starts, widths)
            except checks.UnsteadyInput:
                raise
            except InputError:
                # The flight samples it in order, and tells where it fails first, if it does there.
                continue
            found.append(Blur(name, shares, starts + widths / 2.0))
        return found

    def _windows(self, width: float) -> tuple[Array, Array]:
        """Starts and widths of the steps that are looked into; none reaches over a jump."""
        starts = (self.duration - width) * (GOLDEN * np.arange(1, _WINDOWS + 1) % 1.0)
        breaks = np.union1d(self.scenario.jumps, self.scenario.knots)
        edges = np.concatenate([[0.0], breaks[breaks < self.duration], [self.duration]])
        piece = np.clip(np.searchsorted(edges, starts, side="right"), 1, len(edges) - 1)
        ends = np.minimum(starts + width, edges[piece])
        begins = np.maximum(ends - width, edges[piece - 1])
        # Just inside: at a jump itself the input is that of one side or the other.
        inside = INSIDE * (ends - begins)
        return begins + inside, ends - begins - 2.0 * inside


def _rung(step: Any) -> Any:
    """The longest length [s] of those that steps are looked at that is no longer than a step."""
    return 2.0 ** (np.floor(_RUNGS * np.log2(step) + _ON_RUNG) / _RUNGS)


def _rungs(steps: Array) -> Iterator[tuple[float, Array]]:
    """Lengths [s] at which steps (runs,) [s] are looked at, the longest last, and whose each is."""
    lengths = _rung(steps)
    for length in np.unique(lengths):
        yield float(length), lengths == length


def warn_of_unseen(name: str, share: float, step: float, time: float, stacklevel: int) -> None:
    """Warn of an input that is a share of its largest value off what steps [s] see near a time."""
    warn(
        f"{name} changes within steps of {step:.3g} s: near t = {time:.4g} s it is "
        f"{100.0 * share:.2g} % of its largest value off what the steps see of it; give a "
        "shorter step, or name the times at which it jumps in jumps.",
        stacklevel=stacklevel,
    )


def warn_of_jumps(
    drive: Drive, starts: Array, layout: Layout, told: set[str], stacklevel: int
) -> None:
    """Warn if an input over time jumps within a step; starts: of the steps [s].

    told: names of inputs that have been told of, which are not again; those found are added.
    """
    if not drive.timed:
        return
    stages = drive.table.reshape(len(starts), 3, *drive.table.shape[1:])
    acts = np.asarray(np.any(drive.table, axis=(0, 1)))
    for name, where in layout.of_input.items():
        if not acts[where].any():
            continue
        own = stages[..., where]
        curved = np.abs(own[:, 0] - 2.0 * own[:, 1] + own[:, 2])
        whole = largest(np.abs(own).max(axis=(0, 1)), layout.alike([name]))
        share = (curved / whole).max(axis=(1, 2))
        at = int(np.argmax(share))
        if share[at] > JUMP and name not in told:
            told.add(name)
            warn(
                f"{name} jumps within a step near t = {starts[at]:.3g} s, which costs the steps "
                "their order; name the time of the jump in jumps, or smooth it.",
                stacklevel=stacklevel,
            )
            return


def _blur_of(name: str, value: Any, layout: Layout, starts: Array, widths: Array) -> Array:
    """Share (starts, runs or 1) that an input is off the parabola through the stages of steps."""
    size, alike = field_width(name, layout), layout.alike(FIELDS[name])
    stages, probes = (
        evaluated(name, value, (starts[:, None] + widths[:, None] * at).ravel(), size)
        for at in (STAGES, PROBES)
    )
    stages, probes = (x.reshape(len(starts), -1, *x.shape[1:]) for x in (stages, probes))
    off = np.abs(probes - np.einsum("sp,nsrk->nprk", of_stages(PROBES), stages)).max(axis=1)
    whole = np.maximum(*(np.abs(x).max(axis=(0, 1)) for x in (stages, probes)))
    return np.asarray((off / largest(whole, alike)).max(axis=-1))


def of_stages(at: Array) -> Array:
    """Weights (3, places) of a step's stages in the parabola through them, at places within it."""
    return np.stack([(2 * at - 1) * (at - 1), 4 * at * (1 - at), at * (2 * at - 1)])


def largest(of_components: Array, alike: list[slice]) -> Array:
    """The largest value of each component (runs or 1, components), inf for one that is too small.

    alike: those of one unit and arm. Each by itself: a fast moment is not hidden by a steady force
    beside it, nor the moment on a short arm by the weight.
    """
    counts = of_components > _NOISE * of_components.max(axis=-1, keepdims=True)
    for kind in alike:
        own = of_components[..., kind]
        counts[..., kind] &= own > _COUNTS * own.max(axis=-1, keepdims=True)
    return np.where(counts, of_components, np.inf)
