"""What only shows along a flight: unit attitudes, whole turns of the bend, an arm left alone."""

import numpy as np
import pytest

import continuair as ca

VEHICLE = ca.load_vehicle("paper")


@pytest.mark.filterwarnings("ignore:step_error reaches")
def test_an_attitude_stays_of_unit_norm_in_a_tumble_at_a_coarse_step() -> None:
    """RK4 alone would shrink it by a share of (ω h)⁶ per step."""
    tumble = ca.Scenario("tumble", [0.0] * 8, [0, 0, 0, 30.0, 2.0, 1.0, 0, 0], duration=1.0)
    with pytest.warns(ca.ContinuairWarning, match="too coarse"):
        flight = ca.simulate(VEHICLE, tumble, step=1e-2, sample=1e-2, variables=["attitude"])
    norm = np.linalg.norm(flight["attitude"], axis=-1)
    np.testing.assert_allclose(norm, 1.0, rtol=0, atol=4 * np.finfo(float).eps)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_direction_of_an_orbiting_bend_counts_whole_turns(sense: float) -> None:
    """A bend that circles fast enough for the spring to hold it there, on a heavy UAV."""
    heavy = VEHICLE.replace({"uav.mass": 1e4, "uav.inertia": [1e4, 1e4, 1e4]})
    rate = heavy.arm.clamped_frequency
    orbit = ca.Scenario(
        "orbit", [0, 0, 0, 0, 0, 0, 0.3, 0], [0, 0, 0, 0, 0, 0, 0, sense * rate], gravity=0.0
    )
    turns = 4.0
    flight = ca.simulate(heavy, orbit, duration=turns * 2.0 * np.pi / rate, sample=1e-3)
    psi = flight["q"].sel(coordinate="psi_a").to_numpy()
    assert (sense * np.diff(psi) > 0.0).all()
    # A share of a thousandth: the bend of 0.3 rad stiffens the orbit a little.
    assert psi[-1] == pytest.approx(sense * turns * 2.0 * np.pi, rel=0.02)


def test_the_arm_of_the_independent_model_knows_nothing_of_how_the_uav_turns() -> None:
    """Neither does a force on its tip: it acts as on the base that it starts with."""
    wrench = np.array([2.0, 1.0, 0.5, 0.1, -0.2, 0.0])
    bends = [
        ca.simulate(
            VEHICLE,
            ca.Scenario(
                "turning", [0, 0, 0, 0.2, -0.1, 0.5, 0.4, 0.3], [0, 0, 0, *spin, 0, 0],
                tip_wrench=wrench, duration=0.3,
            ),
            model="independent",
            step=5e-4,
        )["bend"]
        for spin in ((0.0, 0.0, 0.0), (1.0, -2.0, 3.0))
    ]  # fmt: skip
    np.testing.assert_allclose(bends[0], bends[1], rtol=0, atol=1e-12)


def test_angular_momentum_is_about_the_origin_of_the_world() -> None:
    """Of a straight vehicle that moves without turning: its centre of mass times its momentum."""
    position, velocity = np.array([1.0, 2.0, 3.0]), np.array([0.5, -1.0, 2.0])
    start = [*position, 0, 0, 0, 0, 0], [*velocity, 0, 0, 0, 0, 0]
    flight = ca.simulate(VEHICLE, ca.Scenario("thrown", *start, duration=1e-3))
    arm = VEHICLE.arm
    below = arm.backbone_mass * arm.length / 2.0 + sum(d.mass * d.position for d in arm.disks)
    centre = position + np.asarray(VEHICLE.uav.mount) * arm.mass / VEHICLE.mass
    centre[2] -= below / VEHICLE.mass
    expected = np.cross(centre, VEHICLE.mass * velocity)
    np.testing.assert_allclose(flight["angular_momentum"][0], expected, rtol=1e-12)


@pytest.mark.parametrize("model", ["decoupled", "independent"])
def test_a_flight_of_a_simpler_model_swings_its_arm_as_on_a_clamped_base(model: str) -> None:
    """Its inertia is about the arm's own base, where the coupled one is at hand too."""
    rate = VEHICLE.arm.clamped_frequency
    undamped = VEHICLE.replace({"arm.damping": 0.0})
    released = ca.Scenario("released", [0, 0, 0, 0, 0, 0, 1e-3, 0], gravity=0.0)
    flight = ca.simulate(
        undamped, released, model=model, duration=2.0 * np.pi / rate, sample=1e-4, step=1e-4
    )
    expected = 1e-3 * np.cos(rate * flight["time"].to_numpy())
    np.testing.assert_allclose(flight["bend"][:, 0], expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("pitch", [1.3, 2.0, -2.0])
def test_a_pitch_torque_does_the_work_of_its_pitch_past_a_quarter_turn(pitch: float) -> None:
    """It is conjugate to the pitch of q, which goes on beyond π/2, where cos θ is negative."""
    vehicle, torque = ca.load_vehicle("paper"), 0.05
    q, qd = np.zeros((2, 8))
    q[4], qd[4] = pitch, 0.5
    scenario = ca.Scenario("pitch", q, qd, tau=torque * np.eye(8)[4], gravity=0.0, duration=2.5)
    flight = ca.simulate(vehicle, scenario, sample=0.05)
    angles, energy = flight["q"].sel(coordinate="pitch"), flight.kinetic_energy
    gained = (energy + flight.elastic_energy) - float(energy[0] + flight.elastic_energy[0])
    turned = angles - float(angles[0])
    np.testing.assert_allclose(gained, torque * turned, rtol=0, atol=1e-8)
    assert float(abs(turned[-1])) > 1.0
    stepped = ca.Simulation(vehicle, scenario.replace(tau=None), control_period=0.05)
    for _ in range(50):
        stepped.step(torque * np.eye(8)[4])
    np.testing.assert_allclose(stepped.q[4] - pitch, turned[-1], rtol=1e-6)


@pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw are not followed")
def test_a_pass_near_gimbal_lock_under_euler_torques_counts_in_step_error() -> None:
    """A torque along yaw grows as 1/cos θ there, in less than a step."""
    q, qd = np.zeros((2, 8))
    q[4], qd[4] = 1.5, 2.0
    scenario = ca.Scenario("yaw", q, qd, tau=1e-3 * np.eye(8)[5], gravity=0.0, duration=0.1)
    vehicle = ca.load_vehicle("slender")
    with pytest.warns(ca.ContinuairWarning, match="step_error reaches"):
        flight = ca.simulate(vehicle, scenario, step=2e-3, sample=0.01)
    assert float(flight.step_error) > 0.1
    away = scenario.replace(q=q - np.eye(8)[4])
    assert float(ca.simulate(vehicle, away, step=2e-3, sample=0.01).step_error) < 1e-3
