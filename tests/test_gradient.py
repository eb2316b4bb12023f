"""What `gradient` returns of a flight beside its derivatives, and what it refuses."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.analysis import adjoint
from continuair.analysis.adjoint import OF_STATE
from continuair.vehicle.layout import OF_TIPS
from tests.refusals import refused
from tests.test_hard_flights import released

LIGHT = released(0.0)[0]

PAPER = ca.load_vehicle("paper")
Told = Callable[[xr.Dataset], Any]


def last_tip(flight: xr.Dataset) -> tuple[float, dict[str, np.ndarray]]:
    """Where along x the tip ends [m]."""
    slope = np.zeros(flight.tip_position.shape)
    slope[-1, 0] = 1.0
    return float(flight.tip_position[-1, 0]), {"tip_position": slope}


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:step")
@pytest.mark.parametrize("angle", [0.2, 6.2])
def test_the_flight_is_the_simulated_one_at_the_same_step(angle: float) -> None:
    """And half the step tells its error, of which a large one is warned of."""
    flight = released(angle)[1]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = ca.gradient(LIGHT, flight, last_tip, sample=0.01)
    step = found.trajectory.attrs["step"]
    options: dict[str, Any] = {"sample": 0.01, "variables": [*OF_STATE, *OF_TIPS]}
    simulated = ca.simulate(LIGHT, flight, method="RK4", step=step, **options)
    for name in options["variables"]:
        np.testing.assert_array_equal(found.trajectory[name], simulated[name])
    reference = ca.simulate(LIGHT, flight, rtol=1e-10, **options)
    off = np.linalg.norm(reference.tip_position - simulated.tip_position, axis=-1).max()
    estimate = float(found.trajectory.error_estimate) * LIGHT.reach
    assert 0.5 * off < estimate < 2.0 * off
    assert bool(told) == (estimate > 1e-3 * LIGHT.reach)
    ends = found.times[-1], len(found.inputs["force"])
    assert ends == (flight.duration, len(found.times) - 1)


FALL = open_loop_test("B").replace(duration=0.01)
REFUSED: dict[str, tuple[ca.Vehicle, ca.Scenario, Told, dict[str, Any], str]] = {
    "batch": (PAPER.replace({"uav.mass": [1.0, 2.0]}), FALL, last_tip, {}, "vehicle"),
    "starts": (PAPER, FALL.replace(q=np.zeros((2, 8))), last_tip, {}, "scenario"),
    "tau": (PAPER, FALL.replace(tau=np.zeros(8)), last_tip, {}, "scenario.tau"),
    "loop": (
        PAPER, FALL.replace(controller=ca.hold(PAPER, [0.0, 0.0, 0.0])), last_tip, {},
        "scenario.controller",
    ),
    "model": (PAPER, FALL, last_tip, {"model": "stiff"}, "model"),
    "field": (PAPER, FALL, last_tip, {"fields": ["arm.lenght"]}, "arm.lenght"),
    "text": (PAPER, FALL, last_tip, {"fields": "name"}, "fields"),
    "absent": (
        PAPER, FALL, last_tip, {"fields": ["arm.bending_stiffness"]},
        "fields",
    ),
    "no names": (PAPER, FALL, last_tip, {"fields": 3}, "fields"),
    "vector": (PAPER, FALL, lambda flight: (np.ones(3), {}), {}, "the value of cost"),
    "half a pair": (
        PAPER, FALL, last_tip, {"fields": ["uav.inertia.0.1"]},
        "fields",
    ),
    "value alone": (PAPER, FALL, lambda flight: 1.0, {}, "cost"),
    "no number": (PAPER, FALL, lambda flight: (np.nan, {}), {}, "the value of cost"),
    "unknown": (
        PAPER, FALL, lambda flight: (1.0, {"tip": 0.0}), {}, "cost",
    ),
    "shape": (
        PAPER, FALL, lambda flight: (1.0, {"bend": np.zeros(2)}), {},
        "cost",
    ),
    "full circle": (
        PAPER, FALL.replace(bend_moment=[500.0, 0.0], duration=0.02), last_tip, {},
        "duration",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_has_no_gradient_is_refused_in_a_sentence(case: str) -> None:
    vehicle, flight, told, options, field = REFUSED[case]
    with refused(field):
        ca.gradient(vehicle, flight, told, **options)


@pytest.mark.parametrize("times", [[0.0, 1.234e-3], [0.005, 0.0], [], "start"])
def test_inputs_are_held_from_starts_of_steps_alone(times: Any) -> None:
    found = ca.gradient(PAPER, FALL, last_tip)
    with refused("times"):
        found.held(times)


def test_a_field_that_is_named_twice_counts_once() -> None:
    once = ca.gradient(PAPER, FALL, last_tip, fields=["uav.mass", "arm.length"])
    twice = ca.gradient(PAPER, FALL, last_tip, fields=["uav.mass", "uav.mass", "arm.length"])
    assert once.fields == twice.fields
    assert ca.gradient(PAPER, FALL, last_tip, fields="uav.mass").fields.keys() == {"uav.mass"}


def test_labelled_derivatives_are_taken_by_their_dimensions() -> None:
    """As xarray turns them: three samples of three components fit both ways."""
    fall = FALL.replace(duration=0.02)

    def towards(turned: bool) -> ca.Gradient:
        def cost(flight: xr.Dataset) -> tuple[float, dict[str, Any]]:
            off = flight["tip_position"] - xr.DataArray([1.0, 2.0, 3.0], dims="axis")
            slope = off.transpose("axis", "time") if turned else off.to_numpy()
            return float((0.5 * off**2).sum()), {"tip_position": slope}

        return ca.gradient(PAPER, fall, cost, sample=0.01)

    turned, plain = towards(True), towards(False)
    assert turned.trajectory["tip_position"].shape == (3, 3)
    for name, found in plain.start.items():
        np.testing.assert_array_equal(turned.start[name], found)


def test_a_flight_that_is_swept_in_parts_has_the_same_gradient(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def whole(flight: xr.Dataset) -> tuple[float, dict[str, np.ndarray]]:
        slopes = {name: flight[name].to_numpy() for name in ("tip_velocity", "bend_rate")}
        return sum(0.5 * float((each**2).sum()) for each in slopes.values()), slopes

    together = ca.gradient(PAPER, FALL, whole, fields=["arm.length"])
    monkeypatch.setattr(adjoint, "_AT_ONCE", 3)
    parts = ca.gradient(PAPER, FALL, whole, fields=["arm.length"])
    assert len(parts.times) > 6
    for one, other in zip(
        (*together.inputs.values(), *together.start.values(), together.fields["arm.length"]),
        (*parts.inputs.values(), *parts.start.values(), parts.fields["arm.length"]),
        strict=True,
    ):
        # Sums in another order.
        np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-12 * np.abs(one).max())
