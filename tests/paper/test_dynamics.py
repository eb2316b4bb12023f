"""Judges of III-C and Appendix B: corrected formulas turn their verdicts."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026.open_loop_tests import open_loop_test
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import coupling_elements, disk_effects, disks, dynamics
from amiri2026.paper.judges.agreement import random_states
from amiri2026.table.printed import PrintedModel
from amiri2026.table.reading import Reading
from amiri2026.table.study import ABLATIONS, PRINTED, fly_tests
from amiri2026.verdicts import DEPENDS, FAILS, HOLDS, MISPRINT, UNDECIDED, Judgement
from continuair import equations
from continuair.vehicle.vehicle import Vehicle
from tests.paper import given

VEHICLE = ca.load_vehicle("paper")
DAMPED = VEHICLE.replace({"arm.damping": 0.3, "arm.kappa_s": 0.0, "uav.mount": [0.03, -0.05, 0.04]})

FOUND = {
    "III-C.3": MISPRINT,
    "III-C.7": HOLDS,
    "III-C.8": HOLDS,
    "III-C.10": HOLDS,
    "III-C.11": HOLDS,
    "III-C.12": HOLDS,
    "III-C.13": HOLDS,
    "III-C.14": HOLDS,
    "App-B.1": MISPRINT,
}
FLOWN = {"III-C.5", "III-C.15", "III-C.16"}


def judged(name: str, vehicle: Vehicle = VEHICLE) -> Judgement:
    return dynamics.JUDGES[name](Evidence(vehicle, quick=True))


def test_every_sentence_of_this_section_has_its_judge() -> None:
    assert set(dynamics.JUDGES) == set(FOUND) | FLOWN


@pytest.mark.long
@pytest.mark.parametrize("name", FOUND)
def test_verdict_does_not_hang_on_the_arm(name: str) -> None:
    found = judged(name)
    assert found.verdict == FOUND[name]
    assert bool(found.correction) == (found.verdict == MISPRINT)
    gripper = {"position": 0.7, "mass": 0.1}
    other = DAMPED.replace({"arm.length": 0.7, "arm.radius": 0.003, "arm.disks": [gripper]})
    assert judged(name, other).verdict == FOUND[name]


@pytest.mark.long
def test_the_wrench_on_the_tip_is_that_of_the_other_sign_and_of_inertial_axes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = judged("III-C.3").numbers
    of = "median gap over power of F_e, sign"
    assert found[f"{of} -1, J_t in inertial axes"] == pytest.approx(2.0)
    assert min(found[f"{of} {sign}1, J_t in tip axes"] for sign in "+-") > 1.0
    assert found["largest_gap_over_power_of_F_e_as_corrected"] == 1e-9
    right = equations.forward_dynamics

    def reversed_wrench(*at: Any, tip_wrench_sign: int) -> Any:
        return right(*at, tip_wrench_sign=-tip_wrench_sign)

    monkeypatch.setattr(equations, "forward_dynamics", reversed_wrench)
    assert judged("III-C.3").verdict == HOLDS


@pytest.mark.long
def test_a_balance_without_the_elastic_force_does_not_close(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the text calls G, the gravity matrix alone, would lose energy whatever the sign."""
    right = dynamics.power

    def without(vehicle: Vehicle, q: Any, qd: Any, qdd: Any) -> float:
        return right(vehicle, q, qd, qdd) - float(equations.elastic_vector(vehicle, q) @ qd)

    monkeypatch.setattr(dynamics, "power", without)
    assert judged("III-C.3").numbers["largest_gap_over_power_of_F_e_as_corrected"] > 0.1


def test_element_by_element_every_coordinate_moves_as_with_the_diagonal_mask() -> None:
    # A disk as wide as a plate, whose own inertia counts.
    plate = {"position": 1.0, "mass": 0.1, "inertia": [5e-3, 1e-2]}
    vehicle = DAMPED.replace({"arm.disks": [plate]})
    reading = Reading(remark1=False, damping="bend vector", rotary_inertia=True, force_sign=1)
    model = PrintedModel(vehicle, reading)
    tau, force = np.arange(8.0), np.arange(3.0)
    wrench = np.concatenate([force, np.zeros(3)])
    for q, qd in random_states(DAMPED.arm.length, 10):
        found = model.accelerations(q, qd, tau, force, "element")
        exact = equations.forward_dynamics(vehicle, q, qd, tau, wrench, mask="diagonal")
        np.testing.assert_allclose(found, exact, rtol=1e-7)


