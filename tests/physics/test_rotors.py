"""What rotors and air do to a flight: against closed forms, balances and other integrators."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.errors import ContinuairWarning
from continuair.studies.standard_excitations import EXCITATIONS, standard_scenario
from continuair.vehicle.vehicle_file import write_vehicle
from tests.closed_loop.constant_push import constant_push
from tests.refusals import refused

GIVEN: dict[str, Any] = {
    "layout": "quad_x",
    "lever": 0.2,
    "height": 0.03,
    "thrust_limits": [0.2, 12.0],
    "torque_per_thrust": 0.016,
    "lag": 0.04,
    "radius": 0.12,
}
DRAG = {"linear": [0.25, 0.3, 0.1], "quadratic": [0.02, 0.03, 0.04]}
SLENDER = ca.load_vehicle("slender")
QUAD = SLENDER.replace({"uav.rotors": GIVEN})
FURNISHED = QUAD.replace({"uav.drag": DRAG})
TILTED = {**GIVEN, "layout": "hex_tilted", "tilt": 0.35}
TREE = ca.load_vehicle(Path(__file__).parents[1] / "three_sections.toml")
TREE = TREE.replace({"uav.rotors": TILTED, "uav.drag": DRAG})
WEIGHT = 9.81 * QUAD.mass
MORE_IN_SOAK = [
    "coupled",
    *(pytest.param(model, marks=pytest.mark.soak) for model in ca.MODELS if model != "coupled"),
]
LEVEL = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BENT = (0.0, 0.0, 2.0, 0.1, -0.2, 0.3, 0.4, 0.7)


def swaying(t: float) -> np.ndarray:
    """Thrusts that differ, and change slowly beside the lag."""
    return 5.3 + np.array([0.3, -0.2, 0.1, 0.25]) * np.sin(3.0 * t + np.arange(4.0))


def breeze(t: float) -> np.ndarray:
    return np.array([2.0 + np.sin(2.0 * t), -1.0, 0.5 * np.cos(3.0 * t)])


def flown(vehicle: ca.Vehicle, q: Any = BENT, **given: Any) -> xr.Dataset:
    options = {
        name: given.pop(name)
        for name in ("model", "step", "sample", "method", "dtype", "rtol")
        if name in given
    }
    given = {"duration": 0.5} | given
    return ca.simulate(vehicle, ca.Scenario("flight", q, **given), **options)


@pytest.mark.long
def test_left_alone_the_rotors_hold_a_level_vehicle_at_rest() -> None:
    """Two sections of one arm and one of another; bends are held, and the body stays for 1 s."""
    q = np.zeros(12)
    q[6::2] = 0.4, -0.3, 0.5
    hover = ca.trim(TREE, bend=np.array([0.4, 0.0, -0.3, 0.0, 0.5, 0.0]))
    flight = flown(TREE, q, bend_moment=hover.bend_moment, duration=1.0, sample=0.01, rtol=1e-9)
    rotors = TREE.uav.rotors
    assert rotors is not None
    wrench = rotors.allocation @ flight.rotor_thrust[0].to_numpy()
    np.testing.assert_allclose(wrench, [*hover.force, *hover.moment], atol=1e-9)
    assert float(np.abs(flight.position).max()) < 1e-9
    assert float(flight.saturation.max()) == 0.0


def test_thrusts_follow_a_step_of_the_command_with_the_lag_of_the_speed() -> None:
    """Ω(t) = Ω₁ + (Ω₀ - Ω₁) e^{-t/τ} and f = f_max Ω²: RK4 at h/τ = 1/40 errs by 1e-10."""
    before, after = np.array([2.0, 4.0, 5.0, 6.0]), np.array([6.0, 5.0, 3.0, 8.0])

    def command(t: float) -> np.ndarray:
        return before if t < 0.1 else after

    flight = flown(
        FURNISHED, LEVEL, rotor_command=command, jumps=(0.1,), duration=0.4, method="RK4", step=1e-3
    )
    since = np.maximum(flight.time.to_numpy() - 0.1, 0.0)[:, None]
    start, end = np.sqrt(before / 12.0), np.sqrt(after / 12.0)
    speed = end + (start - end) * np.exp(-since / 0.04)
    np.testing.assert_allclose(flight.rotor_thrust, 12.0 * speed**2, rtol=2e-9)
    power = 12.0 * speed**2 * np.sqrt(12.0 * speed**2 / (2.0 * 1.225 * np.pi * 0.12**2))
    np.testing.assert_allclose(flight.rotor_power, power, rtol=4e-9)


@pytest.mark.long
def test_rotors_without_lag_give_what_is_commanded_at_once() -> None:
    prompt = FURNISHED.replace({"uav.rotors.lag": 0.0})
    flight = flown(prompt, LEVEL, rotor_command=swaying)
    commanded = [swaying(t) for t in flight.time.to_numpy()]
    np.testing.assert_allclose(flight.rotor_thrust[:-1], commanded[:-1], rtol=1e-9)
    np.testing.assert_allclose(flight.rotor_thrust[-1], commanded[-1], rtol=1e-9)  # beside the end
    # With a lag that is short beside the flight, nearly the same flight.
    quick = flown(FURNISHED.replace({"uav.rotors.lag": 1e-4}), LEVEL, rotor_command=swaying)
    np.testing.assert_allclose(quick.position, flight.position, atol=1e-4)


def drag_force(vehicle: ca.Vehicle, flight: xr.Dataset, wind: np.ndarray) -> np.ndarray:
    """In body axes, written out for one sample after the other."""
    drag = vehicle.uav.drag
    assert drag is not None
    turn = Rotation.from_quat(flight.attitude.to_numpy())
    through = flight.velocity.to_numpy() - turn.inv().apply(wind)
    speed = np.linalg.norm(through, axis=1)[:, None]
    return -(np.array(drag.linear) + speed * np.array(drag.quadratic)) * through


def wrench(vehicle: ca.Vehicle, flight: xr.Dataset) -> np.ndarray:
    assert vehicle.uav.rotors is not None
    return flight.rotor_thrust.to_numpy() @ vehicle.uav.rotors.allocation.T


def simpson(values: np.ndarray, h: float) -> np.ndarray:
    ends = values[0] + values[-1] + 4.0 * values[1:-1:2].sum(0) + 2.0 * values[2:-1:2].sum(0)
    return h / 3.0 * ends


@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_energy_changes_by_the_work_of_rotors_and_air(model: str) -> None:
    """Both models have their own energy; Simpson's rule at 1 ms leaves (2 ω h)⁴/180 < 1e-6 of what
    vibrates at ω = 48 rad/s."""
    flight = flown(
        FURNISHED,
        model=model,
        rotor_command=swaying,
        wind=breeze,
        duration=1.0,
        method="RK4",
        step=2e-4,
    )
    energy = (flight.kinetic_energy + flight.gravity_energy + flight.elastic_energy).to_numpy()
    wind = np.array([breeze(t) for t in flight.time.to_numpy()])
    rotors = wrench(FURNISHED, flight)
    force = rotors[:, :3] + drag_force(FURNISHED, flight, wind)
    power = (force * flight.velocity.to_numpy()).sum(1)
    power += (rotors[:, 3:] * flight.angular_velocity.to_numpy()).sum(1)
    work = simpson(power, 1e-3)
    assert abs(energy[-1] - energy[0]) > 1.0
    assert energy[-1] - energy[0] == pytest.approx(float(work), abs=1e-6 * np.abs(power).max())


@pytest.mark.long
def test_momentum_changes_by_the_forces_of_rotors_air_and_weight() -> None:
    flight = flown(TREE, tree_start(), wind=breeze, duration=1.0, method="RK4", step=2e-4)
    wind = np.array([breeze(t) for t in flight.time.to_numpy()])
    turn = Rotation.from_quat(flight.attitude.to_numpy())
    force = turn.apply(wrench(TREE, flight)[:, :3] + drag_force(TREE, flight, wind))
    force[:, 2] -= 9.81 * TREE.mass
    changed = (flight.linear_momentum[-1] - flight.linear_momentum[0]).to_numpy()
    np.testing.assert_allclose(changed, simpson(force, 1e-3), atol=1e-6 * np.abs(force).max())


def tree_start() -> np.ndarray:
    q = np.zeros(12)
    q[3:6] = 0.1, -0.1, 0.4
    q[6::2], q[7::2] = (0.4, -0.3, 0.5), (0.1, 0.9, 2.0)
    return q


def test_a_vehicle_that_falls_tends_to_the_speed_at_which_drag_carries_it() -> None:
    """Straight down it moves as one body: v = v_t tanh(g t/v_t), and v_t (1 - e^{-g t/v_t}) under
    linear drag."""
    idle = {"rotor_command": np.zeros(4), "duration": 4.0, "sample": 0.05}
    for drag, shape in (({"quadratic": [0, 0, 0.5]}, np.tanh), ({"linear": [0, 0, 4.0]}, None)):
        vehicle = QUAD.replace({"uav.drag": drag})
        value = 0.5 if shape else 4.0
        terminal = np.sqrt(WEIGHT / value) if shape else WEIGHT / value
        flight = flown(vehicle, LEVEL, rtol=1e-10, **idle)
        x = 9.81 * flight.time.to_numpy() / terminal
        fallen = terminal * (np.tanh(x) if shape else -np.expm1(-x))
        np.testing.assert_allclose(-flight.velocity[:, 2], fallen, rtol=1e-8, atol=1e-9)


def test_a_vehicle_drifts_with_the_wind() -> None:
    """In free fall without gravity, carried by the air: no force is left at the wind's velocity."""
    vehicle = QUAD.replace({"uav.drag": {"linear": [5.0, 5.0, 5.0]}})
    start = dict(rotor_command=np.zeros(4), gravity=0.0, wind=(1.0, -2.0, 0.5), duration=0.2)
    still = flown(vehicle, LEVEL, qd=(1.0, -2.0, 0.5, 0, 0, 0, 0, 0), **start)
    np.testing.assert_allclose(still.position[-1], [0.2, -0.4, 2.1], atol=1e-12)


