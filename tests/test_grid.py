"""The time grid: steps end at jumps, and see the inputs of their own side only."""

import numpy as np

from continuair.flight.time_grid import grid_of, marks_of, stage_times


def test_every_stage_lies_on_its_steps_own_side_of_a_jump() -> None:
    """Sums of start and step would round past some of these jumps."""
    jumps = 2e-3 * np.arange(1, 500)
    grid = grid_of(marks_of(1.0, 2e-3, jumps), 7e-4)
    first, _, last = stage_times(grid).reshape(-1, 3).T
    assert grid.opens.sum() == grid.closes.sum() == len(jumps)
    assert (first[grid.opens] > jumps).all()
    assert (last[grid.closes] < jumps).all()
    np.testing.assert_allclose(last, grid.starts + grid.steps, rtol=0, atol=3e-15)
