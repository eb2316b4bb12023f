"""Judges of III-C and Appendix B: corrected formulas turn their verdicts."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair import equations
from continuair.scenario.paper_tests import open_loop_test
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import coupling_elements, disks, dynamics
from continuair.studies.paper.judges.agreement import random_states
from continuair.studies.paper.judges.elementwise import Elementwise
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED, UNDECIDED, Judgement
from continuair.vehicle.vehicle import Vehicle

VEHICLE = ca.load_vehicle("paper")
DAMPED = VEHICLE.replace({"arm.damping": 0.3, "arm.kappa_s": 0.0, "uav.mount": [0.03, -0.05, 0.04]})

FOUND = {
    "III-C.3": NOT_REPRODUCED,
    "III-C.6": NOT_REPRODUCED,
    "III-C.7": REPRODUCED,
    "III-C.8": REPRODUCED,
    "III-C.10": REPRODUCED,
    "III-C.11": REPRODUCED,
    "III-C.12": REPRODUCED,
    "III-C.13": REPRODUCED,
    "III-C.14": REPRODUCED,
    "App-B.1": NOT_REPRODUCED,
    "App-B.2": NOT_REPRODUCED,
}
FLOWN = {"III-C.5", "III-C.15", "III-C.16"}


def judged(name: str, vehicle: Vehicle = VEHICLE) -> Judgement:
    return dynamics.JUDGES[name](Evidence(vehicle, quick=True))


def test_every_sentence_of_this_section_has_its_judge() -> None:
    assert set(dynamics.JUDGES) == set(FOUND) | FLOWN


@pytest.mark.parametrize("name", FOUND)
def test_verdict_does_not_hang_on_the_arm(name: str) -> None:
    assert judged(name).verdict == FOUND[name]
    gripper = {"position": 0.7, "mass": 0.1}
    other = DAMPED.replace({"arm.length": 0.7, "arm.radius": 0.003, "arm.disks": [gripper]})
    assert judged(name, other).verdict == FOUND[name]


def test_the_other_sign_closes_the_balance(monkeypatch: pytest.MonkeyPatch) -> None:
    right = equations.forward_dynamics

    def reversed_wrench(*at: Any, tip_wrench_sign: int) -> Any:
        return right(*at, tip_wrench_sign=-tip_wrench_sign)

    monkeypatch.setattr(equations, "forward_dynamics", reversed_wrench)
    found = judged("III-C.3")
    assert found.verdict == REPRODUCED
    assert found.numbers["gap_over_power_of_F_e_with_the_other_sign"] == pytest.approx(2.0)


def test_a_balance_without_the_elastic_force_does_not_close(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the text calls G, the gravity matrix alone, would lose energy whatever the sign."""
    right = dynamics.power

    def without(vehicle: Vehicle, q: Any, qd: Any, qdd: Any) -> float:
        return right(vehicle, q, qd, qdd) - float(equations.elastic_vector(vehicle, q) @ qd)

    monkeypatch.setattr(dynamics, "power", without)
    assert judged("III-C.3").numbers["gap_over_power_of_F_e_with_the_other_sign"] > 0.1


def test_element_by_element_every_coordinate_moves_as_with_the_diagonal_mask() -> None:
    # A disk as wide as a plate, whose own inertia counts.
    plate = {"position": 1.0, "mass": 0.1, "inertia": [5e-3, 1e-2]}
    vehicle = DAMPED.replace({"arm.disks": [plate]})
    model = Elementwise(vehicle)
    tau, wrench = np.arange(8.0), np.arange(6.0)
    for q, qd in random_states(DAMPED.arm.length, 10):
        found = model.accelerations(q, qd, tau, wrench)
        exact = equations.forward_dynamics(vehicle, q, qd, tau, wrench, mask="diagonal")
        np.testing.assert_allclose(found, exact, rtol=1e-7)


def test_element_by_element_a_force_only_pushes_the_uav() -> None:
    """Beside a free fall the tip is shifted, by a mass under 100 N, and neither turned nor bent."""
    times, model = np.linspace(0.0, 0.1, 3), Elementwise(VEHICLE)
    pushed, fallen = (model.tip_path(open_loop_test(test), times) for test in "AB")
    way = np.outer(0.5 * 100.0 / VEHICLE.mass * times**2, [1.0, 0.0, 0.0])
    # The tolerance of the integration, 3e-4 of the way at each step.
    np.testing.assert_allclose(pushed - fallen, way, rtol=0, atol=1e-3)