ASKED = [
    ([0.0, 0.0, 20.0], [0.2, -0.3, 0.05]),
    ([0.0, 0.0, 20.0], [0.2, -0.3, 0.9]),
    ([0.0, 0.0, 44.0], [0.1, 0.1, -0.5]),
]


@pytest.mark.filterwarnings("ignore:rotors saturate")
@pytest.mark.parametrize(("force", "moment"), ASKED)
def test_yaw_is_given_up_first_while_lift_and_other_moments_hold(
    force: list[float], moment: list[float]
) -> None:
    prompt = FURNISHED.replace({"uav.rotors.lag": 0.0})
    flight = flown(
        prompt, LEVEL, controller=constant_push(force, moment), duration=0.002, sample=0.001
    )
    given = wrench(prompt, flight)[0]
    np.testing.assert_allclose(given[2:5], [force[2], *moment[:2]], atol=1e-12)
    full = bool(flight.saturation[0] == 0.0)
    thrusts = flight.rotor_thrust[0].to_numpy()
    if full:
        assert given[5] == pytest.approx(moment[2], abs=1e-12)
    else:
        # As much of it as there is: a rotor is at its limit.
        assert 0.0 <= given[5] / moment[2] < 1.0
        at_limit = np.isclose(thrusts, 0.2) | np.isclose(thrusts, 12.0)
        assert at_limit.any()
    assert full == (moment[2] == 0.05)


