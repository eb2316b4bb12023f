"""A multirotor alone is a vehicle, too: a rigid body with rotors, air, laws, logs and pictures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import continuair as ca
from continuair.identification import Recording, fit
from continuair.studies.check import at_rest, facts, modes_of
from continuair.typing import Model
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused

BARE = ca.Vehicle(name="bare", uav={"mass": 1.3, "inertia": [0.01, 0.015, 0.02]})
QUAD = ca.Vehicle(
    name="quad",
    uav={
        "mass": 1.2,
        "inertia": [0.012, 0.012, 0.02],
        "rotors": {
            "layout": "quad_x",
            "lever": 0.2,
            "thrust_limits": [0.0, 8.0],
            "torque_per_thrust": 0.016,
            "lag": 0.03,
            "radius": 0.12,
        },
        "drag": {"linear": [0.25, 0.25, 0.3]},
    },
)
FORCE, MOMENT = [1.0, -2.0, 10.0], [2e-3, 0.0, -1e-3]
TUMBLE = ca.Scenario(
    "tumble", [0, 0, 5, 0.1, 0.2, 0.3], [1, 0, 0, 4.0, -3.0, 2.0], force=FORCE, moment=MOMENT
)
AHEAD = ca.Scenario(
    "ahead",
    [0, 0, 2, 0, 0, 0],
    controller=ca.flight_controller(QUAD),
    setpoints=ca.Setpoints(position=lambda t: [min(t, 1.0), 0.0, 2.0]),
    duration=6.0,
)


def rigid_body() -> np.ndarray:
    """The state after 1 s, by Newton and Euler."""
    inertia = np.diag([0.01, 0.015, 0.02])
    force = np.array(FORCE) - [0.0, 0.0, 9.81 * 1.3]

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        (x, y_, z, w), spin = y[3:7], y[10:13]
        p, q, r = spin
        turning = np.array(
            [w * p + y_ * r - z * q, w * q + z * p - x * r, w * r + x * q - y_ * p]
            + [-x * p - y_ * q - z * r]
        )
        spun = np.linalg.solve(inertia, MOMENT - np.cross(spin, inertia @ spin))
        return np.concatenate([y[7:10], 0.5 * turning, force / 1.3, spun])

    start = state_from_paper(np.array([TUMBLE.q]), np.array([TUMBLE.qd]), Layout.of_arcs())[0]
    return np.asarray(solve_ivp(rate, (0.0, 1.0), start, rtol=1e-12, atol=1e-12).y[:, -1])


@pytest.mark.parametrize("model", ["coupled", "decoupled", "independent"])
@pytest.mark.parametrize(
    ("options", "tolerance"),
    [({"rtol": 1e-10}, 1e-9), ({"method": "RK4", "step": 1e-3}, 1e-9)]
    + [({"method": "implicit", "step": 2e-4}, 1e-5)],
)
def test_it_flies_as_a_rigid_body(model: Model, options: dict[str, Any], tolerance: float) -> None:
    flight, expected = ca.simulate(BARE, TUMBLE, model=model, **options), rigid_body()
    for name, at in (("position", slice(3)), ("attitude", slice(3, 7))):
        np.testing.assert_allclose(flight[name][-1], expected[at], rtol=0, atol=tolerance)
    inertia, spin, speed = np.diag([0.01, 0.015, 0.02]), expected[10:13], expected[7:10]
    energy = 0.5 * 1.3 * speed @ speed + 0.5 * spin @ inertia @ spin
    assert float(flight["kinetic_energy"][-1]) == pytest.approx(energy, rel=10 * tolerance)


@pytest.mark.long
def test_its_results_have_no_arms_and_its_lengths_are_a_rotors_lever() -> None:
    flight = ca.simulate(QUAD, AHEAD, sample=0.02, check=True)
    assert not {"arm", "section"} & set(flight.dims)
    assert float(flight["error_estimate"]) < 1e-3
    assert QUAD.reach == pytest.approx(0.2) and BARE.reach == 1.0
    np.testing.assert_allclose(flight["position"][-1], [1.0, 0.0, 2.0], rtol=0, atol=0.03)
    asked = ca.simulate(QUAD, AHEAD, sample=1.0, variables=["q"])
    assert asked["q"].sizes["coordinate"] == 6


@pytest.mark.long
def test_batches_and_single_runs_have_the_same_bits() -> None:
    masses = [1.1, 1.2, 1.3, 1.25, 1.15]
    batch = ca.simulate(QUAD.replace({"uav.mass": masses}), AHEAD, duration=0.5, sample=0.1)
    for run, mass in enumerate(masses):
        alone = ca.simulate(QUAD.replace({"uav.mass": mass}), AHEAD, duration=0.5, sample=0.1)
        one = batch["position"].isel(run=run).to_numpy()
        np.testing.assert_array_equal(one, alone["position"].to_numpy())


@pytest.mark.long
def test_its_camera_is_where_an_arm_would_begin() -> None:
    target = ca.Target(ca.paths.hold([0.0, 0.0, 0.0], 10.0))
    law = ca.twist_servoing(QUAD, conditioning=0.0)
    scenario = ca.Scenario("above", [0.3, 0, 2, 0, 0, 0], controller=law, target=target)
    flight = ca.simulate(QUAD, scenario, duration=10.0, sample=0.5)
    np.testing.assert_array_equal(flight["camera_position"], flight["position"])
    error = np.linalg.norm(flight["feature_error"], axis=-1)
    assert error[-1] < 0.02 * error[0]


def test_its_accelerations_are_those_of_a_rigid_body() -> None:
    push = np.array([1.0, 2.0, 3.0, 0.1, -0.2, 0.3])
    expected = push / [1.3, 1.3, 1.3, 0.01, 0.015, 0.02] - 9.81 * np.eye(6)[2]
    found = ca.forward_dynamics(BARE, np.zeros(6), np.zeros(6), push)
    np.testing.assert_allclose(np.squeeze(found), expected, rtol=1e-12)
    linear, angular, bends = ca.accelerations(BARE, force=push[:3], moment=push[3:])
    np.testing.assert_allclose([*linear, *angular], expected, rtol=1e-12)
    assert bends.size == 0


def test_environments_hold_its_uav() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    pytest.importorskip("continuair.interfaces.gym")
    hover = gymnasium.make("continuair/Hover-v0", vehicle=QUAD, hold="uav")
    observed, _ = hover.reset(seed=0)
    assert hover.action_space.shape == (4,) and np.isfinite(observed).all()
    with refused("hold"):
        gymnasium.make("continuair/Hover-v0", vehicle=QUAD)


def test_its_linear_system_is_that_of_a_rigid_body() -> None:
    A, B = ca.linearize(BARE, np.zeros(6), force=[0.0, 0.0, 9.81 * 1.3])
    expected = np.block([[np.zeros((6, 6)), np.eye(6)], [np.zeros((6, 12))]])
    np.testing.assert_allclose(A, expected, rtol=0, atol=1e-12)
    inverse = np.diag(1.0 / np.array([1.3, 1.3, 1.3, 0.01, 0.015, 0.02]))
    np.testing.assert_allclose(B[6:, :6], inverse, rtol=1e-12, atol=1e-12)


@pytest.mark.long
def test_it_is_identified_from_a_recorded_flight() -> None:
    rng, times = np.random.default_rng(0), np.arange(51) * 0.02
    commands = 2.9 + 0.4 * rng.standard_normal((len(times), 4))
    scenario = ca.Scenario(
        "recorded",
        [0, 0, 2, 0.05, -0.02, 0.1],
        rotor_command=lambda t: commands[min(int(t / 0.02 + 1e-6), 50)],
    )
    flight = ca.simulate(QUAD, scenario, sample=0.02, rtol=1e-9)
    recording = Recording(
        name="flight",
        time=np.asarray(times, float),
        position=flight["position"].to_numpy(),
        attitude=flight["attitude"].to_numpy(),
        bend=np.zeros((len(times), 0)),
        inputs=None,
        rotor_command=commands,
    )
    start = QUAD.replace({"uav.mass": 1.4, "uav.inertia": [0.015, 0.01, 0.02]})
    found = fit(start, recording, ["uav.mass", "uav.inertia.0.0", "uav.inertia.1.1"])
    np.testing.assert_allclose(
        [found.vehicle.uav.mass, *np.diag(found.vehicle.uav.inertia)[:2]],
        [1.2, 0.012, 0.012],
        rtol=1e-6,
    )


@pytest.mark.long
def test_it_is_written_checked_shown_and_exported(tmp_path: Path) -> None:
    (tmp_path / "quad.toml").write_text(as_toml(QUAD), encoding="utf-8")
    assert ca.load_vehicle(tmp_path / "quad.toml") == QUAD
    assert ca.Vehicle(**QUAD.describe()) == QUAD
    rest = at_rest(QUAD)
    assert [name for name, _ in facts(QUAD, rest)] == ["mass", "rotors' margin"]
    assert modes_of(QUAD, rest) == []
    flight = ca.simulate(QUAD, AHEAD, duration=0.5, sample=0.1)
    flight.to_netcdf(tmp_path / "flight.nc", engine="h5netcdf")
    again = ca.read_result(tmp_path / "flight.nc")
    ca.to_gltf(again, tmp_path / "flight.glb")
    ca.to_csv(again, tmp_path / "flight.csv")
    ca.animate(again, tmp_path / "flight.gif")
    assert {path.suffix for path in tmp_path.iterdir()} == {".toml", ".nc", ".glb", ".csv", ".gif"}


@pytest.mark.parametrize(
    ("field", "ask"),
    [
        ("vehicle", lambda: ca.modes(BARE)),
        ("vehicle", lambda: ca.run_pairs(BARE, TUMBLE)),
        ("vehicle", lambda: ca.curvature_error(BARE)),
        ("variables", lambda: ca.simulate(BARE, TUMBLE, variables=["tip_position"])),
        ("variables", lambda: ca.simulate(BARE, TUMBLE, variables=["bend"])),
        ("coupled", lambda: ca.compare(*[ca.simulate(BARE, TUMBLE, duration=0.1)] * 2)),
        ("flight", lambda: ca.plot.bend(ca.simulate(BARE, TUMBLE, duration=0.1))),
        ("vehicle", lambda: ca.equations.camera_pose(BARE, np.zeros(6))),
        ("vehicle", lambda: ca.backbone(BARE, ca.simulate(BARE, TUMBLE, duration=0.1))),
    ],
)
def test_what_needs_an_arm_says_so(field: str, ask: Any) -> None:
    with refused(field) as caught:
        ask()
    assert "no arm" in caught.value.problem


@pytest.mark.long
def test_mujoco_sees_what_its_camera_sees(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    camera = {"position": [0.02, 0.0, 0.03], "attitude": [0.1, 0.0, 0.0, 0.995]}
    described: dict[str, Any] = QUAD.describe()
    uav = {**described["uav"], "mount": [0.1, 0.0, -0.05]}
    vehicle = ca.Vehicle(name="seeing", uav=uav, camera=camera)
    ca.to_mjcf(vehicle, tmp_path / "quad.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "quad.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    target = ca.Target(ca.paths.hold([0.1, 0.0, -3.0], 1.0))
    law = ca.hold(vehicle, [0.0, 0.0, 0.0])
    scenario = ca.Scenario("at rest", np.zeros(6), controller=law, target=target, duration=1e-3)
    bare = vehicle.replace({"uav.rotors": None, "uav.drag": None})
    flight = ca.simulate(bare, scenario)
    np.testing.assert_allclose(data.cam_xpos[0], flight["camera_position"][0], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "size", "field"),
    [("tip_wrench", 6, "scenario.tip_wrench"), ("bend_moment", 2, "bend_moment")],
)
def test_inputs_of_an_arm_are_refused(name: str, size: int, field: str) -> None:
    with refused(field):
        ca.simulate(BARE, TUMBLE.replace(**{name: np.zeros(size)}))
