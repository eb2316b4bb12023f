"""A batch of closed loops is the single runs, whatever it is split into."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.flight import chunks
from tests.closed_loop import flights
from tests.refusals import refused

NAMES = ("q", "command", "features", "feature_error", "target_position", "status", "end_time")
NOISY = flights.VEHICLE.replace(
    {"camera.noise": 0.5, "camera.frame_rate": 50.0, "camera.latency": 0.02}
)
BANDWIDTHS = (1.0, 2.0, 3.0)


def fly(vehicle: ca.Vehicle, scenario: ca.Scenario, **options: Any) -> xr.Dataset:
    return ca.simulate(vehicle, scenario, variables=NAMES[:5], **options)


def assert_equal(one: xr.Dataset, other: xr.Dataset) -> None:
    for name in NAMES:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def controllers() -> list[ca.Controller]:
    return [flights.designed(bandwidth) for bandwidth in BANDWIDTHS]


def test_stacked_controllers_fly_as_each_flies_alone_to_the_last_bit() -> None:
    batch = fly(flights.VEHICLE, flights.scenario(ca.stack(controllers()), 0.3))
    for run, controller in enumerate(controllers()):
        alone = fly(flights.VEHICLE, flights.scenario(controller, 0.3))
        assert_equal(batch.isel(run=run), alone)


def test_targets_starts_and_cameras_may_differ_from_run_to_run() -> None:
    paths = [ca.paths.letter(name, duration=20.0) for name in "MRAL"]
    targets = [ca.Target(path, distance=2.0 + 0.1 * i) for i, path in enumerate(paths)]
    starts = np.stack([flights.start() + [*path(0.0)[0][0], *[0.0] * 5] for path in paths])
    focal = [[700.0 + 50 * i, 800.0] for i in range(4)]
    vehicle = flights.VEHICLE.replace({"camera.focal_length": focal})
    controller = flights.designed(2.0)
    batch = fly(vehicle, flights.scenario(controller, 0.3, q=starts, target=targets))
    for run in range(4):
        alone = fly(
            flights.VEHICLE.replace({"camera.focal_length": focal[run]}),
            flights.scenario(controller, 0.3, q=starts[run], target=targets[run]),
        )
        assert_equal(batch.isel(run=run), alone)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_noisy_runs_do_not_depend_on_threads_or_on_how_the_batch_is_cut(
    monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    paths = [ca.paths.hold([0.01 * i, 0.0, 0.0]) for i in range(7)]
    scenario = flights.scenario(
        flights.designed(1.0), 0.2, target=[ca.Target(path) for path in paths], seed=4
    )
    whole = fly(NOISY, scenario, threads=2)
    # Two runs per launch: their samples are what a launch may log.
    most = 2.5 * 8 * 201 * chunks._NUMBERS_PER_SAMPLE
    monkeypatch.setattr(chunks, "CACHED", {"cpu": most})
    monkeypatch.setattr(chunks, "LOGGED", {"cpu": most})
    assert_equal(fly(NOISY, scenario, threads=threads), whole)


def test_one_seed_is_one_noise_in_all_runs_and_seeds_of_their_own_are_others() -> None:
    starts = np.tile(flights.start(), (3, 1))

    def commands(q: np.ndarray, seed: object) -> np.ndarray:
        scenario = flights.scenario(flights.designed(1.0), 0.05, q=q, seed=seed)
        return np.asarray(fly(NOISY, scenario).command)

    same, own = commands(starts, 1), commands(starts, [1, 2, 3])
    np.testing.assert_array_equal(same[1:], same[:2])
    np.testing.assert_array_equal(same[0], commands(starts[0], 1))
    np.testing.assert_array_equal(same[0], own[0])
    assert np.abs(own[1:] - own[:2]).max(axis=(1, 2)).min() > 1e-3


def test_a_run_with_a_seed_of_its_own_has_the_same_noise_in_any_batch() -> None:
    starts, seeds = np.tile(flights.start(), (3, 1)), [7, 11, 2**62]

    def commands(q: np.ndarray, seed: object) -> np.ndarray:
        scenario = flights.scenario(flights.designed(1.0), 0.05, q=q, seed=seed)
        return np.asarray(fly(NOISY, scenario).command)

    batch = commands(starts, seeds)
    for run, seed in enumerate(seeds):
        np.testing.assert_array_equal(commands(starts[run : run + 1], [seed])[0], batch[run])
    with refused("scenario.seed"):
        commands(starts, seeds[:2])
