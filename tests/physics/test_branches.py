"""What only shows along a flight: unit attitudes, whole turns of the bend, an arm left alone."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.typing import Model

VEHICLE, SLENDER = ca.load_vehicle("paper"), ca.load_vehicle("slender")


def test_an_attitude_stays_of_unit_norm_in_a_tumble_at_a_coarse_step() -> None:
    """RK4 alone would shrink it by a share of (ω h)⁶ per step."""
    tumble = ca.Scenario("tumble", [0.0] * 8, [0, 0, 0, 30.0, 2.0, 1.0, 0, 0], duration=1.0)
    with pytest.warns(ca.ContinuairWarning, match="too coarse"):
        flight = ca.simulate(
            VEHICLE, tumble, method="RK4", step=1e-2, sample=1e-2, variables=["attitude"]
        )
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
    lasts = turns * 2.0 * np.pi / rate
    flight = ca.simulate(heavy, orbit, duration=lasts, sample=1e-3, variables=["q"])
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
            method="RK4", step=5e-4,
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
def test_a_flight_of_a_simpler_model_swings_its_arm_as_on_a_clamped_base(model: Model) -> None:
    """Its inertia is about the arm's own base, where the coupled one is at hand too."""
    rate = VEHICLE.arm.clamped_frequency
    undamped = VEHICLE.replace({"arm.damping": 0.0})
    released = ca.Scenario("released", [0, 0, 0, 0, 0, 0, 1e-3, 0], gravity=0.0)
    flight = ca.simulate(
        undamped,
        released,
        model=model,
        duration=2.0 * np.pi / rate,
        sample=1e-4,
        method="RK4",
        step=1e-4,
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
    names = ["q", "kinetic_energy", "elastic_energy"]
    flight = ca.simulate(vehicle, scenario, sample=0.05, rtol=1e-9, variables=names)
    angles, energy = flight["q"].sel(coordinate="pitch"), flight.kinetic_energy
    gained = (energy + flight.elastic_energy) - float(energy[0] + flight.elastic_energy[0])
    turned = angles - float(angles[0])
    np.testing.assert_allclose(gained, torque * turned, rtol=0, atol=1e-8)
    assert float(abs(turned[-1])) > 1.0
    stepped = ca.Simulation(vehicle, scenario.replace(tau=None), control_period=0.05)
    for _ in range(50):
        stepped.step(torque * np.eye(8)[4])
    np.testing.assert_allclose(stepped.q[4] - pitch, turned[-1], rtol=1e-6)


DAMPED = VEHICLE.replace({"arm.damping_ratio": 0.03})
LIFT = 9.81 * VEHICLE.mass * np.eye(8)[2]
STIFFNESS = VEHICLE.arm.bending_stiffness * VEHICLE.arm.length
ALONG, AROUND = np.eye(8)[6], np.eye(8)[7]


def on_both_branches(
    q: np.ndarray, qd: np.ndarray, tau: np.ndarray, turned: tuple[int, ...], sign: np.ndarray
) -> list[ca.Scenario]:
    """A start under torques, and the same in the other coordinates of the same state."""
    other = q * sign
    other[list(turned)] += np.pi
    pairs = (q, qd, tau), (other, qd * sign, tau * sign)
    return [ca.Scenario("pushed", at, rates, tau=push, duration=0.05) for at, rates, push in pairs]


def of_a_bend(kappa: float, rates: tuple[float, float], push: np.ndarray) -> list[ca.Scenario]:
    """On the branches (κ, ψa) and (-κ, ψa + π); rates of the bend along and across it."""
    q = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0, kappa, 0.0])
    qd = rates[0] * ALONG + rates[1] / kappa * AROUND
    return on_both_branches(q, qd, LIFT + push, (7,), np.where(ALONG > 0.0, -1.0, 1.0))


def of_a_pitch(pitch: float, qd: np.ndarray, push: np.ndarray) -> list[ca.Scenario]:
    """On the triples (φ, θ, ψ) and (φ + π, π - θ, ψ + π)."""
    q = np.array([0.0, 0.0, 2.0, 0.0, pitch, 0.0, 0.1, 0.0])
    sign = np.where(np.arange(8) == 4, -1.0, 1.0)
    return on_both_branches(q, qd, LIFT + push, (3, 4, 5), sign)


