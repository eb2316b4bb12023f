"""The first push of the product's laws against their equations, on the readable eye in hand."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.controllers.inertias import camera_inertia
from continuair.equations.camera import interaction_matrix
from continuair.kernels.step import NOT_FINITE
from continuair.scenario import paths
from tests.closed_loop import eye, probes

pytestmark = pytest.mark.targets

STATES = 40
VEHICLE = eye.MOUNTED
SPEED = np.array([0.3, -0.2, 0.1])


class Seen:
    """What a law sees at the start of a run: image, depths, and the twists in camera axes."""

    def __init__(self, q: np.ndarray, qd: np.ndarray, target: ca.Target) -> None:
        centroid = target.path(np.zeros(1))[0][0]
        image, depth = equations.look(VEHICLE, q, centroid + target.points)
        self.L = interaction_matrix(image, depth)
        self.J = equations.camera_jacobian(VEHICLE, q)
        self.error = target.desired - image
        self.camera = self.J @ qd
        self.target = np.concatenate([equations.camera_pose(VEHICLE, q)[1].T @ SPEED, np.zeros(3)])
        self.weight = equations.weight_vector(VEHICLE, q, nodes=32)


def moving_from(position: np.ndarray) -> paths.Path:
    """A path at a constant speed."""

    def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        still = np.zeros((len(t), 3))
        return position + SPEED * t[:, None], still + SPEED, still

    return paths.Path("straight", 1.0, motion)


@cache
def views() -> tuple[np.ndarray, np.ndarray, list[ca.Target], list[Seen]]:
    """Starts q and q̇, a target before each, and what is seen of it there."""
    q, qd = eye.states(STATES, seed=17)
    targets = []
    for at in q:
        targets.append(eye.before(VEHICLE, at, moving_from(eye.in_front(VEHICLE, at))))
    return q, qd, targets, [Seen(*each) for each in zip(q, qd, targets, strict=True)]


def first_pushes(
    controller: ca.Controller,
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, Seen]]:
    """Start q and q̇, the first push in the coordinates of the paper, and what was seen."""
    q, qd, targets, seen = views()
    scenario = ca.Scenario(
        "moving", q, qd, duration=1e-6, controller=controller, control_period=1e-6, target=targets
    )
    run = ca.simulate(
        VEHICLE, scenario, method="RK4", step=1e-6, sample=1e-6, variables=["command"]
    )
    pushes = eye.in_paper_coordinates(run.command.isel(time=0).to_numpy(), q)
    return list(zip(q, qd, pushes, seen, strict=True))


def assert_close(found: np.ndarray, expected: np.ndarray) -> None:
    """To rounding, of the size of the whole; the pseudo-inverse of four points multiplies it."""
    assert np.linalg.norm(found - expected) < 1e-10 * np.linalg.norm(expected)


def posture_torque(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """The moment -ḃ on the bend, in the coordinates of the paper: it acts along κ and ψa."""
    return np.array([0, 0, 0, 0, 0, 0, -qd[6], -(q[6] ** 2) * qd[7]])


@pytest.mark.parametrize("damping", ["camera", "feature"])
@pytest.mark.parametrize("feed_forward", [True, False])
@pytest.mark.parametrize("compensation", ["gravity_only", "literal"])
def test_servoing_is_equations_15_and_16(
    damping: str, feed_forward: bool, compensation: str
) -> None:
    rng = np.random.default_rng(3)
    Kp, Kd, Cp, Cd, Cs = (np.diag(d) + 0.02 for d in rng.uniform(0.5, 2.0, (5, 8)))
    choices: dict[str, Any] = {"damping": damping, "feed_forward": feed_forward}
    choices |= {"compensation": compensation, "posture_damping": 0.7}
    controller = ca.servoing(Kp, Kd, Cp, Cd, Cs, sigma=0.05, **choices)
    for q, qd, push, seen in first_pushes(controller):
        followed = seen.L @ seen.target
        e_dot = float(feed_forward) * followed - seen.L @ seen.camera
        e_a = Cd @ e_dot + Cp @ seen.error + Cs @ np.tanh(seen.error / 0.05)
        damped = seen.L @ seen.camera - float(damping == "feature") * followed
        expected = seen.weight + 0.7 * posture_torque(q, qd)
        expected += (seen.L @ seen.J).T @ (Kp @ e_a - Kd @ damped)
        if compensation == "literal":
            expected += equations.elastic_vector(VEHICLE, q)
        assert_close(push, expected)


@pytest.mark.parametrize("feed_forward", [True, False])
def test_classic_servoing_is_a_twist_by_the_pseudo_inverse_and_a_loop_around_it(
    feed_forward: bool,
) -> None:
    rate, inner = 0.8, 5.0
    controller = ca.classic(VEHICLE, rate, inner, feed_forward=feed_forward)
    inertia = camera_inertia(VEHICLE)
    for _, _, push, seen in first_pushes(controller):
        # The law's own share of 1e-11 keeps its solution apart from the pseudo-inverse.
        normal = seen.L.T @ seen.L
        normal += 1e-11 * np.diag(np.diag(normal))
        wanted = rate * np.linalg.solve(normal, seen.L.T @ seen.error)
        wanted += float(feed_forward) * seen.target
        wrench = inertia @ (inner * (wanted - seen.camera))
        assert_close(push, seen.weight + seen.J.T @ wrench)


@pytest.mark.parametrize("damping", ["camera", "feature"])
@pytest.mark.parametrize("cap", [(0.05, 0.03), (50.0, 50.0)])
def test_current_gains_are_equations_15_and_16_with_gains_of_the_image_of_now(
    damping: Any, cap: tuple[float, float]
) -> None:
    ω, ζ, μ, share, Cs, σ = 3.0, 0.8, 0.02, 0.01, 0.3, 0.05
    gains = ca.design(
        VEHICLE, ω, gains="current", damping_ratio=ζ, conditioning=μ, rate_gain=share, sliding=Cs,
        cap=cap,
    )  # fmt: skip
    controller = ca.servoing(**gains, sigma=σ, damping=damping)
    felt, axes = np.linalg.eigh(camera_inertia(VEHICLE))
    root, inverse_root = (axes * felt**p @ axes.T for p in (0.5, -0.5))
    nominal = np.linalg.norm(
        interaction_matrix(ca.Target(paths.hold()).desired, 2.0) @ inverse_root, 2
    )
    ε, capped = (μ * nominal) ** 2, 0
    for _, _, push, seen in first_pushes(controller):
        u, s, vt = np.linalg.svd(seen.L @ inverse_root)
        u, other, rates = u[:, :6], u[:, 6:], ω * s**2 / (s**2 + ε)
        sliding = seen.error + Cs * np.tanh(seen.error / σ)
        away = inverse_root @ vt.T @ (s / (s**2 + ε) * (u.T @ sliding))
        sizes = np.linalg.norm(away[:3]), np.linalg.norm(away[3:])
        c = min(1.0, *(float(most / size) for most, size in zip(cap, sizes, strict=True)))
        capped += c < 1.0
        # What they are where Lᵀ is 0 makes no difference, but they are symmetric positive definite.
        rest = other @ np.diag(np.linspace(0.5, 2.0, other.shape[1])) @ other.T
        Kp = c * (u * (rates / s) ** 2 @ u.T + rest)
        Kd = share * (u * (rates / (ω * s)) ** 2 @ u.T + rest)
        Cd = (u * (2.0 * ζ / rates) @ u.T + rest) / c
        for gain in (Kp, Kd, Cd):
            assert np.linalg.eigvalsh(gain)[0] > 0.0
        followed = seen.L @ seen.target
        e_a = Cd @ (followed - seen.L @ seen.camera) + sliding
        damped = seen.L @ seen.camera - float(damping == "feature") * followed
        wrench = (seen.L @ seen.J).T @ (Kp @ e_a - Kd @ damped)
        assert_close(push, seen.weight + wrench)
    assert capped == (STATES if cap[0] < 1.0 else 0)


@pytest.mark.long
@pytest.mark.parametrize("lag", [None, 0.0, 0.03])
def test_a_push_that_is_no_number_ends_a_flight_with_rotors_or_without(lag: float | None) -> None:
    """The least thrust of the rotors is not what such a law asks for."""
    rotors = {"layout": "hex_tilted", "lever": 0.3, "tilt": 0.3, "thrust_limits": [0.0, 30.0],
              "torque_per_thrust": 0.02, "lag": lag}  # fmt: skip
    vehicle = ca.load_vehicle("paper").replace({} if lag is None else {"uav.rotors": rotors})
    scenario = ca.Scenario("undefined", [0.0, 0, 3, 0, 0, 0, 0.1, 0], duration=0.1)
    run = ca.simulate(vehicle, scenario.replace(controller=probes.undefined_from(0.0305)))
    assert int(run.status) == NOT_FINITE
    assert float(run.end_time) == pytest.approx(0.031, rel=1e-12)
