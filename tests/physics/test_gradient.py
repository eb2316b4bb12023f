"""Gradients against differences of simulated flights, and derivatives carried forward."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.analysis.adjoint import OF_STATE, flown, of_rotation, sweep
from continuair.analysis.linear import _perturbed
from continuair.engine import tangents as packing
from continuair.engine.engine import Start
from continuair.engine.pack import pack_table
from continuair.engine.slopes import Slopes
from continuair.engine.tangents import tangents_of
from continuair.flight.prepare import prepare
from continuair.flight.rollout import fly
from continuair.flight.trajectory import OF_SECTION, OF_STRAIN
from continuair.vehicle.layout import GENERAL, OF_TIPS, TIP
from tests.sections.strains import flying, rod

Array = np.ndarray

PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
"""Central differences of fourth order."""

STEP = 5e-4
NAMES = OF_STATE + OF_TIPS
PAPER = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
DUAL = ca.load_vehicle("dual_arm")
TWO = ca.load_vehicle("two_section")
DISK = {"position": 0.2, "mass": 0.02, "inertia": (2e-6, 4e-6)}
STRAINED = flying(
    rod(bending=1, twist=0, nodes=5, damping_ratio=0.02, disks=[DISK]), rod(damping_ratio=0.02)
)
INPUTS = ("force", "moment", "bend_moment", "tip_wrench")

OF_ARM = ("length", "radius", "density", "youngs_modulus", "damping_ratio")
FIELDS: dict[str, tuple[str, ...]] = {
    "paper": ("uav.mass", "uav.inertia", "uav.mount", *(f"arm.{name}" for name in OF_ARM)),
    "dual_arm": (
        "uav.mass", "arm.left.mount", "arm.left.attitude", "arm.right.section.0.length",
        "arm.right.section.0.disks.0.mass", "arm.left.section.0.density",
    ),
    "strained": (
        "arm.0.mount", "arm.0.section.0.disks.0.position",
        *(f"arm.0.section.0.{name}" for name in (*OF_ARM, "poisson_ratio")),
        "arm.0.section.1.length",
    ),
    "two_section": (
        "uav.inertia", "arm.arm.section.base.length", "arm.arm.section.tip.youngs_modulus",
        "arm.arm.section.base.disks.1.position", "arm.arm.tip.mass", "arm.arm.tip.centre",
        "arm.arm.tip.inertia", "arm.arm.section.tip.damping_ratio",
    ),
}  # fmt: skip

slow = pytest.mark.soak
# Each vehicle and model is a kernel of its own, which takes a quarter of a minute to compile.
CASES = [
    pytest.param(PAPER, "coupled", 0.0, 1, id="straight, one step"),
    pytest.param(PAPER, "coupled", 0.0, 2, id="straight, two steps"),
    pytest.param(PAPER, "coupled", 0.8, 200, id="bent"),
    pytest.param(DUAL, "coupled", 0.0, 20, id="two straight arms"),
    pytest.param(STRAINED, "coupled", 0.8, 20, id="strain beside an arc"),
    pytest.param(STRAINED, "independent", 0.8, 20, id="strain, independent", marks=slow),
    pytest.param(PAPER, "independent", 0.0, 60, id="independent, straight", marks=slow),
    pytest.param(PAPER, "independent", 0.8, 60, id="independent, bent", marks=slow),
    pytest.param(PAPER, "decoupled", 0.8, 60, id="decoupled", marks=slow),
    pytest.param(DUAL, "decoupled", 0.8, 20, id="two arms, decoupled", marks=slow),
    pytest.param(TWO, "coupled", 0.8, 20, id="two sections", marks=slow),
    pytest.param(TWO, "independent", 0.0, 20, id="two sections, independent", marks=slow),
]


def names_of(vehicle: ca.Vehicle) -> tuple[str, ...]:
    """The names of what a cost may hold, of a vehicle's sections."""
    renamed = dict(zip(OF_SECTION, OF_STRAIN, strict=True)) if vehicle.layout.strains else {}
    return tuple(renamed.get(name, name) for name in NAMES)


def scenario(vehicle: ca.Vehicle, kappa: float, steps: int, **changes: Any) -> ca.Scenario:
    """A flight that turns, moves and bends, under all inputs; kappa: of every section [1/m]."""
    layout = vehicle.layout
    rng = np.random.default_rng(3)
    q, qd = rng.uniform(-0.4, 0.4, (2, layout.coordinates))
    q[6::2] = kappa
    widths = {"force": 3, "moment": 3, "bend_moment": layout.bends, "tip_wrench": 6 * layout.arms}
    acting = {
        name: 0.05 * force_of(vehicle, name) * rng.normal(size=width)
        for name, width in widths.items()
    }
    return ca.Scenario("turning", q, qd, duration=steps * STEP, **(acting | changes))


