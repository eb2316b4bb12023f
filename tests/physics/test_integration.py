"""Convergence of steps of one length, input jumps, batches and the end of a run."""

from typing import Any

import numpy as np
import pytest
import warp as wp

import continuair as ca
from amiri2026 import open_loop_test
from continuair.typing import Method
from tests.physics.free_flight import tumbling
from tests.refusals import refused

pytestmark = pytest.mark.targets

VEHICLE = ca.load_vehicle("paper")
turns_untold = pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw are not followed")


@turns_untold
def test_rk4_converges_with_slope_four() -> None:
    steps = [1e-3, 5e-4, 2.5e-4, 1.25e-4]
    reference = ca.simulate(VEHICLE, tumbling(0.2), rtol=1e-12, sample=0.1).tip_position
    errors = [
        float(
            np.abs(
                ca.simulate(VEHICLE, tumbling(0.2), method="RK4", step=h, sample=0.1).tip_position
                - reference
            ).max()
        )
        for h in steps
    ]
    fine = np.log2(errors[-2] / errors[-1])
    assert fine == pytest.approx(4.0, abs=0.15)


def test_attitudes_are_of_unit_length_at_any_tolerance() -> None:
    run = ca.simulate(VEHICLE, tumbling(1.0), rtol=1e-2, sample=0.05)
    assert np.abs(np.linalg.norm(run.attitude, axis=1) - 1.0).max() < 1e-15


def test_error_control_agrees_with_rk4_across_an_input_jump() -> None:
    def force(t: float) -> list[float]:
        return [10.0, 0.0, 25.0] if t <= 0.1234 else [-10.0, 5.0, 25.0]

    scenario = ca.Scenario(name="jump", q=np.zeros(8), force=force, duration=0.4, jumps=(0.1234,))
    fine = ca.simulate(VEHICLE, scenario, method="RK4", step=1e-4, sample=0.05)
    reference = ca.simulate(VEHICLE, scenario, rtol=1e-12, sample=0.05)
    # The tolerance of the reference, times ten.
    assert float(np.abs(fine.tip_position - reference.tip_position).max()) < 1e-11


def test_a_declared_jump_keeps_fourth_order() -> None:
    def force(t: float) -> list[float]:
        return [50.0, 0.0, 25.0] if t <= 0.11117 else [0.0, 50.0, 25.0]

    scenario = ca.Scenario(name="jump", q=np.zeros(8), force=force, duration=0.2, jumps=(0.11117,))
    reference = ca.simulate(VEHICLE, scenario, rtol=1e-12, sample=0.2)
    errors = [
        float(
            np.abs(
                ca.simulate(VEHICLE, scenario, method="RK4", step=h, sample=0.2).tip_position
                - reference.tip_position
            ).max()
        )
        for h in (1e-3, 5e-4, 2.5e-4)
    ]
    assert np.log2(errors[0] / errors[2]) / 2 > 3.6


