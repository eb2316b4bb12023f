"""What holds of every term, tried on one that only the tests define: it is a file on the list."""

import ast
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import terms
from continuair.engine.pack import tree_of
from continuair.flight.reading import vehicle_of
from continuair.typing import Model
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused
from tests.terms.tip_drag import TipDrag
from tests.terms.tip_spring import TipSpring

VEHICLE = ca.load_vehicle("dual_arm")
PER_VELOCITY = 0.4
DRAGGING = VEHICLE.replace({"terms": (TipDrag(PER_VELOCITY),)})
UP = np.array([0.0, 0.0, 9.81])
EVERYTHING = DRAGGING.replace(
    {
        "uav.rotors": {
            "layout": "quad_x",
            "lever": 0.25,
            "thrust_limits": [0.0, 30.0],
            "lag": 0.03,
            "lag_down": 0.05,
            "torque_per_thrust": 0.016,
            "thrust_model_factor": 0.7,
            "hub_drag": [0.1, 0.2],
            "translational_lift": 0.003,
            "radius": 0.12,
        },
        "uav.drag": {"linear": [0.3, 0.2, 0.1], "quadratic": [0.05, 0.06, 0.07]},
        "arm.0.section.0.drag_coefficient": 1.1,
    }
)
"""One vehicle on which all terms of the list act but tendons, and one of the tests."""
PULLED = EVERYTHING.replace(
    {"arm.0.tendon": [{"angles": [0.0, 2.0, 4.0], "offset": 0.01, "pretension": 2.0}]}
)
"""And by tendons, too."""
HELD = ca.load_vehicle("paper").replace({"terms": (TipSpring(20.0, (0.1, 0.2, -0.5)),)})
SOFT = HELD.replace({"terms.0.stiffness": 0.0})
STATE = ("attitude", "bend", "velocity", "angular_velocity", "bend_rate")


def swinging(vehicle: ca.Vehicle, runs: slice | int = 0) -> ca.Scenario:
    """One of nine starts, or several of them."""
    q, qd = np.random.default_rng(3).normal(size=(2, 9, 6 + 2 * vehicle.sections))
    return ca.Scenario("swing", 0.3 * q[runs], 0.5 * qd[runs], duration=0.02)


def state_of(flight: xr.Dataset) -> dict[str, Any]:
    """The state at every sample, as `accelerations` takes it."""
    found = {name: flight[name].to_numpy() for name in STATE}
    found["velocity"] = Rotation.from_quat(found["attitude"]).apply(found["velocity"])
    return found


@pytest.mark.parametrize("model", ca.MODELS)
def test_it_does_what_the_same_wrench_on_the_tips_does(model: Model) -> None:
    flight = ca.simulate(VEHICLE, swinging(VEHICLE), model="coupled", sample=4e-3)
    state, tips = state_of(flight), flight["tip_velocity"].to_numpy()
    wrench = np.concatenate([-PER_VELOCITY * tips, np.zeros_like(tips)], axis=-1)
    expected = ca.accelerations(VEHICLE, **state, tip_wrench=wrench, model=model)
    without = ca.accelerations(VEHICLE, **state, model=model)
    for found, same, other in zip(
        ca.accelerations(DRAGGING, **state, model=model), expected, without, strict=True
    ):
        size = np.abs(same).max()
        assert np.abs(found - same).max() < 1e-12 * size
        assert np.abs(found - other).max() > 1e-4 * size


@pytest.mark.long
def test_the_arms_put_it_on_the_uav() -> None:
    """The balance of momentum of the UAV alone, on which nothing else acts but its weight."""
    flight = ca.simulate(DRAGGING, swinging(DRAGGING), sample=4e-3)
    state = state_of(flight)
    v_rate, w_rate, _ = ca.accelerations(DRAGGING, **state)
    back, w = Rotation.from_quat(state["attitude"]).inv(), state["angular_velocity"]
    inertia = np.asarray(DRAGGING.uav.inertia)
    force = DRAGGING.uav.mass * back.apply(v_rate + UP)
    moment = w_rate @ inertia + np.cross(w, w @ inertia)
    for name, expected in (("base_force", force), ("base_moment", moment)):
        found = flight[name].to_numpy().sum(axis=1)
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_it_takes_the_power_that_it_says() -> None:
    free = DRAGGING.replace(
        {
            f"arm.{arm}.section.{at}.{name}": 0.0
            for arm, chain in enumerate(DRAGGING.arms)
            for at, section in enumerate(chain.section)
            for name in [_damping_of(section)]
        }
    )
    flight = ca.simulate(free, swinging(free), method="RK4", step=2e-5, sample=2e-4)
    parts = [flight[f"{name}_energy"].to_numpy() for name in ("kinetic", "gravity", "elastic")]
    energy = np.sum(parts, axis=0)
    power = -PER_VELOCITY * np.sum(flight["tip_velocity"].to_numpy() ** 2, axis=(1, 2))
    spent = np.trapezoid(power, flight["time"].to_numpy())
    assert float(energy[-1] - energy[0]) == pytest.approx(spent, rel=1e-5)