def test_element_by_element_a_force_only_pushes_the_uav() -> None:
    """Beside a free fall the tip is shifted, by a mass under 100 N, and neither turned nor bent."""
    flown = fly_tests(VEHICLE, tests="AB")
    (_, pushed), (_, fallen) = (flown.pairs[test] for test in "AB")
    time = np.linspace(0.0, 1.0, len(pushed.position))
    way = np.outer(0.5 * 100.0 / VEHICLE.mass * time**2, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(pushed.position - fallen.position, way, rtol=0, atol=1e-6)
    np.testing.assert_allclose(pushed.untwisted, fallen.untwisted, atol=1e-6)


def meanings(table: Any, errors: dict[str, float]) -> Judgement:
    """III-C.5 with Table I, and errors of the vehicle's tip in every test, by meaning [m]."""

    def printed(vehicle: Vehicle, reading: Reading) -> Any:
        error = {"rmse_t_m": errors[reading.decoupled]}
        return SimpleNamespace(plain=lambda: dict.fromkeys("ABCD", error))

    return dynamics.JUDGES["III-C.5"](given.evidence(table=table, printed=printed))


@pytest.mark.parametrize(
    ("factor", "element", "verdict"),
    [(1.0, 0.105, HOLDS), (1.0, 0.12, DEPENDS), (1.0, 0.08, DEPENDS), (1.3, 0.1, DEPENDS)],
)
def test_a_meaning_counts_if_it_gives_the_table_or_if_errors_are_alike(
    factor: float, element: float, verdict: str
) -> None:
    blocks = next(name for name, of in ABLATIONS.items() if of == {"decoupled": "block"})
    table = given.table(changed={blocks: factor * PRINTED})
    errors = {"element": element, "block": 0.1, "uav blocks": 0.1}
    assert meanings(table, errors).verdict == verdict


def test_a_wrench_in_tip_axes_has_the_power_of_a_jacobian_in_tip_axes() -> None:
    """With J_t in tip axes and F_e = Rᵀ F in them, J_tᵀ F_e is that of F in inertial axes."""
    q, qd = random_states(VEHICLE.arm.length)[0]
    length, wrench = VEHICLE.arm.length, np.arange(1.0, 7.0)
    bare = VEHICLE.replace({"arm.kappa_s": 0.0})
    J = equations.jacobian(bare, q, length)
    tip = equations.rotation(q) @ equations.section_rotation(bare, q, length, "untwisted")
    both = np.kron(np.eye(2), tip)
    np.testing.assert_allclose((both.T @ J).T @ (both.T @ wrench), J.T @ wrench, rtol=1e-12)


@pytest.mark.long
def test_an_expression_that_is_off_by_two_percent_is_no_element(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = equations.appendix_b
    monkeypatch.setattr(equations, "appendix_b", lambda *at: (1.02 * right(*at)[0], right(*at)[1]))
    assert judged("III-C.7").verdict == MISPRINT


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


@pytest.mark.long
def test_appendix_b_for_a_curvature_is_the_integrand_of_the_element(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With κ l inserted for κ, and M17 for the curvature, both expressions are elements."""
    right = equations.appendix_b

    def corrected(vehicle: Vehicle, q: Any, s: float) -> Any:
        bent = q.copy()
        bent[6] = q[6] * vehicle.arm.length
        M17, M18 = right(vehicle, bent, s)
        return M17 * vehicle.arm.length, M18

    monkeypatch.setattr(equations, "appendix_b", corrected)
    assert judged("App-B.1").verdict == HOLDS


@pytest.mark.long
def test_one_wrong_expression_of_appendix_b_is_a_misprint(monkeypatch: pytest.MonkeyPatch) -> None:
    right = coupling_elements.printed_elements

    def half_right(vehicle: Vehicle, q: Any, κ: str, s: str) -> Any:
        return right(vehicle, q, "the total angle", s) * [vehicle.arm.length, 1.5]

    monkeypatch.setattr(coupling_elements, "printed_elements", half_right)
    found = judged("App-B.1")
    assert found.verdict == MISPRINT
    assert found.numbers["median relative difference of M17, integrated"] < 1e-9
    assert found.numbers["median relative difference of M18, integrated"] == pytest.approx(0.5)


def test_elements_that_go_with_another_power_of_the_radius_are_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = coupling_elements.uav_arm_block
    monkeypatch.setattr(
        coupling_elements, "uav_arm_block", lambda v, q: v.arm.radius**0.01 * right(v, q)
    )
    assert judged("III-C.8").verdict == MISPRINT


@pytest.mark.long
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
    assert judged(broken).verdict == MISPRINT


def test_elements_that_all_depend_alike_on_curvature_are_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(equations, "mass_matrix", lambda v, q: np.ones((8, 8)) * (1.0 + q[6]))
    assert judged("III-C.14").verdict == MISPRINT


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
    told = disk_effects.effect_of_disks(Evidence(own)).evidence
    assert f"error is {''.join(sorted('ABCD', key=bare.__getitem__))} without disks" in told


def test_energies_are_those_of_the_flight() -> None:
    """Kinetic energy and the change of potential energy, as the kernels log them."""
    full = disks.with_disks(VEHICLE)
    energies = ["kinetic_energy", "gravity_energy", "elastic_energy"]
    names = ["q", *disks._STATE, *energies]
    flight = ca.simulate(full, open_loop_test("D"), sample=0.1, variables=names)
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
    assert judged("III-C.15").verdict == HOLDS


@pytest.mark.long
def test_a_denser_arm_only_amplifies_the_coupling(monkeypatch: pytest.MonkeyPatch) -> None:
    def denser(vehicle: Vehicle) -> Vehicle:
        return vehicle.replace({"arm.density": 1.01 * vehicle.arm.density})

    monkeypatch.setattr(disk_effects, "with_disks", denser)
    found = judged("III-C.16")
    assert found.verdict == HOLDS
    factors = [value for name, value in found.numbers.items() if "smallest_factor" in name]
    assert len(factors) == 3
    np.testing.assert_allclose(factors, 1.01)


@pytest.mark.long
def test_disks_are_negligible_on_a_thick_backbone_and_not_on_a_thin_one() -> None:
    found = judged("III-C.15")
    assert found.verdict == DEPENDS
    verdicts = {(case.vehicle, case.reading): case.found.verdict for case in found.cases}
    assert verdicts == {
        ("table1", "arm radius 5 mm"): HOLDS,
        ("paper", "arm radius 1 mm"): FAILS,
        ("paper", "arm radius 5 mm"): HOLDS,
        ("paper", "arm radius 10 mm"): HOLDS,
    }


@pytest.mark.long
def test_disks_only_amplify_the_coupling_at_the_bends_of_the_tests() -> None:
    found = judged("III-C.16")
    assert found.verdict == DEPENDS
    assert [case.found.verdict for case in found.cases] == [HOLDS, FAILS, FAILS]


def test_no_arm_is_taken_thicker_than_it_is_long() -> None:
    short = VEHICLE.replace({"arm.length": 0.015})
    assert [each.arm.radius for each in disk_effects.of_radii(short, [0.001, 0.005, 0.010])] == [
        0.001,
        0.005,
    ]


@pytest.mark.long
def test_states_of_the_tests_are_bent_and_resolved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a limp arm."""
    limp = VEHICLE.replace({"arm.radius": 0.001})
    coarse = disks.states_of_tests(limp)
    assert coarse.shape[1] == 8 and len(coarse) <= 84
    assert np.abs(coarse[:, 6]).min() > 1e-6
    monkeypatch.setattr(disks, "RTOL", 1e-9)
    np.testing.assert_allclose(disks.states_of_tests(limp), coarse, rtol=1e-4, atol=1e-4)


def test_disks_near_the_tip_of_a_closed_arm_work_against_the_backbone() -> None:
    """Where κ s passes 2.3 a larger bend draws a point back: ∂r/∂κ turns over."""
    length = VEHICLE.arm.length
    least = {
        abs(q[6]) * length: disk_effects.factors_of_disks(VEHICLE, q).min()
        for q, _ in random_states(length)
    }
    assert min(factor for bend, factor in least.items() if bend < 1.0) > 1.0
    assert min(factor for bend, factor in least.items() if bend > 2.3) < 1.0


def test_a_test_that_ended_early_has_no_place_in_the_order_of_errors() -> None:
    """NaN would stay wherever it stood when the rest is sorted."""
    errors = [dict(zip("ABCD", (0.1, 0.2, np.nan, 0.05), strict=True)),
              dict(zip("ABCD", (0.1, 0.2, 0.3, 0.05), strict=True))]  # fmt: skip
    told = disk_effects.order_by_error(*errors)
    assert told.verdict == UNDECIDED and "Test C" in told.evidence
    assert disk_effects.order_by_error(errors[1], errors[1]).verdict == HOLDS
    swapped = errors[1] | {"A": 0.2, "B": 0.1}
    assert disk_effects.order_by_error(errors[1], swapped).verdict == FAILS