def test_free_fall_is_exact() -> None:
    """A straight arm at rest falls as a point: z = -g t²/2 whatever the step."""
    run = ca.simulate(VEHICLE, ca.Scenario(name="fall", q=np.zeros(8)))
    np.testing.assert_allclose(
        run.position.sel(axis="z"), -0.5 * 9.81 * run.time**2, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(run.base_force, 0.0, rtol=0, atol=1e-12)


def test_coupled_bending_in_free_fall_does_not_feel_gravity_and_decoupled_does() -> None:
    runs = {
        (model, g): ca.simulate(VEHICLE, open_loop_test("B").replace(gravity=g), model=model)
        for model in ("coupled", "decoupled")
        for g in (0.0, 9.81)
    }
    same = np.abs(runs["coupled", 0.0].bend - runs["coupled", 9.81].bend).max()
    different = np.abs(runs["decoupled", 0.0].bend - runs["decoupled", 9.81].bend).max()
    assert same < 1e-12 < 1e-3 < different


def test_turning_the_world_turns_the_flight() -> None:
    """Yaw equivariance: initial yaw and forces turned by ψ turn the whole flight by ψ."""
    yaw = 0.8
    c, s = np.cos(yaw), np.sin(yaw)
    plain = ca.Scenario(name="plain", q=[1, 2, 3, 0.1, 0.2, 0, 0.5, 0.3], force=[3, -4, 20])
    turned = ca.Scenario(
        name="turned",
        q=[c - 2 * s, s + 2 * c, 3, 0.1, 0.2, yaw, 0.5, 0.3],
        force=[3 * c + 4 * s, 3 * s - 4 * c, 20],
    )
    for model in ca.MODELS:
        a, b = (
            ca.simulate(
                VEHICLE, x, model=model, method="RK4", step=1e-4, sample=0.1
            ).tip_position.to_numpy()
            for x in (plain, turned)
        )
        # The attitude inside a step has a norm other than 1 by some (ω h)², so that it is no
        # rotation; what that leaves goes with h⁴, and is 8e-13 here.
        back = a @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        np.testing.assert_allclose(back, b, rtol=0, atol=2e-11)


def test_the_signed_branch_of_the_bend_passes_through_straight_without_a_jump() -> None:
    scenario = ca.Scenario(name="swing", q=[0, 0, 0, 0, 0, 0, 0.5, 0.4], duration=0.5)
    run = ca.simulate(VEHICLE, scenario, model="independent", variables=["q"])
    kappa, psi = run.q.sel(coordinate="kappa"), run.q.sel(coordinate="psi_a")
    assert float(kappa.min()) < -0.1 < 0.1 < float(kappa.max())
    np.testing.assert_allclose(psi, 0.4, rtol=0, atol=1e-11)


def test_a_tumble_through_the_pitch_singularity_is_continuous() -> None:
    scenario = ca.Scenario(name="tumble", q=np.zeros(8), qd=[0, 0, 0, 0, 4, 0, 0, 0], gravity=0.0)
    run = ca.simulate(VEHICLE, scenario, model="independent", sample=1e-2, variables=["q"])
    pitch = run.q.sel(coordinate="pitch")
    assert float(pitch.max()) > np.pi / 2
    assert float(np.abs(np.diff(run.q, axis=0)).max()) < 0.2


@turns_untold
def test_a_batch_equals_its_runs_one_by_one() -> None:
    radii, masses = np.linspace(0.004, 0.01, 5), np.linspace(1.0, 3.0, 5)
    batch = VEHICLE.replace({"arm.radius": radii, "uav.mass": masses})
    scenario = open_loop_test("D")
    together = ca.simulate(batch, scenario, method="RK4", step=5e-4, sample=0.1, threads=2)
    for i in range(5):
        alone = ca.simulate(batch.select(i), scenario, method="RK4", step=5e-4, sample=0.1)
        np.testing.assert_array_equal(together.isel(run=i).tip_position, alone.tip_position)


def test_initial_states_and_inputs_may_vary_over_runs() -> None:
    q = np.zeros((3, 8))
    q[:, 6] = 0.1, 0.2, 0.3
    forces = np.array([[1.0, 0, 0], [2.0, 0, 0], [3.0, 0, 0]])
    run = ca.simulate(VEHICLE, ca.Scenario(name="b", q=q, force=forces), sample=0.5)
    for i in range(3):
        alone = ca.simulate(VEHICLE, ca.Scenario(name="a", q=q[i], force=forces[i]), sample=0.5)
        assert run["steps"][i] == alone["steps"]
        np.testing.assert_array_equal(run.isel(run=i).position, alone.position)


def test_a_run_that_bends_past_a_full_circle_ends_with_a_status_and_spares_the_others() -> None:
    moments = np.array([[0.0, 0.0], [5000.0, 0.0]])
    scenario = ca.Scenario(name="overbent", q=np.zeros(8), bend_moment=moments, duration=0.5)
    run = ca.simulate(VEHICLE, scenario)
    assert run.status.to_numpy().tolist() == [0, 2]
    assert 0.0 < float(run.end_time[1]) < 0.5
    late = run.time > float(run.end_time[1]) + 1e-9
    assert np.isnan(run.bend[1][late]).all() and np.isfinite(run.bend[0]).all()
    assert float(np.linalg.norm(run.bend[1][~late], axis=-1).max()) <= 2 * np.pi


def test_single_precision_follows_double() -> None:
    runs = [ca.simulate(VEHICLE, open_loop_test("D"), dtype=d) for d in ("float64", "float32")]
    assert runs[1].tip_position.dtype == np.float32
    # 1000 steps of single-precision rounding of 5 m, 3e-7 each, that mostly cancel.
    assert float(np.abs(runs[0].tip_position - runs[1].tip_position).max()) < 1e-4


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"model": "couple"}, "model"),
        ({"step": -1.0}, "step"),
        ({"sample": 0}, "sample"),
        ({"variables": ["tip_positon"]}, "variables"),
        ({"dtype": "float16"}, "dtype"),
        ({"method": "euler"}, "method"),
        ({"duration": np.inf}, "duration"),
        ({"threads": 0}, "threads"),
        ({"device": "cuda:9"}, "device"),
        ({"device": ["cpu"]}, "device"),
        ({"dtype": np.float64}, "dtype"),
        ({"model": np.array(["coupled", "decoupled"])}, "model"),
        (
            {"method": "RK4", "step": np.array([1e-3, 1e-4])},
            "step",
        ),
        ({"sample": [0.1]}, "sample"),
        ({"sample": 2.0}, "sample"),
        ({"threads": True}, "threads"),
        ({"method": "RK4"}, "step"),
        ({"method": "RK4", "step": "often"}, "step"),
    ],
)
def test_a_bad_option_is_named_in_one_sentence(options: dict[str, object], field: str) -> None:
    with refused(field):
        ca.simulate(VEHICLE, open_loop_test("B"), **options)  # type: ignore[arg-type]