def _damping_of(section: Any) -> str:
    return "structural_damping" if section.damping_ratio is None else "damping_ratio"


@pytest.mark.long
def test_a_run_of_a_batch_is_the_same_alone() -> None:
    assert {*map(type, terms.terms_of(PULLED))} >= {*terms.TERMS, TipDrag}
    several = np.random.default_rng(4).normal(size=(9, 12))
    acting = {
        "tau": 0.01 * several[:, : 6 + 2 * VEHICLE.sections],
        "moment": np.array([0.1, 0.0, 0.2]),
        "tip_wrench": 0.2 * several,
        "wind": 2.0 * several[:, :3],
        "rotor_command": 8.0 + several[:, :4],
    }
    together = swinging(VEHICLE, slice(None)).replace(**acting)
    batch = ca.simulate(PULLED, together, method="RK4", step=1e-3, sample=0.02)
    for run in (0, 8):
        own = {name: value[run] if value.ndim > 1 else value for name, value in acting.items()}
        scenario = swinging(VEHICLE, run).replace(**own)
        alone = ca.simulate(PULLED, scenario, method="RK4", step=1e-3, sample=0.02)
        for name in ("position", "bend", "tip_position", "base_force", "rotor_thrust"):
            one, same = alone[name].to_numpy(), batch[name].to_numpy()[run]
            assert np.abs(one - same).max() < 1e-10 * np.abs(one).max(), name


@pytest.mark.long
def test_casadi_has_it_or_refuses_the_vehicle() -> None:
    pytest.importorskip("casadi")
    flight = ca.simulate(DRAGGING, swinging(DRAGGING), sample=0.02)
    state = {name: value[0] for name, value in state_of(flight).items()}
    model = ca.to_casadi(EVERYTHING)
    found, names = model.call(state), model.name_out()
    for name, expected in zip(names, ca.accelerations(EVERYTHING, **state), strict=True):
        value = np.array(found[name]).reshape(expected.shape)
        assert np.abs(value - expected).max() < 1e-9 * np.abs(expected).max()
    with refused("vehicle"):
        ca.to_casadi(HELD)


def test_mujoco_has_no_terms(tmp_path: Path) -> None:
    with refused("vehicle"):
        ca.to_mjcf(HELD, tmp_path / "held.xml")
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_the_gradient_holds_it() -> None:
    """Along the start, and along the term's own number, against differences of flights."""
    at = "terms.0.per_velocity"

    def height(flight: xr.Dataset) -> tuple[float, dict[str, Any]]:
        tip = flight["tip_position"].to_numpy()
        slope = np.zeros_like(tip)
        slope[-1, 0] = 1.0, 2.0, 3.0
        return float((tip * slope).sum()), {"tip_position": slope}

    found = ca.gradient(DRAGGING, swinging(DRAGGING), height, fields=[at], step=1e-3, sample=0.02)
    ends = [
        ca.simulate(
            DRAGGING.replace({at: value}), swinging(DRAGGING), method="RK4", step=1e-3, sample=0.02
        )
        for value in (PER_VELOCITY - 1e-3, PER_VELOCITY + 1e-3)
    ]
    below, above = (height(flight)[0] for flight in ends)
    assert float(found.fields[at]) == pytest.approx((above - below) / 2e-3, rel=1e-6)
    with refused("vehicle"):
        ca.gradient(HELD, swinging(HELD), height)


def test_linearisation_holds_it() -> None:
    """Of a vehicle at rest: drag of a tip at its height takes m v̇ = -c v of the same push."""
    A, _ = ca.linearize(VEHICLE)
    damped, _ = ca.linearize(DRAGGING)
    first = 6 + 2 * DRAGGING.sections
    lost = (damped - A)[first : first + 3, first : first + 3]
    fall = ca.accelerations(DRAGGING, velocity=np.array([0.0, 0.0, 1e-3]))[0][2] + 9.81
    assert lost[2, 2] == pytest.approx(fall / 1e-3, rel=1e-6)