def force_of(vehicle: ca.Vehicle, name: str) -> float:
    """A size of an input [N, N m or N m²], of those on the arms one that bends them by 1 1/m."""
    softest = min(each.bending_stiffness for arm in vehicle.arms for each in arm.section)
    return {"force": 1.0, "moment": 1.0, "bend_moment": softest, "tip_wrench": softest}[name]


def cost(flight: xr.Dataset) -> tuple[Any, dict[str, Array]]:
    """Σ c x + x²/2 over all that a cost may hold, c random; of each run of a batch."""
    value, slopes = 0.0, {}
    for name in (each for each in (*NAMES, *OF_STRAIN) if each in flight):
        x = flight[name].transpose(..., "run") if "run" in flight.dims else flight[name]
        shape = x.shape[: x.ndim - ("run" in flight.dims)]
        c = np.random.default_rng(len(name)).normal(size=shape)
        c = c.reshape(*c.shape, *(1,) * (x.ndim - c.ndim))
        every = tuple(range(c.ndim - (x.ndim > len(shape))))
        value = value + (c * x.to_numpy() + 0.5 * x.to_numpy() ** 2).sum(axis=every)
        slopes[name] = c + x.to_numpy()
    return value, slopes


def differences(values: Callable[[Array], Array], directions: int, size: float) -> Array:
    """Derivatives (directions,) from values (runs,) of runs moved by (runs, directions)."""
    moved = size * np.einsum("p,de->dpe", PLACES, np.eye(directions)).reshape(-1, directions)
    return np.asarray(values(moved).reshape(directions, -1) @ WEIGHTS / size)


def assert_close(found: Array, expected: Array) -> None:
    """To 1e-6 of the largest of the derivatives beside each other."""
    np.testing.assert_allclose(
        np.ravel(found), np.ravel(expected), rtol=0, atol=1e-6 * np.abs(expected).max()
    )


@pytest.mark.long
@pytest.mark.parametrize(("vehicle", "model", "kappa", "steps"), CASES)
def test_the_start_inputs_and_fields_have_the_slopes_of_simulated_costs(
    vehicle: ca.Vehicle, model: str, kappa: float, steps: int
) -> None:
    flight = scenario(vehicle, kappa, steps)
    options: dict[str, Any] = {"model": model, "step": STEP, "sample": STEP}
    fields = FIELDS[vehicle.name]
    found = ca.gradient(vehicle, flight, cost, fields=fields, **options)
    options |= {"method": "RK4", "variables": names_of(vehicle)}
    assert found.value == cost(ca.simulate(vehicle, flight, **options))[0]

    for name, slopes in of_starts(vehicle, flight, model).items():
        assert_close(found.start[name], slopes)
    for name in INPUTS:
        given = np.asarray(getattr(flight, name))

        def pushed(moved: Array, name: str = name, given: Array = given) -> Array:
            batch = flight.replace(**{name: given + moved})
            return np.asarray(cost(ca.simulate(vehicle, batch, **options))[0])

        size = 1e-2 * force_of(vehicle, name)
        assert_close(found.inputs[name].sum(axis=0), differences(pushed, len(given), size))
    for name in fields:
        assert_close(found.fields[name], of_field(vehicle, flight, name, options))


def of_starts(vehicle: ca.Vehicle, flight: ca.Scenario, model: str) -> dict[str, Array]:
    """Differences of costs as the state at the start moves, by the parts of a Gradient."""
    prepared = prepare(vehicle, flight, step=STEP, sample=STEP, strain=True)
    layout, size = prepared.coupled.layout, 1e-3
    centre, width = prepared.start.states[0], 2 * layout.coordinates
    states = np.array([_perturbed(centre, i, size * h) for i in range(width) for h in PLACES])
    runs = len(states)
    start = Start(states, np.tile(prepared.start.angle, (runs, 1)))
    moved = dataclasses.replace(
        prepared, start=start, runs=runs, batched=True, steps=np.full(runs, STEP)
    )
    values = cost(fly(moved, model, names_of(vehicle)))[0].reshape(width, -1) @ WEIGHTS / size
    ends = np.cumsum([3, 3, layout.bends, 3, 3, layout.bends])[:-1]
    bend, bend_rate = OF_STRAIN if layout.strains else OF_SECTION
    parts = ("position", "rotation", bend, "velocity", "angular_velocity", bend_rate)
    return dict(zip(parts, np.split(values, ends), strict=True))


