"""Flights of arms of several sections, and of several arms: conservation, order, known beams."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.analysis.linear import bending_frequencies
from continuair.engine.engine import Engine
from continuair.flight.frequencies import fastest_rate
from continuair.flight.steps import automatic_step

SLOW = pytest.mark.soak  # kernels of their own, which take long to compile
TILTED = (0.3, -0.2, 0.1, 0.927)


def rod(length: float, **fields: object) -> dict[str, object]:
    return {"length": length, "radius": 0.003, "density": 2000.0, "youngs_modulus": 2e9} | fields


def cut(sections: int, length: float = 0.6) -> ca.Vehicle:
    """The same uniform arm in sections of equal length, thin so that slices do not turn."""
    thin = {"radius": 1e-4, "density": 2e6, "youngs_modulus": 1e15}
    each = [rod(length / sections, **thin) for _ in range(sections)]
    uav = {"mass": 2.0, "inertia": (0.02, 0.03, 0.04)}
    return ca.Vehicle(name="cut", uav=uav, arm=[{"section": each}])


def vehicle(*sections: int) -> ca.Vehicle:
    """Arms of so many sections, at tilted mounts, the first with a body on its tip."""
    arms = [
        {
            "mount": (0.02, 0.1 - 0.2 * index, -0.03),
            "attitude": np.array(TILTED) * [1.0, 1.0, 1.0 - 2.0 * index, 1.0],
            "section": [rod(0.3 - 0.05 * k, radius=0.003 - 0.0003 * k) for k in range(count)],
        }
        for index, count in enumerate(sections)
    ]
    arms[0]["tip"] = {"mass": 0.05, "centre": (0.0, 0.01, 0.03), "inertia": (2e-5, 3e-5, 4e-5)}
    return ca.Vehicle(name="arms", uav={"mass": 1.5, "inertia": (0.02, 0.03, 0.04)}, arm=arms)


def released(
    flown: ca.Vehicle, duration: float = 1.0, gravity: float = 9.81, **options: Any
) -> xr.Dataset:
    """Free flight with spin, from bends of all sections."""
    rng = np.random.default_rng(3)
    n = flown.sections
    q, qd = np.zeros((2, 6 + 2 * n))
    q[6::2], q[7::2] = rng.uniform(0.5, 2.0, n), rng.uniform(-3.0, 3.0, n)
    qd[:6] = 0.2, -0.1, 0.3, 0.8, -0.6, 0.5
    scenario = ca.Scenario("released", q, qd, duration=duration, gravity=gravity)
    return ca.simulate(flown, scenario, **options)


def energy(flight: xr.Dataset) -> np.ndarray:
    total = flight.kinetic_energy + flight.gravity_energy + flight.elastic_energy
    return np.asarray(total)


@pytest.mark.long
@pytest.mark.parametrize("shape", [(2, 2), pytest.param((3,), marks=SLOW)])
def test_energy_and_momenta_of_the_coupled_model_last_ten_seconds(shape: tuple[int, ...]) -> None:
    """Within 1e-8 of the energy that swings, and of the momenta, at steps of 50 µs, at no gravity:
    the energy of a fall is ten thousand times what swings."""
    flown = vehicle(*shape)
    flight = released(flown, method="RK4", step=5e-5, sample=0.05, duration=10.0, gravity=0.0)
    total, swinging = energy(flight), float(flight.elastic_energy.max())
    assert np.abs(total - total[0]).max() < 1e-8 * swinging
    for name in ("linear_momentum", "angular_momentum"):
        held = flight[name].to_numpy()
        apart = np.abs(held - held[0]).max()
        assert apart < 1e-8 * np.linalg.norm(held[0]), name


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:step is")
@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_steps_are_of_fourth_order(model: str) -> None:
    flown = vehicle(2, 2)
    ends = [
        released(flown, model=model, method="RK4", step=h, sample=0.1, duration=0.2)
        .tip_position[-1]
        .to_numpy()
        for h in (4e-4, 2e-4, 1e-4)
    ]
    coarse, fine = (np.abs(a - b).max() for a, b in zip(ends, ends[1:], strict=False))
    assert np.log2(coarse / fine) == pytest.approx(4.0, abs=0.15)


@pytest.mark.long
def test_what_is_observed_of_a_tip_moves_as_its_pose_does() -> None:
    flight = released(vehicle(2, 2), method="RK4", step=4e-5, sample=4e-5, duration=0.004)
    inside = slice(2, -2)
    weights = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 48e-5
    for arm in flight.arm:
        of = flight.sel(arm=arm)
        place = of.tip_position.to_numpy()
        slopes = sum(w * np.roll(place, 2 - k, axis=0) for k, w in enumerate(weights))
        np.testing.assert_allclose(of.tip_velocity[inside], slopes[inside], rtol=0, atol=1e-6)
        turns = Rotation.from_quat(of.tip_attitude)
        apart = (turns[2:] * turns[:-2].inv()).as_rotvec() / 8e-5
        found = of.tip_angular_velocity.to_numpy()[1:-1]
        # Of differences over two samples, which lose (ω h)²/6.
        np.testing.assert_allclose(found, apart, rtol=3e-5, atol=1e-4)


def test_arms_put_on_the_body_what_moves_it() -> None:
    """The UAV's own balance: no other force acts on it in free fall."""
    flown = vehicle(2, 2)
    flight = released(flown, method="RK4", step=2e-5, sample=2e-5, duration=0.001)
    h = float(flight.time[1])
    velocity = np.stack(
        [
            Rotation.from_quat(a).apply(v)
            for a, v in zip(flight.attitude, flight.velocity, strict=True)
        ]
    )
    felt = (velocity[2:] - velocity[:-2]) / (2 * h) + [0.0, 0.0, 9.81]
    pushed = flight.base_force.sum("arm").to_numpy()[1:-1]
    turns = Rotation.from_quat(flight.attitude[1:-1])
    body = flown.uav.mass * turns.inv().apply(felt)
    np.testing.assert_allclose(pushed, body, rtol=0, atol=1e-4)
    w = flight.angular_velocity.to_numpy()
    inertia = np.array(flown.uav.inertia)
    rate = (w[2:] - w[:-2]) / (2 * h)
    turned = rate @ inertia + np.cross(w[1:-1], w[1:-1] @ inertia)
    found = flight.base_moment.sum("arm").to_numpy()[1:-1]
    np.testing.assert_allclose(found, turned, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    ("sections", "constant"),
    [
        (1, 4.472136),
        (2, 3.694819),
        pytest.param(3, 3.593228, marks=SLOW),
        pytest.param(4, 3.559051, marks=SLOW),
    ],
)
def test_more_sections_come_near_the_first_frequency_of_a_beam(
    sections: int, constant: float
) -> None:
    """ω L² √(m'/EI), from above, to 3.516015 of a clamped Euler-Bernoulli beam."""
    arm = cut(sections)
    found = ca.modes(arm, base="clamped", gravity=0.0).frequencies[0]
    section = arm.arms[0].section[0]
    scale = 0.6**2 * np.sqrt(section.mass_per_length / section.bending_stiffness)
    assert found * scale == pytest.approx(constant, abs=2e-6)


