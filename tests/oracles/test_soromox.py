"""The same system in SoRoMoX: a floating hub, then segments of constant bending strain."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations as eq
from continuair.engine.engine import Drive, Engine, Start
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.layout import GENERAL
from continuair.vehicle.layout import ONE_SECTION as LAYOUT
from tests.oracles.conftest import Claim

pytest.importorskip("soromox", exc_type=ImportError)
from tests.oracles.soromox_hub import SOURCE, Hub, vehicle, vehicle_of_sections  # noqa: E402

VEHICLE = vehicle()
STATES = 100


@pytest.fixture(scope="module")
def hub() -> Hub:
    return Hub(VEHICLE)


def random_states() -> tuple[np.ndarray, np.ndarray]:
    """q, q̇ in the paper's coordinates: any attitude, bends to 2 rad, brisk rates."""
    rng = np.random.default_rng(5)
    q = np.zeros((STATES, 8))
    q[:, :3] = rng.normal(size=(STATES, 3))
    q[:, 3:6] = rng.uniform([-np.pi, -1.2, -np.pi], [np.pi, 1.2, np.pi], (STATES, 3))
    q[:, 6] = rng.uniform(0.05, 2.0, STATES)
    q[:, 7] = rng.uniform(-np.pi, np.pi, STATES)
    return q, rng.normal(size=(STATES, 8)) * [1, 1, 1, 2, 2, 2, 3, 3]