def flown(block_error: float, monkeypatch: pytest.MonkeyPatch, element_error: float) -> Judgement:
    """III-C.5 with flights that are off by given errors [m]."""
    coupled = xr.DataArray(
        np.zeros((1, 21, 3)),
        dims=("model", "time", "axis"),
        coords={"model": ["coupled"], "time": np.linspace(0.0, 1.0, 21)},
    )
    results = {"tests": {test: {"decoupled": {"rmse_t_m": block_error}} for test in "ABCD"}}
    datasets = {test: xr.Dataset({"tip_position": coupled}) for test in "ABCD"}

    def off(self: Elementwise, scenario: Any, times: Any) -> Any:
        return np.tile([element_error, 0.0, 0.0], (len(times), 1))

    monkeypatch.setattr(Elementwise, "tip_path", off)
    open_loop = SimpleNamespace(results=results, datasets=datasets)
    evidence: Any = SimpleNamespace(vehicle=VEHICLE, open_loop=open_loop)
    return dynamics.JUDGES["III-C.5"](evidence)


@pytest.mark.parametrize(
    ("element", "verdict"), [(0.105, REPRODUCED), (0.12, NOT_REPRODUCED), (0.08, NOT_REPRODUCED)]
)
def test_readings_agree_if_their_errors_do(
    monkeypatch: pytest.MonkeyPatch, element: float, verdict: str
) -> None:
    assert flown(0.1, monkeypatch, element).verdict == verdict


def test_a_jacobian_in_axes_of_the_tip_is_known_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    right = equations.jacobian

    def turned(vehicle: Vehicle, q: Any, s: Any, frame: str) -> Any:
        axes = equations.rotation(q) @ equations.section_rotation(vehicle, q, s, frame)
        return np.kron(np.eye(2), axes.T) @ right(vehicle, q, s, frame)

    monkeypatch.setattr(equations, "jacobian", turned)
    assert judged("III-C.6").verdict == REPRODUCED