@pytest.mark.long
def test_saturation_is_told_of_and_stays_in_the_result() -> None:
    law = constant_push([0.0, 0.0, 60.0], [0.0, 0.0, 0.0])
    with pytest.warns(ContinuairWarning, match="saturate.* 25.4 %"):
        flight = flown(FURNISHED, LEVEL, controller=law, duration=0.1)
    # Of 15 N each, 12 are there; limits reach from 0.2 N.
    np.testing.assert_allclose(flight.saturation, 3.0 / 11.8, rtol=1e-12)
    assert float(flight.rotor_thrust.max()) <= 12.0


def short_pulse(t: float) -> np.ndarray:
    """Thrusts of 20 N beside a limit of 12 N, for 20 ms between samples."""
    return np.full(4, 20.0 if 0.06 < t < 0.08 else 5.0)


@pytest.mark.parametrize("given", [{}, {"method": "RK4", "step": 1e-3}])
@pytest.mark.parametrize("at", [0.01, 0.05])
def test_saturation_between_samples_and_unasked_for_is_told_of(
    given: dict[str, Any], at: float
) -> None:
    start = ca.Scenario("pulse", LEVEL, rotor_command=short_pulse, jumps=(0.06, 0.08), duration=0.2)
    with pytest.warns(ContinuairWarning, match=f"saturate.* {800 / 12:.3g} %"):
        flight = ca.simulate(FURNISHED, start, sample=at, variables=["tip_position"], **given)
    assert float(flight["largest_saturation"]) == pytest.approx(8.0 / 12.0, rel=1e-12)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:error_estimate")