def of_field(vehicle: ca.Vehicle, flight: ca.Scenario, name: str, options: dict[str, Any]) -> Array:
    """Differences of costs as each entry of a field moves; entries of a matrix move in pairs."""
    value = np.asarray(value_at(vehicle, name), float)
    # Quaternions are read with a norm of 1 to 1e-3.
    size = (2e-4 if name.endswith("attitude") else 1e-3) * (np.abs(value).max() or 1.0)
    found = np.zeros(value.shape)
    for entry in np.ndindex(value.shape):
        moved = np.zeros(value.shape)
        moved[entry] += 0.5
        moved[entry[::-1]] += 0.5
        batch = vehicle.replace({name: value + size * np.multiply.outer(PLACES, moved)})
        values = cost(ca.simulate(batch, flight, **options))[0]
        found[entry] = values @ WEIGHTS / size
    return found


def value_at(vehicle: ca.Vehicle, path: str) -> Any:
    """What a vehicle holds at a dotted name."""
    node: Any = vehicle.describe()
    for key in path.split("."):
        if isinstance(node, list):
            named = [each.get("name") if isinstance(each, dict) else None for each in node]
            node = node[named.index(key) if key in named else int(key)]
        else:
            node = node[key]
    return node


def test_inputs_held_over_some_steps_have_the_slopes_of_simulated_costs() -> None:
    knots, period = np.array([0.0, 0.004, 0.01]), 0.02
    given = np.array([[0.02, -0.01], [-0.03, 0.02], [0.01, 0.04]])

    def held(values: Array) -> ca.Scenario:
        def at(t: float) -> Array:
            return np.asarray(values[..., np.searchsorted(knots, t, side="right") - 1, :])

        return scenario(PAPER, 0.5, round(period / STEP), bend_moment=at, jumps=tuple(knots[1:]))

    def pushed(moved: Array) -> Array:
        batch = held(given + moved.reshape(-1, *given.shape))
        flown = ca.simulate(PAPER, batch, method="RK4", step=STEP, sample=STEP, variables=NAMES)
        return np.asarray(cost(flown)[0])

    found = ca.gradient(PAPER, held(given), cost, step=STEP, sample=STEP)
    assert_close(found.held(knots)["bend_moment"], differences(pushed, given.size, 1e-2))


@pytest.mark.long
@pytest.mark.targets
def test_a_disk_at_the_end_of_its_section_has_the_slope_of_moving_it_inwards() -> None:
    name = "arm.right.section.0.disks.0.position"
    flight, end = scenario(DUAL, 0.0, 20), float(value_at(DUAL, name))

    def moved(by: float) -> float:
        vehicle = DUAL.replace({name: end - by})
        flown = ca.simulate(vehicle, flight, method="RK4", step=STEP, sample=STEP, variables=NAMES)
        return float(cost(flown)[0])

    found = ca.gradient(DUAL, flight, cost, fields=[name], step=STEP, sample=STEP)
    size = 1e-4
    ahead = np.array([moved(n * size) for n in range(5)])
    expected = -ahead @ np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / (12.0 * size)
    assert found.fields[name] == pytest.approx(expected, rel=1e-6)


