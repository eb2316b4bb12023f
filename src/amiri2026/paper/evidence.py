"""Evidence for the sentences of the paper: studies, each run when a sentence first needs it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from operator import attrgetter
from typing import Any

from amiri2026.cost import cost
from amiri2026.open_loop.study import OpenLoop, open_loop
from amiri2026.paper.drawn import Drawn, fly_drawn
from amiri2026.paper.theorem import Theorem, fly_theorem
from amiri2026.sensitivity.once import sweep_once
from amiri2026.sensitivity.study import Sensitivity, sensitivity
from amiri2026.table.reading import Reading
from amiri2026.table.study import Flown, fly_tests, table1
from amiri2026.tracking.law_variants import law_variants
from amiri2026.tracking.study import Tracking, tracking
from continuair import Vehicle, load_gains
from continuair.errors import InputError
from continuair.kernels import PLANTS
from continuair.progress import Progress
from continuair.vehicle import as_rod, check_one_section
from continuair.warning import warn

Keep = Callable[[str, Any], None]
"""Called with a study's name and result once it has run."""


_IDEAL = {
    "uav.rotors": None,
    "uav.drag": None,
    "arm.drag_coefficient": None,
    "camera.noise": 0.0,
    "camera.frame_rate": 0.0,
    "camera.latency": 0.0,
}
"""The paper's vehicle, whose forces act directly, which no air drags, and whose camera sees at once
what is there."""


class NotFlown(Exception):
    """The evidence for a sentence is left out of a quick run."""


class CannotBeFlown(Exception):
    """The vehicle cannot be simulated for a sentence, for a reason in a sentence."""


class Evidence:
    """Studies of a vehicle; each runs once, when it is first read.

    vehicle: modified as in the paper, without rotors and drag and with a perfect camera, with a
    note. quick: without the second reading of f, the settings but the nominal one and the letters
    but M; missing evidence raises NotFlown. progress: called with (done, total, what) by each
    study. keep: called with its name and result when one has run. before_timing: called before
    times are measured, to end other work. Raises InputError for a batched vehicle, and for one
    without a radius.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        *,
        quick: bool = False,
        progress: Progress | None = None,
        keep: Keep | None = None,
        before_timing: Callable[[], None] | None = None,
    ) -> None:
        self.vehicle, self.quick = _as_in_the_paper(vehicle), quick
        self._progress, self._keep, self._before_timing = progress, keep, before_timing
        self._printed: dict[tuple[Any, ...], Flown] = {}
        self._swept: dict[tuple[Any, ...], dict[str, Any]] = {}

    @cached_property
    def table(self) -> dict[str, Any]:
        """Table I beside that of the preset `table1`, with one choice changed at a time."""
        return self._kept("table", table1(progress=self._progress))

    def printed(self, vehicle: Vehicle, reading: Reading) -> Flown:
        """Return Tests A to D of the model as printed; flights are kept by name and dynamics."""
        key = (vehicle.name, *reading.dynamics)
        if key not in self._printed:
            self._printed[key] = fly_tests(vehicle, reading)
        return self._printed[key]

    @cached_property
    def open_loop(self) -> OpenLoop:
        """Tests A to D."""
        return self._kept("open_loop", open_loop(self.vehicle, progress=self._progress))

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """The six sweeps with the printed sin(f t)."""
        return self._kept("sensitivity", sensitivity(self.vehicle, progress=self._progress))

    @cached_property
    def sensitivity_hertz(self) -> Sensitivity:
        """The six sweeps with f in Hz, sin(2π f t)."""
        if self.quick:
            raise NotFlown("the sweeps with sin(2π f t)")
        found = sensitivity(self.vehicle, hertz=True, progress=self._progress)
        return self._kept("sensitivity_hertz", found)

    def swept(
        self, vehicle: Vehicle, name: str, *, hertz: bool = False, straight: bool = False
    ) -> dict[str, Any]:
        """Return a sweep of another vehicle, as `sweep_once` has it; kept by these arguments."""
        key = (vehicle.name, name, hertz, straight)
        if key not in self._swept:
            self._swept[key] = sweep_once(vehicle, name, hertz=hertz, straight=straight)
        return self._swept[key]

    @cached_property
    def tracking(self) -> Tracking:
        """The four letters in three settings, and variants of the law on letter M."""
        if self.quick:
            raise NotFlown("the four letters in all settings")
        gains = load_gains("paper")
        found = _flown(tracking, self.vehicle, gains=gains, progress=self._progress)
        found.results["variants"] = law_variants(self.vehicle, gains, progress=self._progress)
        return self._kept("tracking", found)

    @cached_property
    def letter(self) -> Tracking:
        """Letter M in the nominal setting."""
        if not self.quick:
            return self.tracking
        found = _flown(tracking, self.vehicle, "M", settings=["nominal"], progress=self._progress)
        return self._kept("tracking", found)

    @cached_property
    def cost(self) -> dict[str, Any]:
        """Time per sample of the coupled and the decoupled model, on this machine."""
        if self._before_timing is not None:
            self._before_timing()
        # The paper times these two alone, and each model takes seconds to compile.
        return self._kept(
            "cost", _flown(cost, self.vehicle, models=PLANTS, progress=self._progress)
        )

    @cached_property
    def drawn(self) -> Drawn:
        """Tests A to D with random vehicles within the paper's unstated parameters."""
        return fly_drawn(self.vehicle)

    @cached_property
    def theorem(self) -> Theorem:
        """Flights with gains that fulfil Theorem 1."""
        return _flown(fly_theorem, self.vehicle)

    def _kept(self, name: str, found: Any) -> Any:
        if self._keep is not None:
            self._keep(name, found)
        return found


def _flown(fly: Callable[..., Any], *of: Any, **how: Any) -> Any:
    """Return the result of a study; raises CannotBeFlown if it refuses the vehicle."""
    try:
        return fly(*of, **how)
    except InputError as error:
        raise CannotBeFlown(str(error).rstrip(".")) from None


def _as_in_the_paper(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle as sentences are about it: of one section, a round rod, and _IDEAL."""
    rod = as_rod(check_one_section(vehicle))
    other = [name for name, value in _IDEAL.items() if attrgetter(name)(rod) != value]
    if other:
        warn(
            f"sentences of the paper are judged without {', '.join(other)}: its forces act "
            "directly, air does not drag it, and its camera is perfect.",
            stacklevel=3,
        )
    return rod.replace(_IDEAL)