def of_ours(hub: Hub, state: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """SoRoMoX's state, and the attitude, of one of our states."""
    attitude = Rotation.from_quat(state[LAYOUT.attitude])
    theirs = hub.state(
        state[LAYOUT.position],
        attitude,
        state[LAYOUT.bend],
        state[LAYOUT.velocity],
        state[LAYOUT.angular_velocity],
        state[LAYOUT.bend_rate],
    )
    return theirs, attitude


def kernel_accelerations(states: np.ndarray, push: np.ndarray) -> np.ndarray:
    """(v̇ world, ω̇ body, k̈) from the kernels, (n, 8), under pushes (8,)."""
    inputs = np.zeros((1, len(states), LAYOUT.inputs))
    inputs[..., LAYOUT.push] = push
    acting = Drive(inputs, False, GENERAL, 9.81)
    rates = Engine(VEHICLE, "coupled").derivative(Start(states, np.zeros((len(states), 2))), acting)
    return np.asarray(rates[:, LAYOUT.velocity.start :])


def polar_map(q: np.ndarray) -> np.ndarray:
    """(8, 8): (v world, ω body, k̇) per q̇."""
    B = np.zeros((8, 8))
    B[:3, :3] = np.eye(3)
    B[3:6, 3:6] = eq.rotation(q).T @ eq.euler_rate_matrix(q)
    c, s = np.cos(q[7]), np.sin(q[7])
    B[6:, 6:] = [[c, -q[6] * s], [s, q[6] * c]]
    return B


def worst_entry(pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Largest |a_ij - b_ij| / √(b_ii b_jj) over pairs of mass matrices: free of units."""
    scales = [np.sqrt(np.diagonal(b)) for _, b in pairs]
    found = [
        np.abs(a - b) / np.outer(scale, scale) for (a, b), scale in zip(pairs, scales, strict=True)
    ]
    return float(np.max(found))


def worst_acceleration(pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Largest error of v̇, ω̇ and k̈ of a section, each relative to its own size in that state."""
    bends = (slice(at, at + 2) for at in range(6, len(pairs[0][0]), 2))
    parts = (slice(0, 3), slice(3, 6), *bends)
    return max(
        float(np.linalg.norm(a[part] - b[part]) / np.linalg.norm(b[part]))
        for a, b in pairs
        for part in parts
    )


def masses(hub: Hub) -> tuple[list[Any], list[Any]]:
    """(ours, theirs): of the readable form and, inverted from unit pushes, of the kernels."""
    q, qd = random_states()
    states = state_from_paper(q, qd, LAYOUT)
    pushed = np.stack([kernel_accelerations(states, e) for e in np.eye(8)], axis=-1)
    pushed -= kernel_accelerations(states, np.zeros(8))[..., None]
    of_equations, of_kernels = [], []
    for i, state in enumerate(states):
        y, attitude = of_ours(hub, state)
        M, B = hub.mass_matrix(y, attitude), polar_map(q[i])
        of_equations.append((eq.mass_matrix(VEHICLE, q[i], nodes=32), B.T @ M @ B))
        of_kernels.append((np.linalg.inv(pushed[i]), M))
    return of_equations, of_kernels


def test_mass_matrix(claim: Claim, hub: Hub) -> None:
    of_equations, of_kernels = masses(hub)
    what = f"mass matrix, worst entry relative to √(M_ii M_jj), {STATES} random states"
    nodes = "here and below, SoRoMoX integrates over NumPy's Gauss-Legendre nodes"
    claim(f"{what}: readable form", SOURCE, 1e-9, worst_entry(of_equations), note=nodes)
    claim(
        f"{what}: kernels (inverted from the accelerations under eight unit pushes)",
        SOURCE,
        1e-9,
        worst_entry(of_kernels),
    )


def test_mass_matrix_with_the_nodes_as_shipped(claim: Claim) -> None:
    shipped = Hub(VEHICLE, own_nodes=True)
    weights = float(np.sum(shipped.robot.integration_weights))
    _, of_kernels = masses(shipped)
    claim(
        "mass matrix against SoRoMoX exactly as shipped, its Gauss nodes included",
        SOURCE,
        1e-9,
        worst_entry(of_kernels),
        miss="SoRoMoX stops the Newton iteration for its Gauss-Legendre nodes at the rounding of "
        "float32 (its utils/integration.py): the weights of the 40 nodes used here sum to "
        f"1 - {1 - weights:.1e}, and every mass is short by that share. With NumPy's nodes in "
        "their place and nothing else changed, the other rows hold.",
    )


def test_accelerations(claim: Claim, hub: Hub) -> None:
    q, qd = random_states()
    states = state_from_paper(q, qd, LAYOUT)
    rng = np.random.default_rng(6)
    push = rng.normal(size=8) * [20, 20, 20, 1, 1, 1, 30, 30]
    free: list[tuple[np.ndarray, np.ndarray]] = []
    pushed: list[tuple[np.ndarray, np.ndarray]] = []
    for loads, pairs in ((np.zeros(8), free), (push, pushed)):
        ours = kernel_accelerations(states, loads)
        for state, found in zip(states, ours, strict=True):
            y, attitude = of_ours(hub, state)
            omega = state[LAYOUT.angular_velocity]
            pairs.append((found, hub.accelerations(y, attitude, omega, loads)))
    what = f"accelerations of the kernels, worst of v̇, ω̇, k̈ relative, {STATES} random states"
    claim(f"{what}, gravity and spring only", SOURCE, 1e-8, worst_acceleration(free))
    claim(
        f"{what}, with a force, a moment and bend moments", SOURCE, 1e-8, worst_acceleration(pushed)
    )


def test_accelerations_of_two_sections(claim: Claim) -> None:
    plant, rng = vehicle_of_sections(), np.random.default_rng(7)
    theirs = Hub(plant)
    turns = Rotation.random(STATES, rng=rng)
    bend = rng.uniform(-1.5, 1.5, (STATES, 2, 2))
    v, omega = rng.normal(size=(STATES, 3)), 2.0 * rng.normal(size=(STATES, 3))
    rate = 3.0 * rng.normal(size=(STATES, 2, 2))
    push = rng.normal(size=10) * [20, 20, 20, 1, 1, 1, 30, 30, 5, 5]
    ours = ca.accelerations(
        plant,
        attitude=turns.as_quat(),
        bend=bend,
        velocity=v,
        angular_velocity=omega,
        bend_rate=rate,
        force=push[:3],
        moment=push[3:6],
        bend_moment=push[6:].reshape(2, 2),
    )
    found = np.concatenate([ours[0], ours[1], ours[2].reshape(STATES, 4)], axis=1)
    pairs = []
    for i, turn in enumerate(turns):
        state = theirs.state(np.zeros(3), turn, bend[i].ravel(), v[i], omega[i], rate[i].ravel())
        pairs.append((found[i], theirs.accelerations(state, turn, omega[i], push)))
    what = "accelerations of an arm of two sections, worst of v̇, ω̇ and each k̈ relative"
    claim(f"{what}, {STATES} random states under pushes", SOURCE, 1e-8, worst_acceleration(pairs))


def test_free_flight(claim: Claim, hub: Hub) -> None:
    scenario = ca.Scenario(
        "free flight",
        [0, 0, 5, 0.1, -0.2, 0.3, 0.8, 0.5],
        [1, 0, 2, 0.5, 0.3, -0.2, 2.0, 1.0],
        duration=1.0,
    )
    names = ["position", "attitude", "bend", "velocity", "angular_velocity", "bend_rate"]
    flights = {
        "Tsit5": ca.simulate(VEHICLE, scenario, rtol=1e-12, sample=0.01),
        "default": ca.simulate(VEHICLE, scenario, sample=0.01),
        "fine": ca.simulate(VEHICLE, scenario, sample=0.01, method="RK4", step=2.5e-5),
    }
    at = {name: flights["Tsit5"][name].values[0] for name in names}
    attitude = Rotation.from_quat(at["attitude"])
    y0 = hub.state(
        at["position"],
        attitude,
        at["bend"],
        attitude.apply(at["velocity"]),
        at["angular_velocity"],
        at["bend_rate"],
    )
    times = flights["Tsit5"].time.values
    solved = solve_ivp(
        lambda t, y: hub.rates(y), (0, 1), y0, "DOP853", times, rtol=1e-10, atol=1e-12
    )
    tips = np.array([hub.tip(y) for y in solved.y.T])
    off = {
        name: float(np.abs(flight.tip_position.values - tips).max())
        for name, flight in flights.items()
    }
    what = "tip path of a 1 s free flight, bend 0.8 1/m, tumbling, largest distance"
    claim(f"{what}: Tsit5 on the kernels, rtol 1e-12", SOURCE, 1e-6, off["Tsit5"], unit="m")
    claim(f"{what}: RK4 in the kernel, step 25 µs", SOURCE, 1e-6, off["fine"], unit="m")
    claim(
        f"{what}: Tsit5 on the kernels, rtol 1e-4",
        SOURCE,
        None,
        off["default"],
        unit="m",
        note="what the default tolerance leaves; a smaller one removes it, as the first row shows",
    )
