"""The time grid: steps end at jumps, and see the inputs of their own side only."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.flight.time_grid import grid_of, instants_at, marks_of, stage_times

METHODS: tuple[dict[str, Any], ...] = (
    {},
    {"method": "RK4", "step": "auto"},
    {"method": "implicit", "step": "auto"},
)


def test_every_stage_lies_on_its_steps_own_side_of_a_jump() -> None:
    """Sums of start and step would round past some of these jumps."""
    jumps = 2e-3 * np.arange(1, 500)
    grid = grid_of(marks_of(1.0, 2e-3, jumps), 7e-4)
    first, _, last = stage_times(grid).reshape(-1, 3).T
    assert grid.opens.sum() == grid.closes.sum() == len(jumps) + 1  # start and end are jumps, too
    assert (first[grid.opens] > [0.0, *jumps]).all()
    assert (last[grid.closes] < [*jumps, 1.0]).all()
    ends, closes = grid.starts + grid.steps, grid.closes
    np.testing.assert_allclose(last[~closes], ends[~closes], rtol=0, atol=3e-15)
    np.testing.assert_allclose(last[closes], ends[closes], rtol=2e-9, atol=0)


@pytest.mark.parametrize("period", [0.01, 0.02, 0.07])
def test_what_is_held_from_jump_to_jump_is_so_at_every_stage(period: float) -> None:
    """int(t / period) changes a last digit beside some of the jumps, on either side."""
    jumps = period * np.arange(1, round(7.0 / period))
    grid = grid_of(marks_of(7.0, 0.01, jumps), 3e-3)
    held = (stage_times(grid) / period).astype(int).reshape(-1, 3)
    assert (jumps / period).astype(int).tolist() != list(range(1, len(jumps) + 1))
    middle = ((grid.starts + 0.5 * grid.steps) / period).astype(int)
    np.testing.assert_array_equal(held, np.repeat(middle[:, None], 3, axis=1))


@pytest.mark.slow
def test_what_is_held_flies_as_the_same_by_its_jumps() -> None:
    """By all methods: a force that int(t / period) looks up in a list."""
    vehicle, period = ca.load_vehicle("paper"), 0.07
    jumps = period * np.arange(1, 20)
    forces = np.random.default_rng(0).uniform(0.0, 50.0, (20, 3))
    held, by_jumps = (
        ca.Scenario(
            "held", [0, 0, 3, 0, 0, 0, 0.1, 0], force=force, jumps=tuple(jumps), duration=1.35
        )
        for force in (
            lambda t: forces[int(t / period)],
            lambda t: forces[np.searchsorted(jumps, t, side="right")],
        )
    )
    for given in METHODS:
        one, other = (ca.simulate(vehicle, each, sample=0.01, **given) for each in (held, by_jumps))
        xr.testing.assert_equal(one, other)


def test_what_an_input_is_at_start_and_end_alone_moves_nothing() -> None:
    """By all methods and as a Simulation: a force of another value there."""
    vehicle, end = ca.load_vehicle("paper"), 0.05
    forces = (
        lambda t: [1.0, 0.0, 26.0],
        lambda t: [1.0 if 0.0 < t < end else 50.0, 0.0, 26.0],
    )
    start = [0, 0, 3, 0, 0, 0, 0.1, 0]
    smooth, beyond = (ca.Scenario("push", start, force=f, duration=end) for f in forces)
    for given in METHODS:
        one, other = (
            ca.simulate(vehicle, each, variables=["position", "attitude", "bend"], **given)
            for each in (smooth, beyond)
        )
        xr.testing.assert_equal(one, other)
    sims = [ca.Simulation(vehicle, each, control_period=0.01) for each in (smooth, beyond)]
    for sim in sims:
        sim.step()
    np.testing.assert_array_equal(sims[0].state, sims[1].state)


@pytest.mark.parametrize("sample", [1e-3, 7e-4, 1e-5])
@pytest.mark.parametrize("pieces", [1, 2, 7])
def test_every_interval_takes_as_many_steps_as_the_first(sample: float, pieces: int) -> None:
    """Late samples are apart by a sample to rounding only, which is no reason for another step."""
    grid = grid_of(marks_of(20_000 * sample, sample), sample / pieces)
    assert len(grid.steps) == 20_000 * pieces


def test_a_jump_a_digit_beside_a_sample_leaves_the_samples_where_they_are() -> None:
    times = [marks_of(1.0, 0.1, jumps).samples for jumps in ((), (0.3, 0.7), (0.3 + 1e-15,))]
    assert times[0].tolist() == times[1].tolist() == times[2].tolist()


@pytest.mark.parametrize("off", [0.0, 1e-15, 1.5e-9, -3e-9])
def test_a_jump_beside_a_control_instant_makes_no_other(off: float) -> None:
    """As np.float32(0.1) is 1.5e-9 s beside 0.1: a law that sums up, or waits, acts there once."""
    jumps = 0.1 * np.arange(1, 20) + off
    grid = grid_of(marks_of(2.0, 0.05, jumps, 0.01, 0.003), 1e-2)
    counted = instants_at(grid, 0.01), instants_at(grid, 0.01, 0.003)
    for found in counted:
        assert found[found >= 0].tolist() == list(range(200))


@pytest.mark.parametrize("duration", [5.0, 20.0, 60.0])
@pytest.mark.parametrize(
    ("rate", "sample"),
    [(333.3333, 1e-3), (333.33333, 7e-4), (166.6667, 1e-3), (250.0, float(np.float32(0.01)))],
)
def test_a_law_of_a_rounded_rate_or_samples_acts_once_an_instant(
    rate: float, sample: float, duration: float
) -> None:
    """Samples and instants drift apart through all that rounding tells from another."""
    grid = grid_of(marks_of(duration, sample, (), 1.0 / rate), 1e-2)
    found = instants_at(grid, 1.0 / rate)
    assert found[found >= 0].tolist() == list(range(int(np.ceil(duration * rate - 1e-9))))
