"""Steps controlled by their errors: these follow the tolerance, and a second flight tells them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.scenario.tracking_task import task
from continuair.typing import Method
from tests.refusals import refused
from tests.sections.strains import flying, rod
from tests.tendons.pulled import FOUR, pulled

Array = np.ndarray

PAPER = ca.load_vehicle("paper")
RELEASE = ca.Scenario("release", [0, 0, 3, 0, 0, 0, 1.0, 0.4])


def fly(scenario: ca.Scenario, vehicle: ca.Vehicle = PAPER, **options: Any) -> xr.Dataset:
    return ca.simulate(vehicle, scenario, method="Tsit5", **options)


def apart(one: xr.Dataset, other: xr.Dataset, vehicle: ca.Vehicle = PAPER) -> Array:
    """Largest distance of tips of two flights (runs,), in arm lengths."""
    distance = np.linalg.norm(one["tip_position"] - other["tip_position"], axis=-1)
    time = one["tip_position"].dims.index("time")
    return np.asarray(distance.max(axis=tuple(range(time, distance.ndim))) / vehicle.reach)


def tumbling(runs: int = 20) -> tuple[ca.Vehicle, ca.Scenario]:
    """Light UAVs that spin under arms bent by 3.5 to 5.8 rad."""
    rng = np.random.default_rng(11)
    mass = rng.uniform(0.25, 0.8, runs)
    vehicle = PAPER.replace(
        {
            "uav.mass": mass,
            "uav.inertia": np.stack([0.012 * mass, 0.012 * mass, 0.024 * mass], axis=-1),
            "arm.density": 7850.0 * rng.uniform(0.3, 1.0, runs),
            "arm.youngs_modulus": 207e9 * 10.0 ** rng.uniform(-2.0, -0.3, runs),
        }
    )
    q, qd = np.zeros((2, runs, 8))
    q[:, 2] = 5.0
    q[:, 3:6] = rng.uniform(-1.0, 1.0, (runs, 3))
    q[:, 6], q[:, 7] = rng.uniform(3.5, 5.8, runs), rng.uniform(-3.0, 3.0, runs)
    qd[:, 3:6], qd[:, 6] = rng.uniform(-6.0, 6.0, (runs, 3)), rng.uniform(-5.0, 5.0, runs)
    scenario = open_loop_test("B")
    return vehicle, scenario.replace(q=q, qd=qd, duration=6.0)


def test_errors_follow_the_tolerance() -> None:
    reference = fly(RELEASE, rtol=1e-11)
    found = [apart(fly(RELEASE, rtol=rtol), reference) for rtol in (1e-3, 1e-5, 1e-7, 1e-9)]
    for before, after in zip(found, found[1:], strict=False):
        assert 20.0 < before / after < 500.0
    assert found[0] < 1e-3


def test_energy_is_kept_to_the_tolerance() -> None:
    flight = fly(RELEASE, rtol=1e-9)
    energy = sum(flight[f"{name}_energy"].to_numpy() for name in ("kinetic", "gravity", "elastic"))
    assert np.ptp(energy) < 1e-7 * np.ptp(flight["elastic_energy"].to_numpy())


@pytest.mark.long
def test_tumbling_light_vehicles_stay_within_a_tenth_of_a_millionth_of_ten() -> None:
    """1e-5 arm lengths after 6 s at 1e-6, and what is told is within a factor of two."""
    vehicle, scenario = tumbling()
    options = {"sample": 0.01, "variables": ["tip_position"]}
    reference = fly(scenario, vehicle, rtol=1e-12, **options)
    found = fly(scenario, vehicle, rtol=1e-6, check=True, **options)
    true, told = apart(found, reference, vehicle), found["error_estimate"].to_numpy()
    assert true.max() < 1e-5
    assert (np.abs(np.log2(told / true)) < 1.0).all()


PULSES: dict[str, Callable[[float], float]] = {
    "a jump": lambda t: 1.0 if t > 0.3141592 else 0.0,
    "a tap of 1 ms": lambda t: 20.0 if 0.3141592 < t < 0.3151592 else 0.0,
    "a bell of 1 ms": lambda t: 20.0 * float(np.exp(-(((t - 0.4) / 1e-3) ** 2))),
    "a square wave": lambda t: float(np.sign(np.sin(2.0 * np.pi * 50.0 * t))),
}


@pytest.mark.parametrize("name", PULSES)
def test_what_inputs_do_between_samples_is_not_missed(name: str) -> None:
    of = PULSES[name]
    scenario = RELEASE.replace(force=lambda t: [of(t), 0.0, 0.0], duration=0.5)
    found, reference = (fly(scenario, rtol=rtol) for rtol in (1e-4, 1e-10))
    assert apart(found, reference) < 3e-5
    # The impulse of the force, as the momentum of the whole has it.
    times = np.linspace(0.0, 0.5, 2_000_001)
    impulse = np.trapezoid([of(t) for t in times.tolist()], times)
    gained = np.diff(reference["linear_momentum"].to_numpy()[[0, -1], 0])
    assert gained == pytest.approx(impulse, rel=1e-3, abs=1e-5)


def test_torques_follow_a_bend_that_passes_beside_straight() -> None:
    """Test C from 64 starts: the side on which each passes decides where the torques point."""
    rng = np.random.default_rng(1)
    q = np.zeros((64, 8))
    q[:, 6], q[:, 7] = rng.uniform(-1.0, 1.0, 64), rng.uniform(-3.0, 3.0, 64)
    scenario = open_loop_test("C").replace(q=q, qd=None)
    found, reference = (
        fly(scenario, rtol=rtol, variables=["tip_position"]) for rtol in (1e-4, 1e-10)
    )
    assert apart(found, reference).max() < 1e-4


def batch(chosen: Array) -> ca.Scenario:
    """Some of eleven runs that differ in their starts and in when a moment begins."""
    rng, runs = np.random.default_rng(5), 11
    q = np.zeros((runs, 8))
    q[:, 6], q[:, 7] = rng.uniform(0.2, 1.5, runs), rng.uniform(-3.0, 3.0, runs)
    edges = rng.uniform(0.05, 0.15, runs)[chosen]

    def moment(t: float) -> Array:
        rows = np.zeros((*np.shape(edges), 3))
        rows[..., 1] = np.where(t > edges, 0.02, 0.0)
        return rows

    return ca.Scenario("batch", q[chosen], moment=moment, duration=0.25)


def test_a_run_has_the_same_bits_alone_and_in_any_batch_and_for_any_sample() -> None:
    names = ["position", "attitude", "bend", "velocity"]
    everyone, order = np.arange(11), np.random.default_rng(1).permutation(11)
    options: dict[str, Any] = {"variables": names, "sample": 2.0**-10}
    together = fly(batch(everyone), **options)
    turned = fly(batch(order), **options).isel(run=np.argsort(order))
    alone = fly(batch(everyone[4]), **options)
    coarse = fly(batch(everyone), variables=names, sample=2.0**-5)
    for name in names:
        assert np.array_equal(together[name], turned[name]), name
        assert np.array_equal(together[name][:, ::32], coarse[name]), name
        assert np.array_equal(together[name][4], alone[name]), name


@pytest.mark.parametrize("looks", [False, True])
def test_pairs_are_what_flights_compare_as(looks: bool) -> None:
    """Metrics, errors and counts, in open loop and under a law that looks."""
    scenario, vehicle = batch(np.arange(11)), PAPER
    if looks:
        vehicle = PAPER.replace({"arm.damping_ratio": 0.03})
        law = ca.servoing(**ca.design(PAPER, 6.0))
        scenario = task(vehicle, ["A", "L"], law, 50.0).replace(duration=0.2)
    options: dict[str, Any] = {"method": "Tsit5", "rtol": 1e-5, "check": True}
    pairs = ca.run_pairs(vehicle, scenario, sample=5e-3, **options)
    flights = [
        ca.simulate(vehicle, scenario, model=model, sample=5e-3, **options)
        for model in ("coupled", "decoupled")
    ]
    found = pairs.sel(model="decoupled")
    compared = ca.compare(*flights)
    assert found["nrmse_t"].to_numpy() == pytest.approx(np.asarray(compared["nrmse_t"]), rel=1e-9)
    for model, flight in zip(("coupled", "decoupled"), flights, strict=True):
        own = pairs.sel(model=model)
        assert np.array_equal(own["steps"], flight["steps"])
        assert np.array_equal(own["status"], flight["status"])
        errors = flight["error_estimate"].to_numpy()
        assert own["error_estimate"].to_numpy() == pytest.approx(errors, rel=1e-6, abs=1e-14)


def test_a_run_ends_where_its_bend_is_a_full_circle() -> None:
    """To the tolerance in time, whatever the step; and with what it reached before."""
    flung = ca.Scenario("flung", [0, 0, 0, 0, 0, 0, 5.0, 0.0], [0, 0, 0, 0, 0, 0, 60.0, 0.0])
    soft = PAPER.replace({"arm.youngs_modulus": 2e8})
    ends = [fly(flung, soft, rtol=rtol, duration=0.2) for rtol in (1e-3, 1e-6, 1e-9)]
    exact = float(ends[-1].end_time)
    assert [int(flight.status) for flight in ends] == [2, 2, 2]
    assert float(ends[1].end_time) == pytest.approx(exact, abs=1e-8)
    assert float(ends[0].end_time) == pytest.approx(exact, abs=1e-5)
    for flight in ends:
        reached = np.isfinite(flight["tip_position"].to_numpy()).all(axis=-1)
        assert np.array_equal(reached, flight["time"].to_numpy() < float(flight.end_time))
    length = float(np.asarray(PAPER.reach))
    last = np.linalg.norm(ends[-1]["bend"].to_numpy()[reached], axis=-1)[-1]
    assert 0.99 * 2.0 * np.pi / length < last < 2.0 * np.pi / length


def test_forces_beyond_numbers_end_a_run_with_a_status() -> None:
    scenario = RELEASE.replace(force=[1e300, 0.0, 0.0], duration=0.1)
    assert int(fly(scenario).status) != 0


def test_rotors_may_saturate_within_a_step() -> None:
    """Limits are kinks of the equations of motion, which steps are shortened for."""
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [1.0, 9.0], "lag": 0.03}
    vehicle = PAPER.replace({"uav.rotors": rotors | {"torque_per_thrust": 0.016}})
    scenario = ca.Scenario(
        "far",
        [0.5, -0.4, 0.3, 0, 0, 0, 0.2, 0.0],
        controller=ca.flight_controller(vehicle),
        setpoints=ca.Setpoints(position=[0.0, 0.0, 0.0]),
        duration=1.0,
    )
    with pytest.warns(ca.ContinuairWarning):
        found = fly(scenario, vehicle, check=True)
    with pytest.warns(ca.ContinuairWarning):
        reference = fly(scenario, vehicle, rtol=1e-10)
    true = apart(found, reference, vehicle)
    assert float(found.largest_saturation) > 0.1
    assert true < 1e-4
    assert float(found.error_estimate) > 0.3 * true


@pytest.mark.parametrize("period", [1e-3, None])
def test_closed_loops_agree_with_short_fixed_steps(period: float | None) -> None:
    law = ca.servoing(**ca.design(PAPER, 6.0))
    damped = PAPER.replace({"arm.damping_ratio": 0.03})
    scenario = task(damped, ["A"], law, 50.0).replace(control_period=period, duration=0.5)
    found = fly(scenario, damped, rtol=1e-8)
    fine = ca.simulate(damped, scenario, method="RK4", step=1e-4)
    assert apart(found, fine, damped) < 1e-8
    gap = np.abs(found["command"] - fine["command"]).max() / np.abs(fine["command"]).max()
    assert gap < 1e-5


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"rtol": 1e-13}, "rtol"),
        ({"rtol": 0.1}, "rtol"),
        ({"rtol": float("nan")}, "rtol"),
        ({"rtol": 1e-5, "dtype": "float32"}, "rtol"),
        ({"atol": 0.0}, "atol"),
        ({"max_step": -1.0}, "max_step"),
        ({"step": 1e-3}, "step"),
        ({"method": "RK4", "rtol": 1e-6}, "rtol"),
        ({"method": "RK4", "max_step": 1e-3}, "max_step"),
        ({"method": "RK5"}, "method"),
    ],
)
def test_tolerances_that_cannot_be_met_are_refused(options: dict[str, Any], field: str) -> None:
    with refused(field):
        ca.simulate(PAPER, RELEASE, **({"method": "Tsit5"} | options))


@pytest.mark.parametrize("method", ["RK4", "implicit"])
@pytest.mark.filterwarnings("ignore:step", "ignore:error_estimate")
def test_half_the_step_tells_the_error_of_steps_of_one_length(method: Method) -> None:
    short = RELEASE.replace(duration=0.3)
    found = ca.simulate(PAPER, short, method=method, step=4e-3, sample=0.02, check=True)
    true = apart(found, fly(short, rtol=1e-10, sample=0.02))
    assert 0.7 * true < float(found.error_estimate) < 1.1 * true


def test_old_names_are_told_their_new_ones() -> None:
    with refused("integrator"):
        ca.simulate(PAPER, RELEASE, integrator="rk4")
    with pytest.raises(TypeError, match="integrate"):
        ca.simulate(PAPER, RELEASE, integrate=True)


@pytest.mark.long
def test_a_function_that_cannot_be_resolved_is_refused() -> None:
    def noise(t: float) -> list[float]:
        return [float(np.modf(np.sin(12345.678 * t) * 43758.5453)[0]), 0.0, 0.0]

    with refused("force"):
        fly(RELEASE.replace(force=noise, duration=0.1))


def test_single_precision_keeps_to_its_tolerance() -> None:
    found = fly(RELEASE, rtol=1e-4, dtype="float32")
    assert apart(found, fly(RELEASE, rtol=1e-10)) < 3e-4


def touching(draw: np.random.Generator) -> tuple[ca.Vehicle, ca.Scenario]:
    """Return a random flight of an arm against a wall beside it, or a floor below it."""
    a, q, rates = draw.uniform(0.0, 2.0 * np.pi), np.zeros(8), np.zeros(8)
    wall = draw.random() < 0.5
    normal = np.array([np.cos(a), np.sin(a), 0.0] if wall else [*draw.uniform(-0.3, 0.3, 2), 1.0])
    normal /= np.linalg.norm(normal)
    rates[:3] = 0.3 * draw.uniform(-1.0, 1.0, 3) - draw.uniform(0.2, 1.5) * normal
    rates[3:6] = draw.uniform(-1.0, 1.0, 3)
    nearest = np.array([0.0, 0.0, -0.3 if wall else -0.55])
    plane = ca.Plane(
        point=nearest - (0.006 + draw.uniform(1e-3, 1e-2)) * normal,
        normal=normal,
        stiffness=10.0 ** draw.uniform(3.0, 5.0),
        damping=draw.uniform(0.0, 1.0),
        friction=draw.uniform(0.0, 0.6),
    )
    vehicle = flying(rod(damping_ratio=0.02), mount=[0.0, 0.0, -0.05])
    return vehicle, ca.Scenario("touching", q, rates, duration=0.15, obstacles=[plane])


def rubbing(draw: np.random.Generator) -> tuple[ca.Vehicle, ca.Scenario]:
    """Return a random flight of an arm with tendons that rub, under random commands."""
    group = {
        "angles": FOUR,
        "pretension": draw.uniform(0.5, 5.0),
        "friction": draw.uniform(0.05, 0.6),
        "friction_stiffness": 10.0 ** draw.uniform(3.0, 4.5),
    }
    rates = draw.normal(size=8) * np.array([1.0] * 6 + [5.0, 1.0])
    size, pace = draw.uniform(0.0, 3.0, 4), draw.uniform(5.0, 60.0, 4)

    def command(t: float) -> Any:
        return size * np.sin(pace * t) ** 2

    scenario = ca.Scenario(
        "rubbing", np.zeros(8), rates, duration=0.15, gravity=0.0, tendon_command=command
    )
    return pulled(group, damping_ratio=0.02), scenario


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::continuair.errors.ContinuairWarning")
def test_the_error_of_flights_with_kinks_is_told() -> None:
    """Within a factor of 3, in 90 of 100 random flights whose error is above 1e-6."""
    ratios: list[float] = []
    for make, wanted in ((touching, 50), (rubbing, 100)):
        draw = np.random.default_rng(19)
        while len(ratios) < wanted:
            vehicle, scenario = make(draw)
            found = fly(scenario, vehicle, rtol=1e-4, check=True, sample=0.01)
            reference = fly(scenario, vehicle, rtol=1e-10, sample=0.01)
            assert int(found["status"]) == int(reference["status"]) == 0
            true = float(apart(found, reference, vehicle))
            if true > 1e-6:
                ratios.append(float(found["error_estimate"]) / true)
    told = np.array(ratios)
    assert ((told > 1.0 / 3.0) & (told < 3.0)).sum() >= 90