UNDAMPED = {"arm.damping_ratio": 0.0}


@pytest.mark.long
@turns_untold
@pytest.mark.parametrize(
    ("changes", "q", "qd"),
    [
        ({"arm.damping_ratio": 4.0}, {6: 0.5}, {}),
        (UNDAMPED, {6: 0.1}, {3: 200.0}),
        (UNDAMPED, {6: 0.1}, {5: 300.0}),
        (UNDAMPED, {6: 0.1}, {6: 700.0}),
        ({"uav.drag": {"linear": [9e3, 0.0, 0.0]}}, {6: 0.1}, {0: 1.0}),
    ],
    ids=["overdamped", "tumbling", "spinning", "whipping", "dragged"],
)
def test_the_automatic_step_follows_what_damping_and_start_make_fast(
    changes: dict[str, Any], q: dict[int, float], qd: dict[int, float]
) -> None:
    """A step of 0.2 of the fastest rate errs by 3e-6 of that motion, and 350 of them are flown.

    At 0.2 of the undamped bending frequency at rest, bend or tip are wrong by 0.5 % or more.
    """
    vehicle = VEHICLE.replace(changes)
    start, rates = np.zeros(8), np.zeros(8)
    start[list(q)], rates[list(qd)] = list(q.values()), list(qd.values())
    scenario = ca.Scenario("fast", start, rates, duration=0.1, gravity=0.0)
    run = ca.simulate(vehicle, scenario, method="RK4", step="auto", sample=0.01)
    reference = ca.simulate(vehicle, scenario, rtol=1e-10, sample=0.01)
    assert int(run.status) == int(reference.status) == 0
    for name in ("bend", "tip_position"):
        scale = float(np.abs(reference[name]).max())
        assert float(np.abs(run[name] - reference[name]).max()) < 1e-3 * scale


def test_the_last_interval_is_the_short_one() -> None:
    run = ca.simulate(VEHICLE, open_loop_test("B"), duration=1.0, sample=0.3)
    np.testing.assert_allclose(run.time, [0.0, 0.3, 0.6, 0.9, 1.0], rtol=1e-14)
    even = ca.simulate(VEHICLE, open_loop_test("B"), duration=0.3, sample=0.1)
    np.testing.assert_allclose(even.time, [0.0, 0.1, 0.2, 0.3], rtol=1e-14)


def test_a_coarse_step_concerns_rk4_alone() -> None:
    scenario = open_loop_test("B").replace(duration=0.1)
    run = ca.simulate(VEHICLE, scenario, step=0.01, sample=0.1, method="implicit")
    assert int(run.status) == 0  # and no warning, which would be an error here


def test_a_step_too_coarse_for_the_stiffest_mode_warns_with_the_estimate() -> None:
    with pytest.warns(ca.ContinuairWarning, match="0.0014 s"):
        ca.simulate(VEHICLE, open_loop_test("B"), method="RK4", step=5e-3, sample=5e-3)


@pytest.mark.skipif(wp.is_cuda_available(), reason="needs a machine without a CUDA device")
def test_cuda_without_a_cuda_device_is_told_so() -> None:
    with refused("device"):
        ca.simulate(VEHICLE, open_loop_test("B"), device="cuda")


def test_a_start_beyond_a_full_circle_ends_at_once_with_a_status() -> None:
    bent = ca.Scenario(name="bent", q=[0, 0, 0, 0, 0, 0, 7.0, 0])
    for given in ({}, {"method": "RK4", "step": 1e-3}, {"method": "implicit", "step": 1e-3}):
        run = ca.simulate(VEHICLE, bent, **given)  # type: ignore[arg-type]
        assert int(run.status) == 2 and float(run.end_time) < 1e-12