def test_an_expression_that_is_off_by_two_percent_is_no_element(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = equations.appendix_b
    monkeypatch.setattr(equations, "appendix_b", lambda *at: (1.02 * right(*at)[0], right(*at)[1]))
    assert judged("III-C.7").verdict == NOT_REPRODUCED


def test_what_is_linear_stays_on_its_chords() -> None:
    found = coupling_elements.distances_from_chords(
        lambda q: np.array([q[3:].sum(), q[6] ** 2]), 1.0
    )
    assert found[:, 0].max() < 1e-12
    assert found[3, 1] > 0.01 and found[[0, 1, 2, 4], 1].max() == 0.0


def test_at_a_length_of_one_metre_curvature_and_angle_are_one_reading() -> None:
    for q, _ in random_states(VEHICLE.arm.length, 3):
        curvature, angle = (
            coupling_elements.printed_elements(DAMPED, q, κ, "integrated")
            for κ in ("a curvature", "the total angle")
        )
        np.testing.assert_allclose(curvature, angle, rtol=1e-14)


def test_appendix_b_for_a_curvature_is_the_integrand_of_the_element(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With κ l inserted for κ, and M17 for the curvature, both sentences hold."""
    right = equations.appendix_b

    def corrected(vehicle: Vehicle, q: Any, s: float) -> Any:
        bent = q.copy()
        bent[6] = q[6] * vehicle.arm.length
        M17, M18 = right(vehicle, bent, s)
        return M17 * vehicle.arm.length, M18

    monkeypatch.setattr(equations, "appendix_b", corrected)
    assert judged("App-B.1").verdict == REPRODUCED
    assert judged("App-B.2").verdict == REPRODUCED


def test_elements_that_go_with_another_power_of_the_radius_are_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = coupling_elements.uav_arm_block
    monkeypatch.setattr(
        coupling_elements, "uav_arm_block", lambda v, q: v.arm.radius**0.01 * right(v, q)
    )
    assert judged("III-C.8").verdict == NOT_REPRODUCED


@pytest.mark.parametrize(
    ("extra", "broken"),
    [
        (lambda κ, s: (0.01 * s, 0.0), "III-C.10"),
        (lambda κ, s: (0.01 / κ, 0.0), "III-C.11"),
        (lambda κ, s: (0.0, 0.01), "III-C.12"),
        (lambda κ, s: (0.0, 0.01), "III-C.13"),
    ],
)
def test_a_term_of_lower_order_is_seen(
    monkeypatch: pytest.MonkeyPatch, extra: Any, broken: str
) -> None:
    right = equations.appendix_b

    def more(vehicle: Vehicle, q: Any, s: Any) -> Any:
        return np.add(right(vehicle, q, s), extra(q[6], s))

    monkeypatch.setattr(equations, "appendix_b", more)
    assert judged(broken).verdict == NOT_REPRODUCED


def test_elements_that_all_depend_alike_on_curvature_are_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(equations, "mass_matrix", lambda v, q: np.ones((8, 8)) * (1.0 + q[6]))
    assert judged("III-C.14").verdict == NOT_REPRODUCED


def test_disks_are_spread_to_the_tip_and_weigh_what_the_published_arm_leaves_them() -> None:
    full = disks.with_disks(VEHICLE)
    positions = [disk.position for disk in full.arm.disks]
    np.testing.assert_allclose(positions, np.linspace(0.1, 1.0, 10), rtol=1e-12)
    backbone = 7850.0 * np.pi * 0.000675**2 * 0.7144
    assert 7 * disks.MASS + backbone == pytest.approx(0.034)
    assert full.arm.mass - VEHICLE.arm.mass == pytest.approx(10 * disks.MASS)


@pytest.mark.long
def test_a_vehicle_keeps_its_own_disks_beside_the_published_ones() -> None:
    own = VEHICLE.replace({"arm.disks": [{"position": 0.5, "mass": 0.2, "inertia": (1e-5, 2e-5)}]})
    full = disks.with_disks(own)
    assert full.arm.mass - VEHICLE.arm.mass == pytest.approx(0.2 + 10 * disks.MASS)
    bare = disks.errors_of_tests(own)
    assert bare != disks.errors_of_tests(VEHICLE)
    told = dynamics.effect_of_disks(Evidence(own)).evidence
    assert f"error: {''.join(sorted('ABCD', key=bare.__getitem__))}, then" in told


def test_energies_are_those_of_the_flight() -> None:
    """Kinetic energy and the change of potential energy, as the kernels log them."""
    full = disks.with_disks(VEHICLE)
    flight = ca.simulate(full, open_loop_test("D"), sample=0.1)
    kinetic, potential = disks._energies(full, *disks._motion(full, flight))
    logged = flight["gravity_energy"] + flight["elastic_energy"]
    np.testing.assert_allclose(kinetic, flight["kinetic_energy"], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(potential, logged - logged[0], rtol=1e-10, atol=1e-10)


def test_in_free_fall_disks_have_their_share_of_the_mass() -> None:
    of_arm, of_all = disks.shares_of_energy(VEHICLE, "B")
    mass = 10 * disks.MASS
    # The bend swings a little, and its potential energy is elastic too.
    assert of_arm.kinetic == pytest.approx(mass / (VEHICLE.arm.mass + mass), rel=0.02)
    assert of_all.potential == pytest.approx(mass / (VEHICLE.mass + mass), rel=0.02)


@pytest.mark.long
def test_disks_without_weight_are_negligible(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disks, "MASS", 1e-5)
    assert judged("III-C.15").verdict == REPRODUCED


@pytest.mark.long
def test_a_denser_arm_only_amplifies_the_coupling(monkeypatch: pytest.MonkeyPatch) -> None:
    def denser(vehicle: Vehicle) -> Vehicle:
        return vehicle.replace({"arm.density": 1.01 * vehicle.arm.density})

    monkeypatch.setattr(dynamics, "with_disks", denser)
    found = judged("III-C.16")
    assert found.verdict == REPRODUCED
    assert found.numbers["smallest_factor"] == pytest.approx(1.01)


def test_disks_near_the_tip_of_a_closed_arm_work_against_the_backbone() -> None:
    """Where κ s passes 2.3 a larger bend draws a point back: ∂r/∂κ turns over."""
    least, _, _, bends = dynamics.factors_of_disks(VEHICLE)
    assert (least[bends < 1.0] > 1.0).all()
    assert least[bends > 2.3].min() < 1.0


def test_a_test_that_ended_early_has_no_place_in_the_order_of_errors() -> None:
    """NaN would stay wherever it stood when the rest is sorted."""
    errors = [dict(zip("ABCD", (0.1, 0.2, np.nan, 0.05), strict=True)),
              dict(zip("ABCD", (0.1, 0.2, 0.3, 0.05), strict=True))]  # fmt: skip
    told = dynamics.order_by_error(*errors)
    assert told.verdict == UNDECIDED and "Test C" in told.evidence
    assert dynamics.order_by_error(errors[1], errors[1]).verdict == REPRODUCED
    swapped = errors[1] | {"A": 0.2, "B": 0.1}
    assert dynamics.order_by_error(errors[1], swapped).verdict == NOT_REPRODUCED