@pytest.mark.long
def test_a_section_cut_in_two_is_no_stiffer_where_it_bends_alike() -> None:
    """Two halves bent alike are the whole: the same place, turn and energies."""
    whole, halves = cut(1), cut(2)
    q = np.array([0.1, -0.2, 5.0, 0.3, -0.2, 0.4, 1.5, 0.7])
    flights = [
        ca.simulate(one, ca.Scenario("still", at, duration=1e-3), sample=1e-3).isel(time=0)
        for one, at in ((whole, q), (halves, np.append(q, q[6:])))
    ]
    for name in ("tip_position", "elastic_energy", "gravity_energy"):
        np.testing.assert_allclose(flights[1][name], flights[0][name], rtol=1e-12, atol=1e-15)
    turns = [Rotation.from_quat(flight.tip_attitude[0]) for flight in flights]
    assert (turns[0] * turns[1].inv()).magnitude() < 1e-12


def test_the_automatic_step_follows_the_fastest_bend_with_its_damping() -> None:
    """By the eigenvalues of the linearised free vehicle."""
    flown = vehicle(2, 2).replace(
        {"arm.0.section.0.damping": 0.002, "arm.0.section.1.damping": 1e-4}
    )
    A, _ = ca.linearize(flown, gravity=0.0)
    fastest = np.abs(np.linalg.eigvals(A)).max()
    engine = Engine(flown, "coupled")
    straight = np.zeros((1, engine.layout.coordinates))
    assert float(fastest_rate(engine, straight)[0]) == pytest.approx(fastest, rel=1e-6)
    assert float(automatic_step(engine, straight)[0]) == pytest.approx(0.2 / fastest, rel=1e-6)