PASSES = {
    "beside straight": of_a_bend(-1e-3, (10.0, 1.0), 0.5 * STIFFNESS * ALONG),
    "beside a pole": of_a_pitch(
        np.pi / 2 + 1e-3, np.array([0, 0, 0, -1000.0, -10.0, -1000.0, 0, 0]), 5.0 * np.eye(8)[4]
    ),
}
STAYS = {
    "bent": of_a_bend(-0.5, (0.0, 0.0), -0.5 * STIFFNESS * ALONG + 0.005 * STIFFNESS * AROUND),
    "pitched": of_a_pitch(2.0, np.zeros(8), 0.05 * np.eye(8)[4]),
}


@pytest.mark.filterwarnings("ignore:q. roll, pitch and yaw")
@pytest.mark.parametrize("name", [*PASSES, *STAYS])
def test_a_flight_is_the_same_on_either_branch(name: str) -> None:
    one, other = (
        ca.simulate(DAMPED, each, method="RK4", step=2e-4, sample=5e-3, variables=["tip_position"])
        for each in (PASSES | STAYS)[name]
    )
    np.testing.assert_allclose(other.tip_position, one.tip_position, rtol=0, atol=1e-9)
    exact = ca.simulate(DAMPED, (PASSES | STAYS)[name][0], rtol=1e-11, sample=5e-3)
    adaptive = [ca.simulate(DAMPED, each, sample=5e-3) for each in (PASSES | STAYS)[name]]
    for flight in adaptive:
        off = np.linalg.norm(flight.tip_position - exact.tip_position, axis=-1).max()
        assert off < 2e-4 * VEHICLE.arm.length


def passing() -> ca.Scenario:
    """Steps of 0.7 ms pass straight on the wrong side, 0.1 arm lengths off in the end."""
    q = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.16826892892749667, 2.5861038958869305])
    push = LIFT - 39.56517129242746 * ALONG
    return ca.Scenario("passing", q, 3.017653652227561 * AROUND, tau=push, duration=0.2)


def kicked() -> ca.Scenario:
    """Within κ_s a torque across is divided by κ_s, and after a step by much more."""
    tau, rates = np.array([0, 0, 9.81 * SLENDER.mass, 0, 0, 0, 0.02, -0.017]), 2.7 * ALONG
    return ca.Scenario("kick", [0, 0, 3, 0, 0, 0, 0, 0], rates, tau=tau, duration=0.5)


@pytest.mark.parametrize(
    ("vehicle", "scenario", "model"),
    [(DAMPED, passing(), "coupled"), (SLENDER, kicked(), "decoupled")],
    ids=["passing", "kicked"],
)
def test_torques_beside_straight_are_followed(
    vehicle: ca.Vehicle, scenario: ca.Scenario, model: str
) -> None:
    options: dict[str, Any] = {"model": model, "sample": 0.01, "variables": ["tip_position"]}
    found = ca.simulate(vehicle, scenario, check=True, **options)
    exact = ca.simulate(vehicle, scenario, rtol=1e-11, **options)
    off = np.linalg.norm(found.tip_position - exact.tip_position, axis=1).max()
    assert off < max(1e-3, 3.0 * float(found.error_estimate)) * vehicle.arm.length
    pair = ca.run_pairs(vehicle, scenario, ("decoupled",), sample=0.01, check=True)
    told = float(pair.error_estimate.sel(model=model)[0])
    assert told == pytest.approx(float(found.error_estimate), rel=1e-6)


@pytest.mark.parametrize("method", ["RK4", "implicit", "Tsit5"])
def test_a_torque_across_a_straight_arm_without_a_threshold_is_not_lost(method: str) -> None:
    """It has no finite force there, and one along the bend or none at all has one."""
    bare = DAMPED.replace({"arm.kappa_s": 0.0})
    still = ca.Scenario("straight", [0.0] * 8, tau=LIFT, duration=0.02)
    across, along = LIFT + 0.05 * np.eye(8)[7], LIFT + 0.05 * np.eye(8)[6]
    given: dict[str, Any] = {"method": method} | ({} if method == "Tsit5" else {"step": 1e-3})
    for tau, flies in ((LIFT, True), (along, True), (across, False)):
        flight = ca.simulate(bare, still.replace(tau=tau), sample=0.01, **given)
        assert (int(flight["status"]) == 0) == flies