@pytest.mark.parametrize("rate", [20.0, 60.0])
def test_commands_that_switch_lagging_rotors_off_and_on_are_followed(rate: float) -> None:
    """Speeds leave 0 as a square root; cut off by the user, so that nothing saturates."""
    light = QUAD.replace({"arm.radius": 0.008, "arm.density": 300.0, "arm.youngs_modulus": 1e9})

    def waves(t: float) -> np.ndarray:
        return np.clip(4.5 + 30.0 * np.sin(rate * t + np.arange(4.0)), 0.0, 12.0)

    start = ca.Scenario("waves", (0, 0, 5, 0, 0, 0, 0.5, 1.0), rotor_command=waves, duration=1.0)
    found = ca.simulate(light, start, sample=0.02, variables=["tip_position"], check=True)
    exact = ca.simulate(light, start, sample=0.02, rtol=1e-10, variables=["tip_position"])
    off = np.linalg.norm(found.tip_position - exact.tip_position, axis=1).max() / light.arm.length
    assert off < max(1e-3, 3.0 * float(found["error_estimate"])) < 0.02


@pytest.mark.long
def test_commands_of_a_program_take_the_place_of_the_hover() -> None:
    """As in `simulate` with the same commands; without them the rotors hold the vehicle."""
    fewer = 0.9 * WEIGHT / 4.0 * np.ones(4)
    stepped = ca.Simulation(QUAD, ca.Scenario("stepped", LEVEL), control_period=0.01)
    for _ in range(20):
        stepped.step()
    np.testing.assert_allclose(stepped.state[:3], LEVEL[:3], atol=1e-9)
    stepped = ca.Simulation(QUAD, ca.Scenario("stepped", LEVEL), control_period=0.01)
    for _ in range(20):
        stepped.step(rotor_command=fewer)
    hover = ca.simulate(QUAD, ca.Scenario("hover", LEVEL, duration=0.01), sample=0.01)
    start = ca.Scenario(
        "sinking", LEVEL, rotor_command=fewer,
        rotor_thrust=hover["rotor_thrust"][0].to_numpy(), duration=0.2,
    )  # fmt: skip
    flight = ca.simulate(
        QUAD, start, sample=0.01, method="RK4", step=stepped.trajectory().attrs["step"]
    )
    np.testing.assert_allclose(stepped.state[:3], flight["position"][-1], atol=1e-12)
    assert stepped.state[2] < LEVEL[2] - 0.005


def test_smooth_saturation_between_samples_is_seen() -> None:
    def pulse(t: float) -> np.ndarray:
        return np.full(4, 5.0 + 15.0 * np.exp(-(((t - 0.075) / 0.005) ** 2)))

    start = ca.Scenario("pulse", LEVEL, rotor_command=pulse, duration=0.15)
    with pytest.warns(ContinuairWarning, match="saturate"):
        exact = ca.simulate(FURNISHED, start, sample=0.05)
    assert float(exact["largest_saturation"]) == pytest.approx(8.0 / 12.0, rel=0.1)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:error_estimate")