def test_slopes_of_a_vehicle_stand_the_rounding_of_any_processor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sums of another order are off by some last bits of the largest number of a column."""
    names = ("arm.right.section.0.disks.0.position", "arm.right.section.0.length", "uav.mass")
    Plant = prepare(DUAL, scenario(DUAL, 0.0, 20)).engine("coupled").kernels.types.Plant
    expected = tangents_of(DUAL, names, Plant)
    rng, exact = np.random.default_rng(7), pack_table

    def rounded(vehicle: ca.Vehicle, threads: int) -> Array:
        table = exact(vehicle, threads)
        noise = rng.uniform(-4e-16, 4e-16, table.shape)
        return table + noise * np.abs(table).max(axis=1, keepdims=True)

    monkeypatch.setattr(packing, "pack_table", rounded)
    found = [tangents_of(DUAL, names, Plant) for _ in range(5)]
    largest = np.maximum(np.abs(expected.table), np.abs(exact(DUAL, 1))).max(axis=1, keepdims=True)
    for each in found:
        assert (np.abs(each.table - expected.table) <= 1e-8 * largest).all()
        np.testing.assert_allclose(each.plants, expected.plants, rtol=1e-8, atol=1e-11)


def test_a_wrench_that_acts_reversed_has_the_opposite_slope() -> None:
    flight = scenario(PAPER, 0.5, 4, tip_wrench=None)
    slopes = [
        ca.gradient(PAPER, flight.replace(tip_wrench_sign=sign), cost, step=STEP, sample=STEP)
        for sign in (1, -1)
    ]
    ahead, reversed_ = (each.inputs["tip_wrench"] for each in slopes)
    np.testing.assert_array_equal(ahead, -reversed_)
    assert np.abs(ahead).max() > 0.0


@pytest.mark.parametrize("kappa", [0.0, 0.8])
def test_the_sweep_back_is_the_transpose_of_the_derivatives_carried_forward(kappa: float) -> None:
    """⟨cost, J x⟩ = ⟨Jᵀ cost, x⟩ for a random change x of start, inputs and fields."""
    flight = flown(prepare(PAPER, scenario(PAPER, kappa, 40), step=STEP, sample=STEP), "coupled")
    engine, rng = flight.cohort.flight.engine("coupled"), np.random.default_rng(1)
    tangents = tangents_of(PAPER, FIELDS["paper"], engine.kernels.types.Plant)
    slopes, grid, layout = Slopes(engine, tangents), flight.cohort.grid, engine.layout
    steps = len(grid.steps)
    drive = dataclasses.replace(flight.cohort.drive, groups=GENERAL + TIP)
    rows = slopes.of_steps(grid, drive, flight.log, slice(0, steps))
    weights = rng.normal(size=(steps + 1, layout.state))
    moved = [rng.normal(size=layout.state)]
    pushed, changed = rng.normal(size=(steps, layout.inputs)), rng.normal(size=len(tangents.plants))
    for row, push in zip(rows, pushed, strict=True):
        along = np.concatenate([push, moved[-1], changed])
        moved.append(along @ row)
    told = {name: weights[:, getattr(layout, name)] for name in OF_STATE if name != "velocity"}
    weights[:, layout.velocity] = 0.0
    swept = sweep(flight, tangents, told)
    forward = sum(w @ y for w, y in zip(weights, moved, strict=True))
    back = swept.state @ moved[0] + (swept.inputs * pushed).sum() + swept.fields @ changed
    assert back == pytest.approx(forward, rel=1e-12)


def test_a_quaternions_own_length_has_no_part_in_the_slope_of_a_rotation() -> None:
    attitude = np.array([0.1, -0.5, 0.3, 0.8]) / np.sqrt(0.99)
    assert np.abs(of_rotation(attitude, 7.0 * attitude)).max() < 1e-15


def listed(**changes: Any) -> ca.Vehicle:
    """A light arm of one section in a list, straight down, with a disk at its end."""
    section: dict[str, Any] = {
        "length": 0.3,
        "mass_per_length": 0.01,
        "bending_stiffness": 0.02,
    }
    section |= {"damping_ratio": 0.3, "disks": [{"position": 0.3, "mass": 0.002}]}
    uav = {"mass": 0.5, "inertia": [0.002, 0.002, 0.003]}
    return ca.Vehicle(name="light", uav=uav, arm=[{"section": [section]}]).replace(changes)


def slopes_of_the_light_arm(
    path: str, values: Array, step: float, weights: Array
) -> tuple[Array, float]:
    """What `gradient` says of a field, and differences of flights at its values."""
    flight = scenario(listed(), 0.8, 20)
    options: dict[str, Any] = {"step": STEP, "sample": STEP}
    found = ca.gradient(listed(), flight, cost, fields=[path], **options)
    flown = ca.simulate(listed(**{path: values}), flight, method="RK4", **options)
    return found.fields[path], float(cost(flown)[0] @ weights / step)


@pytest.mark.long
def test_arms_that_are_not_turned_have_slopes_of_their_attitudes() -> None:
    """Their kernels leave the turn out."""
    step = 1e-4
    turns = [[0.0, x, 0.0, np.sqrt(1.0 - x * x)] for x in step * PLACES]
    found, expected = slopes_of_the_light_arm("arm.0.attitude", np.array(turns), step, WEIGHTS)
    assert found[1] == pytest.approx(expected, rel=1e-6)


def test_fields_that_are_zero_have_slopes_on_the_scale_on_which_they_count() -> None:
    """Damping of a ratio goes with the root of an inertia that is far below 1 kg m²."""
    step = 1e-8
    weights = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
    path = "arm.0.section.0.disks.0.inertia.0"
    found, expected = slopes_of_the_light_arm(path, step * np.arange(5.0), step, weights)
    assert found == pytest.approx(expected, rel=1e-5)
