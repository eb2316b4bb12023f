"""Motors of tendons: lag, rate, stroke and slack, controllers that pull, and what refuses them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused
from tests.sections.strains import rod
from tests.tendons.pulled import DISKS, FOUR, floating, pulled

TENSIONS = {"pretension": 2.0, "lag": 0.03}
LENGTHS = {"command": "length", "stiffness": 2e4, "pretension": 5.0}
ROTORS = {
    "layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 12.0], "torque_per_thrust": 0.016,
    "lag": 0.03,
}  # fmt: skip


def still(vehicle: ca.Vehicle, command: Any, duration: float = 0.1, **others: Any) -> ca.Scenario:
    """Return a flight that starts at rest in weightlessness."""
    at = np.zeros(vehicle.layout.coordinates)
    return ca.Scenario("still", at, gravity=0.0, duration=duration, tendon_command=command,
                       **others)  # fmt: skip


def stepped(t: float) -> Any:
    return [1.0 * (t >= 0.01), 0.0, 0.0, 0.0]


def test_a_motor_follows_its_command_with_a_lag_and_a_greatest_rate() -> None:
    vehicle = pulled(TENSIONS)
    flight = ca.simulate(vehicle, still(vehicle, stepped, jumps=(0.01,)), rtol=1e-9)
    t = np.maximum(flight["time"].to_numpy() - 0.01, 0.0)
    found = flight["tendon_tension"].to_numpy()
    assert found[:, 0] == pytest.approx(3.0 - np.exp(-t / 0.03), abs=1e-8)
    assert found[:, 1:] == pytest.approx(2.0)
    slow = vehicle.replace({"arm.0.tendon.0.rate": [5.0, 10.0]})
    flights = ca.simulate(slow, still(vehicle, stepped, jumps=(0.01,)), rtol=1e-9)
    for run, rate in ((0, 5.0), (1, 10.0)):
        # At the greatest rate, until the lag asks for less.
        until = 1.0 / rate - 0.03
        held = t < until
        found = flights["tendon_tension"].to_numpy()[run, :, 0]
        assert found[held] == pytest.approx(2.0 + rate * t[held], abs=1e-7)


def test_a_winch_keeps_its_stroke_and_a_motor_its_limits() -> None:
    winch = pulled(LENGTHS | {"stroke": [-1e-4, 2e-4]}, damping_ratio=1.0)
    with pytest.warns(ca.ContinuairWarning, match="saturate"):
        flight = ca.simulate(winch, still(winch, [1e-3, 0.0, 0.0, 0.0]))
    assert float(flight["largest_saturation"]) == pytest.approx(8.0 / 3.0)
    first = float(flight["tendon_tension"][0, 0])
    assert first == pytest.approx(5.0 + 2e4 * 2e-4, rel=1e-12)
    limited = pulled({"pretension": 2.0, "limits": [1.0, 4.0]})
    with pytest.warns(ca.ContinuairWarning, match="saturate"):
        flight = ca.simulate(limited, still(limited, [9.0, -9.0, 0.5, 0.0]))
    assert float(flight["largest_saturation"]) == pytest.approx(8.0 / 3.0)
    assert flight["tendon_tension"][-1].to_numpy().tolist() == [4.0, 1.0, 2.5, 2.0]


def test_a_winch_that_lets_go_leaves_a_slack_tendon_and_takes_it_up_again() -> None:
    vehicle = pulled(LENGTHS | {"pretension": 1.0}, damping_ratio=0.5)

    def command(t: float) -> Any:
        return [-5e-4 * np.sin(np.pi * t / 0.1) ** 2, 0.0, 0.0, 0.0]

    flight = ca.simulate(vehicle, still(vehicle, command), rtol=1e-8)
    tension, slack, length = (
        flight[f"tendon_{name}"].to_numpy()[:, 0] for name in ("tension", "slack", "length")
    )
    taken = np.array([command(t)[0] for t in flight["time"].to_numpy()])
    stretch = 1.0 / 2e4 + taken + length - 0.5
    assert tension == pytest.approx(2e4 * np.maximum(stretch, 0.0), abs=1e-9)
    assert slack == pytest.approx(np.maximum(-stretch, 0.0), abs=1e-13)
    assert slack.max() > 1e-4
    assert tension[-1] > 0.5
    with refused("scenario.tendon_command"):
        ca.simulate(vehicle, still(vehicle, [-1e-3, 0.0, 0.0, 0.0]))


@pytest.mark.long
def test_damped_tendons_take_energy_while_taut() -> None:
    free, damped = (
        pulled(LENGTHS | {"damping": damping, "pretension": 20.0}, damping_ratio=0.0)
        for damping in (0.0, 40.0)
    )
    lost = []
    for vehicle in (free, damped):
        flight = ca.simulate(vehicle, floating(vehicle), rtol=1e-9)
        parts = [flight[f"{name}_energy"] for name in ("kinetic", "elastic")]
        energy = (sum(parts) + flight["tendon_energy"].sum("tendon")).to_numpy()
        lost.append((energy[0] - energy) / np.ptp(flight["elastic_energy"].to_numpy()))
        assert float(flight["tendon_slack"].max()) == 0.0
    assert np.abs(lost[0]).max() < 1e-5
    assert np.diff(lost[1]).min() > -1e-7
    assert lost[1][-1] > 0.05


@pytest.mark.long
def test_a_run_of_a_batch_is_the_same_alone_and_with_any_method() -> None:
    """With friction, lags and winches of both kinds, over differing numbers."""
    vehicle = pulled(TENSIONS | {"friction": 0.2}, LENGTHS | {"friction": 0.1, "lag": 0.01},
                     sections=[rod(disks=DISKS), rod(length=0.3)])  # fmt: skip
    draw = np.random.default_rng(4)
    batch = vehicle.replace({
        "arm.0.tendon.0.friction": draw.uniform(0.0, 0.4, 9),
        "arm.0.tendon.1.pretension": draw.uniform(4.0, 8.0, 9),
        "arm.0.tendon.0.offset": draw.uniform(0.01, 0.02, (9, 2)),
    })  # fmt: skip
    scenario = floating(vehicle, 0.05, tendon_command=[3.0, 0.0, 1.0, 0.0, 1e-4, 0.0, 0.0, 0.0])
    names = ("position", "bend", "tendon_tension", "tendon_friction_power")
    together = ca.simulate(batch, scenario, sample=0.01)
    for run in (0, 8):
        alone = ca.simulate(batch.select(run), scenario, sample=0.01)
        for name in ("position", "bend"):
            assert (alone[name].to_numpy() == together[name].to_numpy()[run]).all(), name
    stepped = ca.simulate(batch, scenario, method="RK4", step=1e-5, sample=0.01)
    exact = ca.simulate(batch, scenario, rtol=1e-9, sample=0.01)
    for name in names:
        one, other = (flight[name].to_numpy() for flight in (stepped, exact))
        assert np.abs(one - other).max() < 2e-3 * np.abs(other).max(), name


@pytest.mark.long
def test_a_flight_controller_bends_the_arm_by_its_tendons() -> None:
    bare = pulled(sections=[rod(damping_ratio=0.1), rod(length=0.3, damping_ratio=0.1)])
    groups = [
        {"angles": [0.0, 2.1, 4.2], "offset": 0.01, "section": part, "pretension": 1.0,
         "limits": [0.5, 60.0]} for part in ("0", "1")
    ]  # fmt: skip
    # Rounded as in a file.
    groups[0]["angles"] = groups[1]["angles"] = [0.0, 2.0944, 4.1888]
    vehicle = bare.replace({"arm.0.tendon": groups, "uav.rotors": ROTORS})
    law = ca.flight_controller(vehicle)
    goal = [0.8, 0.0, -0.4, 0.5]
    points = ca.Setpoints(position=[0.0, 0.0, 2.0], bend=goal)
    start = np.zeros(vehicle.layout.coordinates)
    start[2] = 2.0
    scenario = ca.Scenario("bends", start, duration=4.0, controller=law, setpoints=points)
    flight = ca.simulate(vehicle, scenario, sample=0.01)
    plain = bare.replace({"uav.rotors": ROTORS})
    without = ca.simulate(plain, scenario.replace(controller=ca.flight_controller(plain)),
                          sample=0.01)  # fmt: skip
    end, same = (each["bend"].to_numpy()[-1] for each in (flight, without))
    assert end == pytest.approx(same, abs=0.02)
    assert float(flight["tendon_tension"].min()) >= 0.5
    # The tendons exert what the law asks for.
    pulls = flight["tendon_tension"].to_numpy()
    assert np.ptp(pulls[-1]) > 0.5
    assert float(np.abs(flight["position"][-1, :2]).max()) < 0.05


def test_commands_reach_the_tendons_by_every_way(tmp_path: Path) -> None:
    vehicle = pulled(TENSIONS)
    for wrong in ([1.0, 2.0], np.zeros((3, 5)), lambda t: [1.0]):
        with refused("scenario.tendon_command"):
            ca.simulate(vehicle, still(vehicle, wrong))
    with refused("scenario.tendon_command"):
        bare = ca.load_vehicle("paper")
        ca.simulate(bare, still(bare, [1.0]))
    ramp = [1.0, 0.0, 0.0, 0.5]
    flight = ca.simulate(vehicle, still(vehicle, ramp), method="RK4", step=1e-3)
    one = ca.Simulation(vehicle, still(vehicle, None), step=1e-3)
    for _ in range(100):
        one.step(tendon_command=ramp)
    late = one.trajectory()["tendon_tension"][-1].to_numpy()
    whole = flight["tendon_tension"][-1].to_numpy()
    # The motors of the first start at the command, those of the second follow it.
    assert whole == pytest.approx([3.0, 2.0, 2.0, 2.5])
    assert late == pytest.approx(2.0 + np.array(ramp) * (1.0 - np.exp(-0.1 / 0.03)), rel=1e-6)
    file = tmp_path / "pulled.toml"
    file.write_text(as_toml(vehicle), encoding="utf-8")
    assert ca.load_vehicle(file) == vehicle
    assert flight["tendon"].to_numpy().tolist() == [f"0.0.{n}" for n in range(4)]


@pytest.mark.long
def test_an_environment_pulls_the_tendons() -> None:
    pytest.importorskip("gymnasium")
    from continuair.interfaces.gym import HoverEnv

    vehicle = pulled(TENSIONS).replace({"uav.rotors": ROTORS})
    env = HoverEnv(vehicle, tendon_command=4.0)
    env.reset(seed=1)
    assert env.action_space.shape == (8,)
    env.step(np.ones(8, np.float32))
    with refused("tendon_command"):
        HoverEnv(tendon_command=1.0)


def test_what_has_no_tendons_refuses_the_vehicle(tmp_path: Path) -> None:
    vehicle = pulled(TENSIONS)
    for call in (
        lambda: ca.to_mjcf(vehicle, tmp_path / "arm.xml"),
        lambda: ca.equations.forward_dynamics(vehicle, np.zeros(8), np.zeros(8)),
        lambda: ca.equations.rod_accelerations(vehicle, strain=np.zeros(2)),
        lambda: ca.gradient(vehicle, still(vehicle, None), lambda flight: (0.0, {})),
    ):
        with refused("vehicle"):
            call()
    with refused("method"):
        ca.simulate(vehicle, still(vehicle, None), method="implicit", step=1e-3)
    pytest.importorskip("casadi")
    with refused("vehicle"):
        ca.to_casadi(vehicle)


@pytest.mark.long
@pytest.mark.parametrize("period", [1e-3, None])
def test_visual_servoing_pulls_as_it_would_push(period: float | None) -> None:
    """Tendons without friction exert the moments that the law asks for."""
    bare = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
    group = {"angles": FOUR, "offset": 0.02, "pretension": 300.0, "limits": [0.0, 5000.0]}
    start = [-0.3, -0.4, 3.1, 0, 0, 0, 0.1, 0]
    found = []
    for vehicle in (bare, bare.replace({"arm.tendon": [group]})):
        law = ca.servoing(**ca.design(vehicle, bandwidth=8.0))
        target = ca.Target(ca.paths.letter("M", duration=20.0))
        letter = ca.Scenario("M", start, controller=law, target=target, duration=1.0,
                             control_period=period)  # fmt: skip
        found.append(ca.simulate(vehicle, letter, sample=0.05))
    for name in ("position", "bend", "feature_error"):
        pushed, pulled_by = (flight[name].to_numpy() for flight in found)
        assert np.abs(pulled_by - pushed).max() < 1e-7 * np.abs(pushed).max(), name
    assert float(found[1]["tendon_tension"].min()) >= 0.0


@pytest.mark.long
def test_winches_keep_their_lengths_under_a_controller_that_does_not_bend() -> None:
    """And a pretension on one side is part of what the controller's own moment needs."""
    group = {"angles": FOUR, "offset": 0.02, "command": "length", "stiffness": 2e4,
             "pretension": 2.0}  # fmt: skip
    vehicle = pulled(group, damping_ratio=0.2).replace({"uav.rotors": ROTORS})
    q = np.zeros(8)
    q[2] = 1.0
    held = ca.tendon_tensions(vehicle, [0.8, 0.4])
    law = ca.flight_controller(vehicle, bend_bandwidth=0.0)

    def ramp(t: float) -> Any:
        return held.command * min(t / 0.5, 1.0)

    scenario = ca.Scenario("winches", q, controller=law, tendon_command=ramp, duration=2.0)
    flight = ca.simulate(vehicle, scenario, sample=0.02)
    assert flight["bend"].to_numpy()[-1, 0] == pytest.approx([0.8, 0.4], abs=0.02)
    one = {"angles": [0.0], "offset": 0.02, "pretension": 2.0, "limits": [0.5, 60.0]}
    single = pulled(one, damping_ratio=0.2).replace({"uav.rotors": ROTORS})
    goal = ca.Setpoints(position=[0.0, 0.0, 1.0], bend=[1.0, 0.0])
    bent = ca.Scenario("one", q, controller=ca.flight_controller(single), setpoints=goal,
                       duration=3.0)  # fmt: skip
    end = ca.simulate(single, bent, sample=0.02)["bend"].to_numpy()[-1, 0]
    assert end[0] == pytest.approx(1.0, abs=0.02)