@pytest.mark.parametrize(
    ("lag", "amplitude"), [(0.0, 60.0), pytest.param(0.05, 600.0, marks=pytest.mark.soak)]
)
def test_commands_are_followed_where_limits_cut_them_off(lag: float, amplitude: float) -> None:
    """They are smooth as they are given, and nearly jump as they act: off by 0.07 else."""

    def waves(t: float) -> np.ndarray:
        return 4.56 + amplitude * np.sin(38.0 * t + 0.3) * np.array([1.0, 1.0, -1.0, -1.0])

    vehicle = FURNISHED.replace({"uav.rotors.lag": lag})
    start = ca.Scenario("waves", LEVEL, rotor_command=waves, duration=0.5)
    with pytest.warns(ContinuairWarning, match="saturate"):
        found = ca.simulate(vehicle, start, sample=0.01, check=True)
    with pytest.warns(ContinuairWarning, match="saturate"):
        exact = ca.simulate(vehicle, start, sample=0.01, rtol=1e-10)
    off = np.linalg.norm(found.tip_position - exact.tip_position, axis=1).max()
    off /= vehicle.arm.length
    assert off < max(1e-3, 3.0 * float(found.error_estimate)) < 0.02


@pytest.mark.long
def test_pairs_sweeps_and_stepped_flights_tell_of_saturation(tmp_path: Path) -> None:
    pulse = ca.Scenario("thrust", LEVEL, rotor_command=np.full(4, 20.0), duration=0.05)
    with pytest.warns(ContinuairWarning, match="saturate.* 66.7 %"):
        pairs = ca.run_pairs(FURNISHED, pulse, sample=0.01)
    np.testing.assert_allclose(pairs["largest_saturation"], 8.0 / 12.0, rtol=1e-12)
    stepped = ca.Simulation(FURNISHED, ca.Scenario("stepped", LEVEL), control_period=0.01)
    stepped.step(rotor_command=np.full(4, 20.0))
    with pytest.warns(ContinuairWarning, match="saturate"):
        assert float(stepped.trajectory()["largest_saturation"]) > 0.6
    file = tmp_path / "hex.toml"
    write_vehicle(ca.load_vehicle("paper").replace({"uav.rotors": TILTED}), file)
    design = xr.Dataset(
        {"vehicle.uav.mass": ("mass", [1.5, 2.0])},
        attrs={
            "vehicle": str(file),
            "scenario": {"duration": 0.02},
            "controller": {"bandwidth": 8.0},
            "target": {},
            "sample": 0.01,
        },
    )
    with pytest.warns(ContinuairWarning, match="saturate.* 2 of 2 runs"):
        swept = ca.sweep(design, tmp_path / "store.zarr")
    assert (swept["largest_saturation"] > 0.1).all()


