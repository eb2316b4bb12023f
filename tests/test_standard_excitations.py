"""The standard excitations mean the same for every vehicle."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.analysis.groups import place
from continuair.controllers.inertias import rigid_inertia
from continuair.scenario.excitations import Offset, Scaled, Shared, Swelling, Wave, is_vectorised
from continuair.studies.standard_excitations import EXCITATIONS, sample_time, standard_scenario
from continuair.typing import Model
from tests.refusals import refused

HEAVY = {"arm.disks": [{"position": 0.6, "mass": 0.1}], "uav.mount": [0.02, -0.01, -0.05]}


@pytest.mark.parametrize("model", ca.MODELS)
def test_without_a_load_the_bent_arm_is_held_still(model: Model) -> None:
    vehicle = ca.load_vehicle("slender").replace(HEAVY)
    scenario = standard_scenario("force", vehicle, load=0.0, bend=0.7, periods=2.0)
    flight = ca.simulate(vehicle, scenario, model=model, method="RK4", step="auto")
    tip = flight["tip_position"].to_numpy()
    assert np.abs(tip - tip[0]).max() < 1e-13


def test_a_held_hover_is_the_trim_of_each_vehicle_of_a_batch() -> None:
    vehicle = ca.load_vehicle("paper").replace(HEAVY).replace({"uav.mass": [1.0, 3.0]})
    scenario: Any = standard_scenario("bend", vehicle, bend=0.4)
    q = np.broadcast_to(scenario.q, (2, 8))
    for run in range(2):
        kappa = q[run, 6] * np.array([1.0, 1.0]) / np.sqrt(2.0)
        trim = ca.trim(vehicle.select(run), bend=kappa)
        # The trim is solved to rounding.
        assert scenario.force[run] == pytest.approx(trim.force, abs=1e-12)
        assert scenario.moment[run] == pytest.approx(trim.moment, abs=5e-14)
        assert scenario.bend_moment(0.0)[run] == pytest.approx(trim.bend_moment, abs=1e-11)


def test_the_load_ratio_of_bend_and_tip_is_the_angle_it_holds() -> None:
    """A slow load bends the arm by its load ratio, to first order and without gravity."""
    vehicle = ca.load_vehicle("paper").replace({"uav.mass": 1e6, "uav.inertia": [1e6, 1e6, 1e6]})
    vehicle = vehicle.replace({"arm.damping_ratio": 0.5})
    for name in ("bend", "tip"):
        scenario = standard_scenario(name, vehicle, 0.01, 0.01, 0.0, periods=25.0, gravity=0.0)
        bend = ca.simulate(vehicle, scenario, method="RK4", step=1e-3)["bend"].to_numpy()[-1, 0]
        assert bend * vehicle.arm.length == pytest.approx(0.01, rel=2e-3)


def test_the_load_of_a_moment_rocks_the_rigid_vehicle_about_the_origin_of_b() -> None:
    """A free one turns about its centre of mass: `paper` by 0.12, as advised_limits.md says."""
    vehicle = ca.load_vehicle("paper")
    rate = 0.5 * vehicle.arm.clamped_frequency
    moment: Any = standard_scenario("moment", vehicle, bend=0.0).moment
    highest = moment(np.pi / vehicle.arm.clamped_frequency)[1]
    M = rigid_inertia(vehicle)
    assert highest / (M[4, 4] * rate**2) == pytest.approx(0.1, rel=1e-9)
    free = np.linalg.solve(M, highest * np.eye(6)[4])[4] / rate**2
    assert free == pytest.approx(0.12, abs=0.005)
    assert "about B's origin" in EXCITATIONS["moment"].load


@pytest.mark.parametrize("number", [0.05, 0.5])
def test_under_gravity_the_load_bends_a_hanging_arm_less(number: float) -> None:
    """By 1 + 5/3 of the gravity number, as advised_limits.md says, at rest and to first order."""
    length, per_length = 0.6, 0.15
    stiffness = 9.81 * per_length * length**3 / (20.0 * number)
    arm = {"length": length, "bending_stiffness": stiffness, "mass_per_length": per_length}
    vehicle = ca.Vehicle(name="x", uav={"mass": 1.5, "inertia": [0.02, 0.02, 0.03]}, arm=arm)
    assert place(vehicle)["gravity_number"] == pytest.approx(number, rel=1e-12)
    expected = 0.2 / (1.0 + 5.0 / 3.0 * number)
    for name in ("bend", "tip"):
        assert "without gravity" in EXCITATIONS[name].load
    # At the end of a quarter of its period, which is two clamped ones, a load is at its largest.
    highest: Any = np.pi / vehicle.arm.clamped_frequency
    moment: Any = standard_scenario("bend", vehicle, bend=0.0).bend_moment
    held = ca.trim(vehicle, bend=[expected / length, 0.0]).bend_moment
    assert held[0] == pytest.approx(moment(highest)[0], rel=1e-3)
    wrench: Any = standard_scenario("tip", vehicle, bend=0.0).tip_wrench
    bend = ca.trim(vehicle, tip_wrench=wrench(highest)).q[6]
    # A finite turn takes some of the force's lever: a hundredth at 0.2 rad.
    assert bend * length == pytest.approx(expected, rel=1e-2)


def test_every_excitation_flies_with_every_model() -> None:
    vehicle = ca.load_vehicle("paper")
    for name in EXCITATIONS:
        scenario = standard_scenario(name, vehicle)
        models: tuple[Model, ...] = ("decoupled", "independent")
        found = ca.run_pairs(vehicle, scenario, models, sample=sample_time(vehicle))
        assert (found["status"] == 0).all(), name
        assert (found["rmse_t_m"].isel(model=slice(1, None)) > 0.0).all(), name


def test_an_unknown_excitation_is_told_with_the_nearest_name() -> None:
    with refused("excitation"):
        standard_scenario("momnt", ca.load_vehicle("paper"))


@pytest.mark.parametrize("runs", [None, 3])
def test_values_at_many_times_at_once_are_those_one_after_the_other(runs: int | None) -> None:
    rng = np.random.default_rng(4)
    size = () if runs is None else (runs,)
    amplitude, start, end, phase = rng.uniform(0.5, 2.0, (4, *size))
    wave = Wave(6, 1, amplitude, start, end, phase, 2.0)
    shared = Shared(wave, rng.normal(size=(*size, 6)))
    found: list[Any] = [wave, shared, Scaled(shared, rng.normal(size=size)), Swelling(wave, 0.4),
             Offset(Swelling(Scaled(shared, 2.0), 0.4), rng.normal(size=(*size, 6)))]  # fmt: skip
    times = np.linspace(0.0, 2.0, 50)
    for each in found:
        assert is_vectorised(each)
        one_by_one = np.array([each(t) for t in times.tolist()]).reshape(len(times), -1, 6)
        np.testing.assert_allclose(each(times[:, None]), one_by_one, rtol=1e-14, atol=1e-15)
    assert not is_vectorised(Swelling(lambda t: np.full(6, t), 0.4))