def test_all_methods_name_the_same_end() -> None:
    scenario = ca.Scenario(name="overbent", q=np.zeros(8), bend_moment=[5000.0, 0.0])
    exact = ca.simulate(VEHICLE, scenario, rtol=1e-10)
    given: list[tuple[Method, float]] = [("RK4", 1e-5), ("RK4", 1e-3), ("implicit", 1e-5)]
    for method, step in given:
        run = ca.simulate(VEHICLE, scenario, method=method, step=step)
        assert int(run.status) == int(exact.status) == 2
        # Valid up to it, in whole steps: never beyond the end.
        assert -2.0 * step < float(run.end_time) - float(exact.end_time) < 1e-6


@pytest.mark.parametrize(
    "force",
    [
        lambda t: [1 / (t < 0.5)] * 3,
        lambda t: [np.nan if t > 0.5 else 0.0] * 3,
        lambda t: [0.0] * (4 if t > 0.5 else 3),
    ],
)
def test_an_input_that_fails_later_in_the_flight_is_named(force: object) -> None:
    scenario = ca.Scenario(name="late", q=np.zeros(8), force=force)  # type: ignore[arg-type]
    with refused("force"):
        ca.simulate(VEHICLE, scenario)


def test_more_steps_than_fit_are_refused_before_they_are_made() -> None:
    test = open_loop_test("B")
    with refused("duration"):
        ca.simulate(VEHICLE, test, sample=1e-9)
    with refused("duration"):
        ca.simulate(VEHICLE, test, method="RK4", step=1e-9)
    sway = test.replace(force=lambda t: [np.sin(t), 0.0, 0.0], duration=1e6)
    with refused("duration"):
        ca.simulate(VEHICLE, sway, sample=1.0)


def test_arrays_of_different_numbers_of_runs_are_refused() -> None:
    batch = VEHICLE.replace({"uav.mass": [1.0, 2.0, 3.0]})
    with refused("scenario.q"):
        ca.simulate(batch, ca.Scenario(name="two", q=np.zeros((2, 8))))


def test_inputs_for_different_numbers_of_runs_are_named() -> None:
    scenario = ca.Scenario(
        "rows",
        np.zeros(8),
        force=lambda t: np.zeros((2, 3)),
        moment=lambda t: np.zeros((3, 3)),
    )
    with refused("inputs"):
        ca.simulate(VEHICLE, scenario, sample=0.1)


@pytest.mark.parametrize("sample", [0.5, 0.1, 0.01])
def test_q_counts_the_turns_between_samples(sample: float) -> None:
    """A spin about the vertical axis of a hanging arm keeps its rate, and a tumble is followed."""
    rates = [0, 0, 0, 0, 0, 40, 0, 0]
    spin = ca.Scenario("spin", np.zeros(8), rates, gravity=0.0, duration=1.0)
    spun = ca.simulate(VEHICLE, spin, sample=sample, rtol=1e-7, variables=["q"])
    yaw = spun.q.sel(coordinate="yaw")
    np.testing.assert_allclose(yaw, 40.0 * yaw["time"], rtol=1e-6)
    flights = [
        ca.simulate(VEHICLE, tumbling(0.3), sample=each, variables=["q"]) for each in (0.05, 0.001)
    ]
    # Their steps differ, and whole turns would be 6.
    np.testing.assert_allclose(flights[0].q[-1], flights[1].q[-1], atol=1e-3)


def drift(at: float, speed: float) -> ca.Scenario:
    """Uniform motion along x from a place on it [m, m/s]."""
    return ca.Scenario(
        "drift", [at, 0, 3, 0, 0, 0, 0, 0], [speed, 0, 0, 1e-3, 0, 0, 0, 0], gravity=0.0
    )


@pytest.mark.long
@pytest.mark.parametrize("method", ["RK4", "implicit"])
def test_slow_motion_is_not_lost_in_the_last_digits_of_float32(method: str) -> None:
    """Uncompensated 0.1 m/s at 100 m moved by 0.977 of the way, and at 10 km not at all."""
    how: Any = {"method": method, "step": 1e-3, "duration": 4.0, "sample": 0.1}
    for at, speed in ((1e4, 0.3), (100.0, 0.1)):
        exact, single = (
            ca.simulate(VEHICLE, drift(at, speed), dtype=d, **how).isel(time=-1)
            for d in ("float64", "float32")
        )
        digit = np.spacing(np.float32(at))
        np.testing.assert_allclose(single.position, exact.position, rtol=0, atol=1.5 * digit)
        # Slow turns, too: what is lost here would be some 1e-5.
        np.testing.assert_allclose(single.attitude, exact.attitude, rtol=0, atol=2e-7)


def test_float32_far_from_the_origin_is_told() -> None:
    with pytest.warns(ca.ContinuairWarning, match="float32"):
        ca.simulate(VEHICLE, drift(1e5, 0.0), dtype="float32", duration=0.01)