def test_its_energy_is_part_of_the_total() -> None:
    """Of undamped arms on springs: the sum stays, in each run of a batch of stiffnesses."""
    free = HELD.replace({"arm.damping_ratio": 0.0, "terms.0.stiffness": np.linspace(0.0, 40.0, 9)})
    flight = ca.simulate(free, swinging(HELD), duration=0.1, method="RK4", step=1e-4, sample=0.01)
    names = ("kinetic", "gravity", "elastic", "term")
    energy = np.sum([flight[f"{name}_energy"].to_numpy() for name in names], axis=0)
    assert np.abs(energy - energy[:, :1]).max() < 1e-8 * np.ptp(flight["term_energy"].to_numpy())
    spring: Any = HELD.terms[0]
    stretch = flight["tip_position"].to_numpy() - spring.point
    expected = 0.5 * np.linspace(0.0, 40.0, 9)[:, None] * np.sum(stretch**2, axis=-1)
    assert flight["term_energy"].to_numpy() == pytest.approx(expected, rel=1e-12)
    assert "term_energy" not in ca.simulate(DRAGGING, swinging(DRAGGING), sample=0.02)


@pytest.mark.long
def test_a_stiff_term_is_refused_by_the_implicit_integrator() -> None:
    with refused("method"):
        ca.simulate(HELD, swinging(HELD), method="implicit", step=1e-3)
    flights = [
        ca.simulate(DRAGGING, swinging(DRAGGING), method=name, step=1e-5, sample=0.02)
        for name in ("implicit", "RK4")
    ]
    implicit, explicit = (flight["tip_position"].to_numpy() for flight in flights)
    assert np.abs(implicit - explicit).max() < 1e-6


def test_terms_that_differ_in_numbers_share_kernels() -> None:
    one, other = (VEHICLE.replace({"terms": (TipDrag(value),)}) for value in (0.1, 0.2))
    assert one != other
    assert tree_of(one) == tree_of(other)
    two = HELD.replace({"terms": (*HELD.terms, TipSpring(1.0, (0.0, 0.0, 0.0)))})
    assert len(set(tree_of(two).terms[-2:])) == 2


def test_a_vehicle_says_its_terms_and_no_file_holds_them() -> None:
    said = HELD.describe()
    assert said["terms"] == [
        {"term": "TipSpring", "stiffness": 20.0, "point": [0.1, 0.2, -0.5], "arm": 0}
    ]
    with refused("terms.0"):
        ca.Vehicle(**said)
    with refused("vehicle"):
        as_toml(HELD)
    with refused("vehicle"):
        ca.equations.forward_dynamics(HELD, np.zeros(8), np.zeros(8))


@pytest.mark.long
def test_it_flies_in_pairs_and_steps_and_its_results_are_drawn() -> None:
    """A result tells the shape of the vehicle, which its terms do not change."""
    flight = ca.simulate(HELD, swinging(HELD), method="RK4", step=2e-4, sample=0.02)
    assert vehicle_of(flight) == HELD.replace({"terms": ()})
    # All models fall apart from their start alike, but for the spring.
    held, soft = (ca.run_pairs(vehicle, swinging(HELD))["nrmse_t"] for vehicle in (HELD, SOFT))
    assert not np.allclose(held.to_numpy(), soft.to_numpy())
    stepped = ca.Simulation(HELD, swinging(HELD), control_period=0.02, step=2e-4)
    stepped.step()
    found = stepped.trajectory()
    for name in ("tip_position", "term_energy"):
        assert found[name][-1].to_numpy() == pytest.approx(flight[name][-1].to_numpy(), rel=1e-6)


def test_a_term_that_is_not_whole_is_refused() -> None:
    @dataclass(frozen=True)
    class Nothing(ca.Term):
        kinds: Any = ()

    with refused("term Nothing"):
        ca.simulate(HELD.replace({"terms": (Nothing(),)}), swinging(HELD))
    with refused("Nothing.kinds"):
        Nothing([1, 2])


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"terms": TipDrag(1.0)}, "terms"),
        ({"terms": (TipDrag,)}, "terms.0"),
        ({"terms.0.stiffness": "soft"}, "terms.0.TipSpring.stiffness"),
        ({"terms.0.point": [1.0, 2.0]}, "terms.0.TipSpring.point"),
        ({"terms.0.stiffness": [1.0, np.nan]}, "terms.0.TipSpring.stiffness"),
        ({"terms.0.stiffness": [1.0, 2.0], "uav.mass": [2.0, 2.1, 2.2]}, "terms.0.stiffness"),
    ],
)
def test_what_is_no_term_is_refused(changes: dict[str, Any], field: str) -> None:
    with refused(field):
        HELD.replace(changes)


def test_no_other_file_names_a_term() -> None:
    """All others go over the list."""
    package = Path(terms.__file__).parents[1]
    own = package / "terms"
    names = {path.stem for path in own.glob("*.py")} - {"__init__", "term"}
    classes = {term.__name__ for term in terms.TERMS}
    for path in package.rglob("*.py"):
        if path.parent == own:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        found = {f"{each.module}" for each in imports}
        found |= {f"{each.module}.{name.name}" for each in imports for name in each.names}
        named = {f"continuair.terms.{name}" for name in names | classes}
        assert not found & named, path