@pytest.mark.long
def test_a_full_wrench_flies_a_law_for_ideal_wrenches_on_tilted_rotors() -> None:
    """Without lag and within the limits the flight is that of ideal forces, to rounding."""
    vehicle = SLENDER.replace({"uav.rotors": {**TILTED, "lag": 0.0}})
    law = ca.hold(SLENDER, (0.1, -0.1, 2.1), bend_rate=0.0, rate=1.5, attitude_rate=4.0)
    direct = flown(SLENDER, LEVEL, controller=law)
    flight = flown(vehicle, LEVEL, controller=law, control_period=1e-3)
    np.testing.assert_allclose(flight.position, direct.position, atol=1e-11)
    np.testing.assert_allclose(flight.bend, direct.bend, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("model", ca.MODELS)
def test_rotors_at_rest_and_drag_of_zero_change_nothing(model: str) -> None:
    inert = QUAD.replace({"uav.drag": {}})
    given: dict[str, Any] = {"force": (3.0, 1.0, 20.0), "moment": (0.1, 0.1, -0.1)}
    given |= {"bend_moment": (0.05, 0.01), "model": model}
    bare = flown(SLENDER, **given)
    still = flown(inert, rotor_command=np.zeros(4), **given)
    for name in ("position", "attitude", "bend", "base_moment", "kinetic_energy"):
        np.testing.assert_allclose(still[name], bare[name], rtol=1e-11, atol=1e-11)


@pytest.mark.long
@pytest.mark.parametrize("model", MORE_IN_SOAK)
def test_a_run_of_a_batch_flies_as_alone_and_in_single_precision(model: str) -> None:
    masses, lags = np.linspace(1.8, 2.2, 11), np.linspace(0.0, 0.05, 11)
    batch = FURNISHED.replace({"uav.mass": masses, "uav.rotors.lag": lags})
    given: dict[str, Any] = {"model": model, "wind": breeze, "sample": 0.01}
    together = flown(batch, **given)
    for run in (0, 4, 10):
        alone = flown(batch.select(run), **given)
        for name in ("position", "bend", "rotor_thrust"):
            np.testing.assert_allclose(together[name][run], alone[name], rtol=1e-10, atol=1e-11)
    single = flown(batch, dtype="float32", **given)
    np.testing.assert_allclose(single.position, together.position, atol=2e-4)


@pytest.mark.long
@pytest.mark.parametrize("model", MORE_IN_SOAK)
def test_the_integrators_agree(model: str) -> None:
    given: dict[str, Any] = {"model": model, "rotor_command": swaying, "wind": breeze}
    given |= {"sample": 0.01}
    fine = flown(FURNISHED, method="RK4", step=2e-4, **given)
    reference = flown(FURNISHED, rtol=1e-11, **given)
    for name in ("position", "attitude", "bend", "rotor_thrust"):
        np.testing.assert_allclose(fine[name], reference[name], rtol=1e-8, atol=1e-8)
    coarse, finer = (
        np.abs(
            flown(FURNISHED, method="implicit", step=h, **given).rotor_thrust - fine.rotor_thrust
        )
        for h in (1e-3, 5e-4)
    )
    # Of second order: halving leaves a quarter.
    assert 3.5 < float(coarse.max() / finer.max()) < 4.5


def test_a_simulation_flies_as_simulate_does() -> None:
    scenario = ca.Scenario("hover", BENT, wind=breeze, duration=0.1)
    simulation = ca.Simulation(FURNISHED, scenario, control_period=0.01)
    for _ in range(10):
        simulation.step(np.zeros(8))
    stepped = simulation.trajectory()
    step = stepped.attrs["step"]
    whole = ca.simulate(FURNISHED, scenario, sample=0.01, method="RK4", step=step)
    for name in ("position", "bend", "rotor_thrust", "saturation", "rotor_power"):
        np.testing.assert_allclose(stepped[name], whole[name], rtol=1e-9, atol=1e-9)


def test_trim_and_linearize_are_those_of_ideal_wrenches() -> None:
    bend = (0.3, 0.1)
    ideal, own = (ca.trim(vehicle, bend=bend) for vehicle in (SLENDER, QUAD))
    np.testing.assert_allclose(own.force, ideal.force, rtol=1e-12)
    np.testing.assert_allclose(own.moment, ideal.moment, rtol=1e-9)
    A, B = ca.linearize(QUAD, ideal.q, force=ideal.force, moment=ideal.moment)
    A0, B0 = ca.linearize(SLENDER, ideal.q, force=ideal.force, moment=ideal.moment)
    np.testing.assert_allclose(A, A0, atol=1e-6)
    np.testing.assert_allclose(B, B0, atol=1e-6)
    np.testing.assert_allclose(
        ca.modes(QUAD, base="clamped").frequencies, ca.modes(SLENDER, base="clamped").frequencies
    )


def test_results_of_rotors_survive_a_round_trip_through_a_file(tmp_path: Path) -> None:
    flight = flown(FURNISHED, LEVEL, duration=0.05)
    flight.to_netcdf(tmp_path / "flight.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "flight.nc", engine="h5netcdf") as read:
        xr.testing.assert_identical(read.load(), flight)
    assert flight.rotor_thrust.dims == ("time", "rotor") and flight.saturation.dims == ("time",)


UNUSABLE: list[tuple[ca.Vehicle, dict[str, Any], str]] = [
    (SLENDER, {"wind": (1.0, 0.0, 0.0)}, "wind"),
    (SLENDER, {"rotor_command": (1.0,)}, "scenario.rotor_command"),
    (QUAD, {"rotor_command": np.ones(6)}, "scenario.rotor_command"),
    (QUAD, {"rotor_thrust": np.ones(3)}, "scenario.rotor_thrust"),
    (QUAD, {"rotor_thrust": np.full(4, 13.0)}, "scenario.rotor_thrust"),
    (QUAD, {"rotor_thrust": -np.ones(4)}, "rotor_thrust"),
    (QUAD, {"rotor_command": "full"}, "rotor_command"),
    (QUAD, {"controller": ca.hold(SLENDER, (0, 0, 2))}, "controller"),
    (QUAD.replace({"uav.rotors.lever": 0.01}), {"q": (0, 0, 2, 0, 0, 0, 2.0, 0)},
     "uav.rotors.thrust_limits"),
]  # fmt: skip


@pytest.mark.parametrize(("vehicle", "given", "field"), UNUSABLE, ids=lambda value: str(value)[:30])
def test_what_rotors_and_air_cannot_do_is_refused_in_one_sentence(
    vehicle: ca.Vehicle, given: dict[str, Any], field: str
) -> None:
    with refused(field):
        flown(vehicle, **{"q": LEVEL} | given)


@pytest.mark.long
@pytest.mark.parametrize("name", [next(iter(EXCITATIONS)), "release"])
def test_studies_excite_a_vehicle_with_rotors_by_direct_forces(name: str) -> None:
    """Rotors stand still then, and the flight is that of the vehicle without them."""
    flights = [
        ca.simulate(vehicle, standard_scenario(name, vehicle), duration=0.3, sample=0.01)
        for vehicle in (SLENDER, QUAD)
    ]
    np.testing.assert_allclose(flights[1].tip_position, flights[0].tip_position, atol=1e-9)
    assert float(flights[1].rotor_thrust.max()) == 0.0


def test_a_gradient_refuses_rotors_in_one_sentence() -> None:
    with refused("vehicle"):
        ca.gradient(QUAD, ca.Scenario("hover", LEVEL), lambda flight: (0.0, {}))


def test_a_command_beside_a_controller_adds_to_what_its_push_asks_for() -> None:
    prompt = FURNISHED.replace({"uav.rotors.lag": 0.0})
    law = constant_push([0.0, 0.0, 20.0], [0.0, 0.0, 0.0])
    flight = flown(prompt, LEVEL, controller=law, rotor_command=(1.0, 2.0, 3.0, 4.0), duration=0.01)
    np.testing.assert_allclose(flight.rotor_thrust[0], [6.0, 7.0, 8.0, 9.0], rtol=1e-12)


@pytest.mark.long
def test_lagging_rotors_under_a_controller_start_at_hover_and_what_a_command_adds() -> None:
    law = ca.flight_controller(QUAD)
    q = (0.0, 0.0, 2.0, *np.zeros(5))
    still = flown(QUAD, q, controller=law, rotor_command=np.zeros(4), duration=0.5, sample=0.01)
    assert float(np.abs(still.position - [0.0, 0.0, 2.0]).max()) < 1e-9
    more = flown(QUAD, q, controller=law, rotor_command=(0.1, 0.0, 0.0, 0.0), sample=0.01)
    added = more.rotor_thrust[0] - still.rotor_thrust[0]
    np.testing.assert_allclose(added, [0.1, 0.0, 0.0, 0.0], rtol=0, atol=1e-9)
