"""What holds of every term, tried on one that only the tests define: it is a file on the list."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import terms
from tests.terms.tip_drag import PER_VELOCITY, TipDrag, WithoutForm

VEHICLE = ca.load_vehicle("dual_arm")
DRAGGING = VEHICLE.replace({"name": TipDrag.name})
UP = np.array([0.0, 0.0, 9.81])
STATE = ("attitude", "bend", "velocity", "angular_velocity", "bend_rate")


@pytest.fixture(autouse=True)
def listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terms, "TERMS", (*terms.TERMS, TipDrag, WithoutForm))


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
def test_it_does_what_the_same_wrench_on_the_tips_does(model: str) -> None:
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
    flight = ca.simulate(free, swinging(free), step=2e-5, sample=2e-4)
    parts = [flight[f"{name}_energy"].to_numpy() for name in ("kinetic", "gravity", "elastic")]
    energy = np.sum(parts, axis=0)
    power = -PER_VELOCITY * np.sum(flight["tip_velocity"].to_numpy() ** 2, axis=(1, 2))
    spent = np.trapezoid(power, flight["time"].to_numpy())
    assert float(energy[-1] - energy[0]) == pytest.approx(spent, rel=1e-5)


def _damping_of(section: Any) -> str:
    return "structural_damping" if section.damping_ratio is None else "damping_ratio"


def test_a_run_of_a_batch_is_the_same_alone() -> None:
    batch = ca.simulate(DRAGGING, swinging(DRAGGING, slice(None)), sample=0.02)
    for run in (0, 8):
        alone = ca.simulate(DRAGGING, swinging(DRAGGING, run), sample=0.02)
        for name in ("position", "bend", "tip_position"):
            one, same = alone[name].to_numpy(), batch[name].to_numpy()[run]
            assert np.abs(one - same).max() < 1e-11 * np.abs(one).max()


def test_casadi_has_it_or_refuses_the_vehicle() -> None:
    pytest.importorskip("casadi")
    flight = ca.simulate(DRAGGING, swinging(DRAGGING), sample=0.02)
    state = {name: value[0] for name, value in state_of(flight).items()}
    model = ca.to_casadi(DRAGGING)
    found, names = model.call(state), model.name_out()
    for name, expected in zip(names, ca.accelerations(DRAGGING, **state), strict=True):
        value = np.array(found[name]).reshape(expected.shape)
        assert np.abs(value - expected).max() < 1e-9 * np.abs(expected).max()
    with pytest.raises(ca.InputError, match="tip_drag"):
        ca.to_casadi(VEHICLE.replace({"name": WithoutForm.name}))


def test_what_does_not_know_it_refuses_it() -> None:
    with pytest.raises(ca.InputError, match="tip_drag"):
        ca.gradient(DRAGGING, swinging(DRAGGING), lambda flight: (0.0, {}))


def test_linearisation_holds_it() -> None:
    """Of a vehicle at rest: drag of a tip at its height takes m v̇ = -c v of the same push."""
    A, _ = ca.linearize(VEHICLE)
    damped, _ = ca.linearize(DRAGGING)
    first = 6 + 2 * DRAGGING.sections
    lost = (damped - A)[first : first + 3, first : first + 3]
    fall = ca.accelerations(DRAGGING, velocity=np.array([0.0, 0.0, 1e-3]))[0][2] + 9.81
    assert lost[2, 2] == pytest.approx(fall / 1e-3, rel=1e-6)


def test_no_file_of_the_device_names_a_term() -> None:
    """Engine and kernels go over the list."""
    package = Path(terms.__file__).parents[1]
    names = [path.stem for path in package.glob("terms/*.py") if path.stem not in ("__init__",)]
    for path in [*package.glob("kernels/**/*.py"), *package.glob("engine/*.py")]:
        text = path.read_text(encoding="utf-8")
        assert not [name for name in names if f"terms.{name}" in text], path.name