@pytest.mark.long
def test_arms_hang_where_gravity_leaves_them_in_balance() -> None:
    """A level hover of two arms: bends that need no moment, and a push that carries the weight."""
    flown = vehicle(2, 2)
    found = ca.trim(flown)
    hover = ca.Scenario("hover", found.q, force=found.force, moment=found.moment, duration=0.5)
    flight = ca.simulate(flown, hover, sample=0.05, rtol=1e-9)
    assert np.linalg.norm(found.q[6::2]) > 1e-3
    np.testing.assert_allclose(flight.tip_position[-1], flight.tip_position[0], rtol=0, atol=1e-8)
    assert found.force[2] == pytest.approx(9.81 * flown.mass, rel=1e-9)
    clamped, free = bending_frequencies(flown)
    assert 0.0 < clamped < free


def test_a_stiff_section_with_a_limp_one_rests_where_its_energy_is_least() -> None:
    """Found by minimising the potential of point masses along the arm; it swings about there."""
    stiff = {"length": 0.56, "bending_stiffness": 1.16, "mass_per_length": 0.05}
    limp = {"length": 0.37, "bending_stiffness": 0.0122, "mass_per_length": 0.05}
    half = 0.5 * -1.12
    arm = {
        "attitude": [np.sin(half), 0.0, 0.0, np.cos(half)],
        "section": [stiff, limp],
        "tip": {"mass": 0.075},
    }
    uav = {"mass": 2.0, "inertia": [0.1, 0.1, 0.1]}
    leaning = ca.Vehicle(name="leaning", uav=uav, arm=[arm])
    q = ca.trim(leaning).q
    np.testing.assert_allclose(q[6:], [0.3112, np.pi / 2, 2.8753, np.pi / 2], rtol=2e-4)
    assert (ca.modes(leaning, q, base="clamped").frequencies > 0.0).all()


LIMP = {
    "length": [0.3, 0.45, 0.4],
    "bending_stiffness": [0.004, 0.6, 0.02],
    "mass_per_length": [0.05, 0.1, 0.2],
}
LOAD = 0.1


def limp(lean: float) -> ca.Vehicle:
    """An arm of three sections, one of them much stiffer, that points `lean` away from down."""
    sections = [dict(zip(LIMP, row, strict=True)) for row in zip(*LIMP.values(), strict=True)]
    attitude = [np.sin(lean / 2.0), 0.0, 0.0, np.cos(lean / 2.0)]
    arm = {"attitude": attitude, "section": sections, "tip": {"mass": LOAD}}
    uav = {"mass": 2.0, "inertia": [0.1, 0.1, 0.1]}
    return ca.Vehicle(name="limp", uav=uav, arm=[arm])


def potential(turns: np.ndarray, lean: float) -> float:
    """Of the limp arm bent in its vertical plane: pieces of arc lift all that lies beyond them."""
    length, stiffness, density = (np.array(LIMP[name])[:, None] for name in LIMP)
    part = (np.arange(2000) + 0.5) / 2000
    after = np.cumsum((density * length)[::-1], axis=0)[::-1]
    beyond = LOAD + after - density * length * part
    bent = turns[:, None]
    angle = lean + np.cumsum(bent, axis=0) - bent * (1.0 - part)
    lifted = -np.cos(angle) * beyond * length / part.size
    return float((0.5 * stiffness * bent**2 / length).sum() + 9.81 * lifted.sum())


@pytest.mark.parametrize("lean", [1.3, 2.6, np.pi])
def test_limp_arms_sink_to_the_balance_downhill_of_straight(lean: float) -> None:
    """Upright, straight is a balance which does not last; the arm falls to either side."""
    tipped = np.full(3, 1e-2 if lean == np.pi else 0.0)
    downhill = minimize(potential, tipped, args=(lean,), method="BFGS", options={"gtol": 1e-9}).x
    found = ca.trim(limp(lean)).q[6:].reshape(3, 2)
    np.testing.assert_allclose(found[:, 0] * LIMP["length"], np.abs(downhill), rtol=1e-5)
