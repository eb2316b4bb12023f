"""Rotors and drag of a vehicle: layouts, allocation, files, batches, and what is refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import continuair as ca
from continuair.vehicle.allocation import LayoutName, pseudo_inverse
from continuair.vehicle.rotors import AIR_DENSITY, Rotors
from continuair.vehicle.vehicle_file import as_toml
from tests import own_law
from tests.refusals import refused

SLENDER = ca.load_vehicle("slender")
GIVEN: dict[str, Any] = {
    "lever": 0.2,
    "height": 0.03,
    "thrust_limits": [0.1, 12.0],
    "torque_per_thrust": 0.016,
    "lag": 0.04,
}
RANKS = {name: 6 if name == "hex_tilted" else 4 for name in get_args(LayoutName)}
CORNERS = [[0.2, 0.1, 0.0], [-0.1, 0.2, 0.0], [-0.2, -0.1, 0.05], [0.1, -0.3, 0.0]]
LIST: dict[str, Any] = {
    "thrust_limits": [0.0, 9.0],
    "torque_per_thrust": 0.02,
    "rotor": [
        {"position": at, "axis": [0.02 * i, 0.0, 1.0], "spin": (-1) ** i}
        for i, at in enumerate(CORNERS)
    ],
}


def rotors(name: str, **changes: Any) -> Rotors:
    tilt = {"tilt": 0.35} if name == "hex_tilted" else {}
    return Rotors(layout=name, **GIVEN | tilt | changes)


def with_rotors(**given: Any) -> ca.Vehicle:
    return SLENDER.replace({"uav.rotors": given})


@pytest.mark.parametrize(("name", "rank"), RANKS.items())
def test_flat_layouts_push_along_one_direction_and_tilted_rotors_along_all(
    name: str, rank: int
) -> None:
    found = rotors(name)
    # NumPy's own count of singular values, from LAPACK.
    assert found.rank == np.linalg.matrix_rank(found.allocation, tol=1e-9) == rank


@pytest.mark.parametrize("name", RANKS)
def test_equal_thrusts_carry_the_weight_without_a_moment(name: str) -> None:
    found = rotors(name)
    weight = np.array([0.0, 0.0, 20.0, 0.0, 0.0, 0.0])
    thrusts = found.inverse @ weight
    upright = np.cos(found.tilt)
    np.testing.assert_allclose(thrusts, 20.0 / (found.count * upright), rtol=1e-13)
    np.testing.assert_allclose(found.allocation @ thrusts, weight, atol=1e-13)


def test_the_layouts_put_their_rotors_where_they_say() -> None:
    quad = rotors("quad_x", height=0.0)
    lift, roll, pitch, yaw = quad.allocation[2:]
    arm = 0.2 * np.sqrt(0.5)
    # Counter-clockwise from ahead and left: thrust on the left rolls right, ahead it pitches back.
    np.testing.assert_allclose(lift, 1.0)
    np.testing.assert_allclose(roll, arm * np.array([1.0, 1.0, -1.0, -1.0]), atol=1e-16)
    np.testing.assert_allclose(pitch, -arm * np.array([1.0, -1.0, -1.0, 1.0]), atol=1e-16)
    # The first turns counter-clockwise, so that the air turns the frame clockwise.
    np.testing.assert_allclose(yaw, 0.016 * np.array([-1.0, 1.0, -1.0, 1.0]), atol=1e-16)
    ahead = rotors("octo_plus").allocation[:, 0]
    np.testing.assert_allclose(ahead, [0.0, 0.0, 1.0, 0.0, -0.2, -0.016], atol=1e-16)


def test_a_list_of_the_same_rotors_is_the_layout() -> None:
    named = rotors("quad_x")
    corner = 0.2 * np.sqrt(0.5)
    places = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    listed = Rotors(
        thrust_limits=[0.1, 12.0],
        torque_per_thrust=0.016,
        rotor=[
            {"position": [corner * x, corner * y, 0.03], "spin": (-1) ** i}
            for i, (x, y) in enumerate(places)
        ],
    )
    np.testing.assert_allclose(listed.allocation, named.allocation, atol=1e-16)


def test_the_pseudo_inverse_meets_the_four_conditions_of_penrose() -> None:
    rng = np.random.default_rng(3)
    matrices = rng.normal(size=(20, 6, 8))
    matrices[5:, :2] = 0.0
    matrices[10:, 5] = matrices[10:, 3] - 2.0 * matrices[10:, 4]
    inverses, values = pseudo_inverse(matrices)
    for B, X, singular in zip(matrices, inverses, values, strict=True):
        np.testing.assert_allclose(B @ X @ B, B, atol=2e-14 * np.abs(B).max())
        np.testing.assert_allclose(X @ B @ X, X, atol=2e-13 * np.abs(X).max())
        np.testing.assert_allclose(B @ X, (B @ X).T, atol=1e-13)
        np.testing.assert_allclose(X @ B, (X @ B).T, atol=1e-13)
        np.testing.assert_allclose(
            np.sort(singular), np.linalg.svd(B, compute_uv=False)[::-1], atol=1e-13
        )
    # Each by itself as in a batch, to the bit.
    assert all(
        np.array_equal(pseudo_inverse(B)[0], X) for B, X in zip(matrices, inverses, strict=True)
    )


def leaning(front: float, rear: float) -> ca.Vehicle:
    """A quadrotor whose front and rear pairs lean forward [rad]."""
    places = [([0.2, 0.2, 0.0], front, 1), ([-0.2, 0.2, 0.0], rear, -1)]
    places += [([-0.2, -0.2, 0.0], rear, 1), ([0.2, -0.2, 0.0], front, -1)]
    rotors = [
        {"position": at, "axis": [np.sin(lean), 0.0, np.cos(lean)], "spin": spin}
        for at, lean, spin in places
    ]
    return ca.load_vehicle("slender").replace(
        {"uav.rotors": {"rotor": rotors, "thrust_limits": [0.0, 20.0], "torque_per_thrust": 0.016}}
    )


@pytest.mark.parametrize("lean", [(0.26, 0.0), (0.26, 0.26), (0.1, -0.2)])
def test_rotors_that_lean_give_lift_and_moments_as_asked(lean: tuple[float, float]) -> None:
    """Side forces that they cannot leave out spoil nothing of the rest."""
    rotors = leaning(*lean).uav.rotors
    assert rotors is not None and rotors.rank < 6
    asked = np.array([0.0, 0.0, 18.0, 0.3, -0.2, 0.05])
    given = rotors.allocation @ rotors.thrusts_for(asked)
    np.testing.assert_allclose(given[2:], asked[2:], atol=1e-13)


@pytest.mark.long
def test_rotors_that_push_a_level_vehicle_sideways_do_not_hover_by_themselves() -> None:
    start = ca.Scenario("hover", (0, 0, 2, 0, 0, 0, 0, 0), duration=0.01)
    with refused("uav.rotors"):
        ca.simulate(leaning(0.26, 0.0), start, sample=0.01)
    vehicle = leaning(0.26, 0.0)
    controlled = start.replace(controller=ca.flight_controller(vehicle))
    assert int(ca.simulate(vehicle, controlled, sample=0.01)["status"]) == 0


@pytest.mark.long
def test_tilted_rotors_rest_where_nothing_weighs() -> None:
    tilted = {"layout": "hex_tilted", "lever": 0.3, "tilt": 0.5, "thrust_limits": [0.0, 14.0]}
    vehicle = ca.load_vehicle("slender").replace(
        {"uav.rotors": tilted | {"torque_per_thrust": 0.016}}
    )
    start = ca.Scenario("adrift", (0, 0, 2, 0, 0, 0, 0.3, 0.4), gravity=0.0, duration=0.01)
    assert np.abs(ca.simulate(vehicle, start, sample=0.01)["rotor_thrust"]).max() < 1e-11


def test_power_is_that_of_momentum_theory() -> None:
    """f^1.5 = T v with the induced velocity v of T = 2 ρ A v²."""
    found = rotors("quad_x", radius=0.12)
    thrust = np.array([[0.0, 1.0, 4.0, 9.0]])
    area = np.pi * 0.12**2
    induced = np.sqrt(thrust / (2.0 * AIR_DENSITY * area))
    np.testing.assert_allclose(found.power(thrust), thrust * induced, rtol=1e-14)


@pytest.mark.parametrize(
    "given", [{"layout": "quad_x", "radius": 0.12, **GIVEN}, LIST], ids=["layout", "list"]
)
def test_a_vehicle_with_rotors_and_drag_is_the_same_after_a_round_trip_through_its_file(
    given: dict[str, Any], tmp_path: Path
) -> None:
    vehicle = with_rotors(**given).replace({"uav.drag": {"linear": [0.2, 0.2, 0.1]}})
    file = tmp_path / "quad.toml"
    file.write_text(as_toml(vehicle), encoding="utf-8")
    assert ca.load_vehicle(file) == vehicle
    assert ca.load_vehicle(file).describe() == vehicle.describe()


@pytest.mark.long
def test_rotors_of_a_flight_count_from_1_as_in_its_files(tmp_path: Path) -> None:
    lifted = SLENDER.replace({"uav.rotors": rotors("quad_x")})
    commands = [2.0, 3.0, 4.0, 5.0]
    start = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    scenario = ca.Scenario("x", start, rotor_command=commands, duration=0.01)
    flight = ca.simulate(lifted, scenario)
    ca.to_csv(flight, tmp_path / "flight.csv", scenario=scenario)
    heading, *rows = (tmp_path / "flight.csv").read_text().splitlines()
    columns = dict(zip(heading.split(","), rows[-1].split(","), strict=True))
    for number, command in enumerate(commands, 1):
        thrust = float(flight["rotor_thrust"].sel(rotor=number)[-1])
        told = next(value for name, value in columns.items() if f"rotor_thrust_{number}" in name)
        assert thrust == pytest.approx(command, rel=0.1) and float(told) == thrust


def test_fields_of_rotors_vary_over_the_runs_of_a_batch() -> None:
    levers, lags = [0.2, 0.25, 0.3], [0.02, 0.04, 0.06]
    batch = with_rotors(layout="quad_x", **GIVEN).replace(
        {"uav.rotors.lever": levers, "uav.rotors.lag": lags}
    )
    assert batch.runs == 3
    found = batch.uav.rotors
    assert found is not None and found.allocation.shape == (3, 6, 4)
    for run, lever in enumerate(levers):
        alone = rotors("quad_x", lever=lever, lag=lags[run])
        assert batch.select(run).uav.rotors == alone
        assert np.array_equal(found.inverse[run], alone.inverse)
    moved = with_rotors(**LIST).replace({"uav.rotors.rotor.1.position": np.eye(3) + 0.1})
    assert moved.uav.rotors is not None and moved.uav.rotors.allocation.shape == (3, 6, 4)


QUAD = {"layout": "quad_x", **GIVEN}
LINE = [{"position": [x, 0.0, 0.0], "spin": 1 if x > 0 else -1} for x in (-2, -1, 1, 2)]
UNUSABLE: list[tuple[dict[str, Any], str]] = [
    ({**QUAD, "layout": "quad_y"}, "uav.rotors.layout"),
    ({**QUAD, "lever": None}, "uav.rotors.lever"),
    ({**QUAD, "lever": 0.0}, "uav.rotors.lever"),
    ({**QUAD, "tilt": 0.1}, "uav.rotors.tilt"),
    ({**QUAD, "layout": "hex_tilted"}, "uav.rotors.tilt"),
    ({**QUAD, "thrust_limits": [9.0, 9.0]}, "uav.rotors.thrust_limits"),
    ({**QUAD, "thrust_limits": [-1.0, 9.0]}, "uav.rotors.thrust_limits"),
    ({**QUAD, "lag": -1.0}, "uav.rotors.lag"),
    ({**QUAD, "torque_per_thrust": 0.0}, "uav.rotors.torque_per_thrust"),
    ({**QUAD, "rotor": LINE}, "uav.rotors.layout"),
    (GIVEN, "uav.rotors.layout"),
    ({**LIST, "lever": 0.2}, "uav.rotors.lever"),
    ({**LIST, "rotor": LINE}, "uav.rotors.torque_per_thrust"),
    ({**LIST, "rotor": LIST["rotor"][:3]}, "uav.rotors.torque_per_thrust"),
    ({**LIST, "rotor": []}, "uav.rotors.rotor"),
    ({**LIST, "rotor": [{"position": [1, 0, 0]}]}, "uav.rotors.rotor.0.spin"),
    ({**LIST, "rotor": [{"position": [1, 0, 0], "spin": 2}]}, "uav.rotors.rotor.0.spin"),
    ({**QUAD, "thrust_limits": [0.0, 5.0]}, "uav.rotors.thrust_limits"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "field"), UNUSABLE, ids=lambda value: str(value)[:40])
def test_unusable_rotors_are_refused_in_one_sentence(given: dict[str, Any], field: str) -> None:
    with refused(field):
        with_rotors(**given)


def test_the_run_of_a_batch_that_rotors_cannot_lift_is_named() -> None:
    quad = with_rotors(**QUAD | {"thrust_limits": [0.0, 7.0]})
    with refused("uav.rotors.thrust_limits"):
        quad.replace({"uav.mass": [1.0, 2.0, 3.0]})


def test_unusable_drag_is_refused_in_one_sentence() -> None:
    with refused("uav.drag.linear"):
        SLENDER.replace({"uav.drag": {"linear": [0.1, 0.1, -0.1]}})


@pytest.mark.parametrize("lean", [1e-7, 1e-3, 0.05])
@pytest.mark.parametrize("inwards", [True, False])
def test_rotors_that_lean_by_little_share_a_lift_as_upright_ones_do(
    lean: float, inwards: bool
) -> None:
    """No side force would cost hundreds of newtons where it rests on their drag torques alone."""
    ways = np.random.default_rng(3).normal(size=(6, 2))

    def leaning(by: float) -> Rotors:
        angles = np.pi / 3.0 * (np.arange(6) + 0.5)
        out = np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1)
        sideways = -by * out[:, :2] if inwards else 0.4 * by * ways
        entries = [
            {"position": 0.3 * at, "axis": [*way, 1.0], "spin": spin}
            for at, way, spin in zip(out, sideways, [1, -1] * 3, strict=True)
        ]
        return Rotors(rotor=entries, thrust_limits=[0.0, 12.0], torque_per_thrust=0.016)

    wrench = np.array([0.0, 0.0, 25.0, 0.3, -0.2, 0.05])
    found = leaning(lean)
    thrusts = found.thrusts_for(wrench)
    assert found.rank < 6
    shared = np.linalg.pinv(found.allocation[2:]) @ wrench[2:]
    np.testing.assert_allclose(thrusts, shared, rtol=0, atol=1e-11)
    if inwards:
        np.testing.assert_allclose(thrusts, leaning(0.0).thrusts_for(wrench), rtol=0.01)


def test_a_force_that_a_law_asks_for_across_the_thrust_is_told() -> None:
    """A law that does not say what it needs may ask for a force that level rotors cannot give."""
    vehicle = SLENDER.replace({"uav.rotors": GIVEN | {"layout": "quad_x"}})
    gains = {"goal": np.zeros(3), "mass": float(SLENDER.mass), "inertia": np.full(3, 0.03)}
    gains |= {"rate": 2.0, "turn_rate": 8.0}
    law = ca.Controller("mine", own_law.law, gains, looks=False)
    aside = ca.Scenario("aside", [0.5, 0, 0, 0, 0, 0, 1e-6, 0], duration=0.02, controller=law)
    with pytest.warns(ca.ContinuairWarning, match="across the thrust"):
        ca.simulate(vehicle, aside, sample=0.01)
    with refused("controller"):
        ca.simulate(vehicle, aside.replace(controller=replace(law, asks=6)), sample=0.01)
