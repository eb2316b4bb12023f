"""Frames, latency and noise: what a controller is told of the image, and when."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.closed_loop import flights, probes

PERIOD = Fraction(1, 1000)
TARGET = ca.Target(ca.paths.circle(0.2, period=1.0))


def told(
    seconds: float = 0.25,
    period: Fraction | float = PERIOD,
    runs: int = 1,
    seed: Any = 0,
    **camera: Any,
) -> tuple[np.ndarray, np.ndarray, xr.Dataset]:
    """Normalised images (runs, samples, 8): told to a controller that pushes next to nothing while
    the vehicle falls past a moving target, and true."""
    vehicle = flights.VEHICLE.replace({f"camera.{name}": x for name, x in camera.items()})
    scenario = flights.scenario(
        probes.recorded_image(),
        seconds,
        q=np.tile(flights.start(), (runs, 1)),
        target=TARGET,
        control_period=float(period),
        seed=seed,
    )
    run = ca.simulate(vehicle, scenario, variables=["command", "features"])
    assert not run.status.any()
    true = (run.features.to_numpy() - np.tile(vehicle.camera.principal_point, 4)) / np.tile(
        vehicle.camera.focal_length, 4
    )
    # At the very end there is no control instant any more.
    return run.command.to_numpy()[:, :-1], true[:, :-1], run


def exposure_of(instant: int, period: Fraction, rate: Fraction, latency: Fraction) -> int:
    """Control instant at which the newest frame in hand was exposed, in exact arithmetic."""
    exposures = {0}
    frame = 0
    while rate:
        frame += 1
        at = math.ceil(Fraction(frame) / rate / period)
        if at > instant:
            break
        exposures.add(at)
    if not rate:
        exposures = set(range(instant + 1))
    delay = math.ceil(latency / period)
    return max((at for at in exposures if at + delay <= instant), default=0)


@pytest.mark.parametrize(
    ("period", "rate", "latency"),
    [
        ("1/1000", "0", "0"),
        ("1/1000", "30", "0"),
        ("1/1000", "30", "1/30"),
        ("1/1000", "0", "1/400"),
        ("1/1000", "400", "101/10000"),
        ("1/1000", "3000", "1/100"),
        ("1/200", "30", "1/30"),
        ("1/200", "50", "3/100"),
    ],
)
def test_the_controller_has_the_newest_frame_that_has_arrived(
    period: str, rate: str, latency: str
) -> None:
    exact = Fraction(period), Fraction(rate), Fraction(latency)
    reported, true, _ = told(period=exact[0], frame_rate=float(exact[1]), latency=float(exact[2]))
    samples = reported.shape[1]
    every = int(exact[0] / PERIOD)
    # A sample between control instants still shows the push of the last one.
    expected = [every * exposure_of(k // every, *exact) for k in range(samples)]
    np.testing.assert_allclose(reported[0], true[0][expected], rtol=0, atol=5e-15)
    assert np.abs(true[0, 1:] - true[0, :-1]).max(axis=1).min() > 1e-6


@pytest.mark.parametrize("latency", [0.001, 0.05, 0.1])
def test_a_latency_in_single_precision_is_the_same(latency: float) -> None:
    """np.float32(0.1) is a last digit above 100 periods, and no 101."""
    single = float(np.float32(latency))
    assert single > latency
    of_double, of_single = (told(seconds=0.2, latency=each)[0] for each in (latency, single))
    np.testing.assert_array_equal(of_single, of_double)


def test_frames_under_a_period_in_single_precision_come_at_the_same_instants() -> None:
    """Two periods of np.float32(0.01) end a last digit before a frame at 50 Hz is due."""
    periods = 0.01, float(np.float32(0.01))
    assert periods[1] < periods[0]
    of_double, of_single = (told(period=each, frame_rate=50.0)[0] for each in periods)
    np.testing.assert_allclose(of_single, of_double, rtol=0, atol=1e-5)


def test_noise_is_normal_of_the_size_asked_for_and_new_in_every_frame_and_coordinate() -> None:
    """50 runs, 250 frames and 8 coordinates: 100,000 numbers, so that 1 % is three deviations."""
    sigma = np.tile([0.5 / 800.0, 0.5 / 400.0], 4)
    reported, true, _ = told(runs=50, seed=list(range(50)), noise=0.5, focal_length=[800.0, 400.0])
    noise = (reported - true) / sigma
    count = noise.size
    assert abs(noise.mean()) < 4 / np.sqrt(count)
    np.testing.assert_allclose(noise.std(axis=(0, 1)), 1.0, rtol=0, atol=4 / np.sqrt(2 * count / 8))
    assert abs((noise**4).mean() - 3.0) < 4 * np.sqrt(96 / count)
    assert 0.0440 < (np.abs(noise) > 2.0).mean() < 0.0470
    for one, other in (
        (noise[:, 1:], noise[:, :-1]),
        (noise[1:], noise[:-1]),
        (noise[..., 1:], noise[..., :-1]),
    ):
        assert abs((one * other).mean()) < 4 / np.sqrt(one.size)


def test_a_frame_keeps_its_noise_until_the_next_has_arrived() -> None:
    reported, _, _ = told(noise=0.5, frame_rate=100.0, latency=0.004)
    changes = np.flatnonzero(np.abs(np.diff(reported[0], axis=0)).max(axis=1) > 0.0) + 1
    np.testing.assert_array_equal(changes, np.arange(14, 250, 10))


def test_one_second_of_latency_at_1_khz_takes_what_memory_a_second_of_frames_does() -> None:
    """Steps between control instants must not count as frames on their way."""
    from continuair.engine.loop import PackedLoop

    seen: list[int] = []
    struct_of = PackedLoop.struct

    def spying(self: PackedLoop, engine: Any, runs: Any) -> Any:
        struct = struct_of(self, engine, runs)
        seen.append(struct.frames.shape[1])
        return struct

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PackedLoop, "struct", spying)
        told(seconds=0.5, period=Fraction(1, 200), latency=0.05)
    assert set(seen) == {11}


def test_the_papers_scenario_with_noise_frames_and_latency_stays_in_view() -> None:
    """0.5 px of noise, 30 frames per second and one frame of latency, at a bandwidth of 1 rad/s."""
    vehicle = flights.VEHICLE.replace(
        {"camera.noise": 0.5, "camera.frame_rate": 30.0, "camera.latency": 1 / 30}
    )
    run = ca.simulate(vehicle, flights.scenario(flights.designed(1.0), 20.0))
    late = run.feature_error.sel(time=slice(12, None)).to_numpy()
    assert run.status == 0
    assert np.sqrt((late**2).mean()) < 5.0
