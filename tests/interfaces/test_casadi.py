"""The model in CasADi is that of the kernels, and its derivatives are those of what it says."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.refusals import refused
from tests.sections.strains import flying as strained
from tests.sections.strains import rod

casadi = pytest.importorskip("casadi")

PRESETS = ("paper", "two_section", "dual_arm")
Array = np.ndarray


def flying(name: str) -> ca.Vehicle:
    """A preset, or one with all that acts: rotors, which stand still, and drag of UAV and arm."""
    if name != "draggy":
        return ca.load_vehicle(name)
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 12.0], "radius": 0.12,
              "torque_per_thrust": 0.02}  # fmt: skip
    drag = {"linear": [0.3, 0.2, 0.1], "quadratic": [0.05, 0.06, 0.07]}
    paper: dict[str, Any] = ca.load_vehicle("paper").describe()
    uav = paper["uav"] | {"rotors": rotors, "drag": drag}
    return ca.Vehicle(**paper | {"uav": uav, "arm": paper["arm"] | {"drag_coefficient": 1.1}})


def state(vehicle: ca.Vehicle, seed: int, bend: float = 1.0) -> dict[str, Any]:
    """Random arguments; bend: typical angle from end to end of a section [rad]."""
    draw = np.random.default_rng(seed).normal
    per_section, lengths = (
        (vehicle.sections, 2),
        [[section.length] for arm in vehicle.arms for section in arm.section],
    )
    return {
        "attitude": draw(size=4),
        "bend": bend * draw(size=per_section) / lengths,
        "velocity": 3.0 * draw(size=3),
        "angular_velocity": 2.0 * draw(size=3),
        "bend_rate": draw(size=per_section) / lengths,
        "force": 20.0 * draw(size=3),
        "moment": draw(size=3),
        "bend_moment": 0.1 * draw(size=per_section),
        "tip_wrench": draw(size=(len(vehicle.arms), 6)),
    }


def flat(found: Any) -> Array:
    return np.concatenate([np.ravel(each) for each in found])


def called(function: Any, arguments: dict[str, Any]) -> list[Any]:
    """The outputs in their order, which a call by name does not keep."""
    found = function(**arguments)
    return [found[name] for name in function.name_out()]


@pytest.mark.parametrize(
    ("name", "bend"),
    [
        pytest.param(name, bend, marks=[pytest.mark.long] * ((name, bend) != ("two_section", 1.0)))
        for name in (*PRESETS, "draggy")
        for bend in (0.0, 1e-4, 1.0, 2.0)
    ],
)
def test_casadi_accelerates_as_the_kernels_do(name: str, bend: float) -> None:
    vehicle = flying(name)
    function = ca.to_casadi(vehicle)
    for seed in range(5):
        drawn = state(vehicle, seed, bend)
        expected = flat(ca.accelerations(vehicle, **drawn))
        error = np.abs(flat(map(np.array, called(function, drawn))) - expected)
        # Between them are rounding and polynomials that hold to 1e-13.
        assert error.max() < 1e-11 * np.abs(expected).max()


@pytest.mark.long
@pytest.mark.parametrize("name", [*PRESETS, "draggy"])
@pytest.mark.parametrize("bend", [0.0, 1e-4, 1.0])
def test_its_jacobian_is_the_slope_of_the_kernels(name: str, bend: float) -> None:
    vehicle = flying(name)
    drawn = state(vehicle, 3, bend)
    found = slopes(ca.to_casadi(vehicle), drawn)
    expected = differences(vehicle, drawn)
    # Central differences over 1e-5 of what is of the order of 1 to 100.
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


def slopes(function: Any, drawn: dict[str, Any]) -> Array:
    """Of the accelerations by all arguments, both flat and row by row."""
    x = casadi.MX.sym("x", sum(value.size for value in drawn.values()))
    parts = np.split(np.arange(x.numel()), np.cumsum([v.size for v in drawn.values()])[:-1])
    given = {
        name: casadi.reshape(x[list(part)], *value.shape[::-1], *[1] * (2 - value.ndim)).T
        for part, (name, value) in zip(parts, drawn.items(), strict=True)
    }
    found = casadi.vertcat(*(casadi.vec(each.T) for each in called(function, given)))
    return np.array(casadi.Function("J", [x], [casadi.jacobian(found, x)])(flat(drawn.values())))


def differences(vehicle: ca.Vehicle, drawn: dict[str, Any], step: float = 1e-5) -> Array:
    """The same of `continuair.accelerations`, all of them in one batch."""
    x, sizes = flat(drawn.values()), [value.size for value in drawn.values()]
    rows = x + step * np.vstack([np.eye(len(x)), -np.eye(len(x))])
    batch: dict[str, Any] = {
        name: part.reshape(len(rows), *value.shape)
        for part, (name, value) in zip(
            np.split(rows, np.cumsum(sizes)[:-1], axis=1), drawn.items(), strict=True
        )
    }
    found = ca.accelerations(vehicle, **batch)
    above, below = np.split(np.hstack([each.reshape(len(rows), -1) for each in found]), 2)
    return (above - below).T / (2.0 * step)


@pytest.mark.long
def test_second_derivatives_at_a_straight_arm_are_finite_and_symmetric_in_its_plane() -> None:
    vehicle = ca.load_vehicle("two_section")
    function = ca.to_casadi(vehicle)
    bend = casadi.MX.sym("bend", vehicle.sections, 2)
    drawn = {name: value for name, value in state(vehicle, 1).items() if name != "bend"}
    along = function(**drawn, bend=bend)["bend_acceleration"][0, 0]
    H = casadi.Function("H", [bend], [casadi.hessian(along, casadi.vec(bend))[0]])
    straight, nearly = (np.array(H(size * np.ones((2, 2)))) for size in (0.0, 1e-6))
    assert np.isfinite(straight).all()
    np.testing.assert_allclose(straight, nearly, rtol=0, atol=1e-4 * np.abs(straight).max())


DISK = {"position": 0.2, "mass": 0.02, "inertia": (2e-6, 4e-6)}
GRIPPER = {"mass": 0.1, "centre": [0.01, 0.0, 0.02], "inertia": [1e-4, 1e-4, 2e-4]}
STRAINED = strained(
    rod(bending=1, twist=0, stretch=0, shear=0, drag_coefficient=1.1, disks=[DISK]),
    rod(length=0.3), tip=GRIPPER,
)  # fmt: skip


def strained_state(seed: int, bend: float) -> dict[str, Any]:
    """Random arguments; bend: typical angle from end to end of a section [rad]."""
    drawn = state(STRAINED, seed)
    draw = np.random.default_rng(seed + 100).normal
    sizes = np.array([*5 * [2.0], *3 * [0.05], *2 * [3.0]])
    drawn = {name: value for name, value in drawn.items() if "bend" not in name}
    return drawn | {
        "strain": bend * sizes * draw(size=10),
        "strain_rate": sizes * draw(size=10),
        "strain_force": 0.1 * draw(size=10),
    }


@pytest.mark.parametrize("bend", [0.0, 1e-4, 0.5])
def test_casadi_accelerates_sections_whose_strain_varies_as_the_kernels_do(bend: float) -> None:
    """A linear section that twists, stretches and shears, with an arc and a body beyond it."""
    function = ca.to_casadi(STRAINED)
    for seed in range(5):
        drawn = strained_state(seed, bend)
        expected = flat(ca.accelerations(STRAINED, **drawn))
        error = np.abs(flat(map(np.array, called(function, drawn))) - expected)
        # Momenta are differentiated here, of axes that the kernels turn by sums over nodes.
        assert error.max() < 1e-9 * np.abs(expected).max()


@pytest.mark.long
def test_the_jacobian_of_a_strained_arm_is_the_slope_of_the_kernels() -> None:
    drawn = strained_state(3, 0.5)
    found = slopes(ca.to_casadi(STRAINED), drawn)
    expected = differences(STRAINED, drawn)
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("strain", [[6.0, 6.1, 1.7, 1.7], [0, 0, 12.4, 0.2]])
def test_beyond_a_full_circle_of_strain_values_are_nan(strain: list[float]) -> None:
    """As in the kernels, by the sums of the absolute coefficients."""
    vehicle = strained(rod(bending=1))
    function = ca.to_casadi(vehicle)
    for share in (0.995, 1.0):
        given: dict[str, Any] = {"attitude": [0.0, 0.0, 0.0, 1.0]}
        given["strain"] = share * np.array(strain, float)
        ours = flat(ca.accelerations(vehicle, **given))
        found = flat(map(np.array, called(function, given)))
        assert np.isfinite(ours).all() == np.isfinite(found).all() == (share < 1.0)


def test_what_is_left_out_of_a_call_is_nothing_but_gravity() -> None:
    vehicle = ca.load_vehicle("paper")
    found = called(ca.to_casadi(vehicle), {"attitude": [0, 0, 0, 1]})
    falling = [0, 0, -9.81, *5 * [0]]
    np.testing.assert_allclose(flat(map(np.array, found)), falling, rtol=0, atol=1e-12)


def test_beyond_a_full_circle_values_and_slopes_are_nan() -> None:
    function = ca.to_casadi(ca.load_vehicle("paper"))
    bend = casadi.MX.sym("bend", 1, 2)
    v_rate = function(attitude=[0, 0, 0, 1], bend=bend)["velocity_rate"]
    both = casadi.Function("both", [bend], [v_rate, casadi.jacobian(v_rate, bend)])
    for at, known in ((6.28, True), (6.29, False)):
        assert all(np.isfinite(np.array(each)).all() == known for each in both([at, 0.0]))


def test_a_batch_of_vehicles_is_refused() -> None:
    with refused("vehicle"):
        ca.to_casadi(ca.load_vehicle("paper").replace({"uav.mass": np.array([2.0, 3.0])}))
