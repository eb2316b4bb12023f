"""Any number of arms and sections: kinematics, structure of M, C and G, and the paper's case."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations as eq
from tests.equations.samples import FURNISHED, slope, vector_of
from tests.equations.samples import states as states_of_one
from tests.equations.trees import TREES, states
from tests.refusals import refused

EVERY_TREE = pytest.mark.parametrize("vehicle", TREES.values(), ids=TREES)


def places(vehicle: ca.Vehicle) -> list[dict[str, Any]]:
    """Every section, as arguments."""
    return [
        {"arm": arm, "section": section}
        for arm, sections in enumerate(vehicle.shape)
        for section in range(sections)
    ]


def tips(vehicle: ca.Vehicle, q: np.ndarray) -> np.ndarray:
    """J of all tips, one below the other."""
    arms = range(len(vehicle.arms))
    return np.vstack([eq.jacobian(vehicle, q, **eq.tip_of(vehicle, arm)) for arm in arms])


@EVERY_TREE
@pytest.mark.parametrize("frame", ["untwisted", "frenet"])
def test_jacobians_are_slopes_of_positions_and_spins_of_frames(
    vehicle: ca.Vehicle, frame: Any
) -> None:
    def axes(q: np.ndarray, where: dict[str, Any]) -> Any:
        return eq.rotation(q) @ eq.section_rotation(vehicle, q, 0.1, frame, **where)

    for q, _ in states(vehicle, 3, seed=71):
        for where in places(vehicle):
            J = eq.jacobian(vehicle, q, 0.1, frame, **where)
            linear = slope(lambda x, at=where: eq.position(vehicle, x, 0.1, **at), q)  # type: ignore[misc]
            rate = slope(lambda x, at=where: axes(x, at), q)  # type: ignore[misc]
            spin = vector_of(np.einsum("ijk,lj->ilk", rate, axes(q, where)))
            # 1/κ² at |κ| >= 0.05 leaves some hundreds of roundings.
            np.testing.assert_allclose(J, np.vstack([linear, spin]), rtol=0, atol=1e-13)


@EVERY_TREE
def test_a_section_begins_where_the_one_before_ends_along_its_tangent(vehicle: ca.Vehicle) -> None:
    q, _ = states(vehicle, 1, seed=72)[0]
    for where in places(vehicle):
        chain = vehicle.arms[where["arm"]]
        begin = eq.position(vehicle, q, 0.0, **where)
        frame = eq.section_rotation(vehicle, q, 0.0, **where)
        if where["section"] == 0:
            expected = q[:3] + eq.rotation(q) @ chain.mount
            np.testing.assert_allclose(begin, expected, rtol=0, atol=1e-14)
            continue
        before = where | {"section": where["section"] - 1}
        end = chain.section[before["section"]].length
        expected = eq.position(vehicle, q, end, **before)
        np.testing.assert_allclose(begin, expected, rtol=0, atol=1e-14)
        expected = eq.section_rotation(vehicle, q, end, **before)
        np.testing.assert_allclose(frame, expected, rtol=0, atol=1e-14)


@EVERY_TREE
def test_mass_matrix_is_symmetric_and_positive_definite(vehicle: ca.Vehicle) -> None:
    for q, _ in states(vehicle, 10, seed=73):
        M = eq.mass_matrix(vehicle, q)
        np.testing.assert_allclose(M, M.T, rtol=0, atol=2e-15 * np.abs(M).max())
        assert np.linalg.eigvalsh(M)[0] > 0


@EVERY_TREE
def test_coriolis_forces_are_lagranges_and_mass_rate_less_twice_coriolis_is_skew(
    vehicle: ca.Vehicle,
) -> None:
    """C q̇ = Ṁ q̇ - ∂T/∂q; skewness alone would pass for any skew part."""
    for q, qd in states(vehicle, 2, seed=74):
        dM = slope(lambda x: eq.mass_matrix(vehicle, x), q)
        C = eq.coriolis_matrix(vehicle, q, qd)
        scale = np.abs(dM).max()
        expected = dM @ qd @ qd - 0.5 * np.einsum("ijk,i,j->k", dM, qd, qd)
        np.testing.assert_allclose(C @ qd, expected, rtol=0, atol=1e-13 * scale)
        S = dM @ qd - 2 * C
        np.testing.assert_allclose(S, -S.T, rtol=0, atol=1e-14 * scale)


@EVERY_TREE
def test_gravity_vector_is_the_slope_of_potential_energy(vehicle: ca.Vehicle) -> None:
    for q, _ in states(vehicle, 2, seed=75):
        expected = slope(lambda x: eq.potential_energy(vehicle, x), q)
        found = eq.gravity_vector(vehicle, q)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@EVERY_TREE
@pytest.mark.parametrize("mask", eq.MASKS)
def test_energy_changes_by_the_power_of_inputs_less_dissipation(
    vehicle: ca.Vehicle, mask: str
) -> None:
    """With masked M and T_d its energy."""
    rng = np.random.default_rng(76)
    for q, qd in states(vehicle, 3, seed=76):
        kept = eq.masks(len(q))[mask]
        tau, wrenches = rng.normal(0, 3, len(q)), rng.normal(0, 3, 6 * len(vehicle.arms))
        qdd = eq.forward_dynamics(vehicle, q, qd, tau, wrenches, mask=mask)
        M = kept * eq.mass_matrix(vehicle, q)
        M_rate = kept * (eq.mass_matrix(vehicle, q + 1e-30j * qd).imag / 1e-30)
        U_rate = eq.potential_energy(vehicle, q + 1e-30j * qd).imag / 1e-30
        lost = 0.0
        for where in places(vehicle):
            (κ, _), (κ_rate, ψ_rate) = (x[eq.columns_of(vehicle, **where)] for x in (q, qd))
            section = vehicle.arms[where["arm"]].section[where["section"]]
            d = section.structural_damping * section.length
            lost += d * (κ_rate**2 + (κ * ψ_rate) ** 2)
        gained = [qd @ M @ qdd, 0.5 * qd @ M_rate @ qd, U_rate]
        put_in = [qd @ tau, wrenches @ tips(vehicle, q) @ qd, -lost]
        scale = np.abs(gained + put_in).max()
        assert lost > 0
        assert abs(sum(gained) - sum(put_in)) < 1e-12 * scale


def test_an_arm_of_a_list_with_one_level_section_is_the_papers_arm() -> None:
    """To the last bit: both are the same functions."""
    arm = dict(FURNISHED.arm) | {"name": ""}
    given = {name: value for name, value in arm.items() if not name.startswith("given_")}
    for name in ("radius", "density", "youngs_modulus"):
        given[name] = getattr(FURNISHED.arm, name)
    listed = ca.Vehicle(
        name="listed",
        uav=FURNISHED.uav.having(mount=(0.0, 0.0, 0.0)),
        arm=[{"mount": FURNISHED.uav.mount, "section": [given]}],
    )
    for q, qd in states_of_one(3, seed=77):
        wrench = np.arange(6.0)
        for mask in eq.MASKS:
            found, expected = (
                eq.forward_dynamics(each, q, qd, qd, wrench, mask=mask)
                for each in (listed, FURNISHED)
            )
            np.testing.assert_array_equal(found, expected)


def in_halves(vehicle: ca.Vehicle) -> ca.Vehicle:
    """The paper's arm as an arm of two sections, cut in the middle."""
    arm = vehicle.arm
    half, parts = arm.length / 2, []
    for first in (0.0, half):
        disks = [
            disk.having(position=disk.position - first)
            for disk in arm.disks
            if first < disk.position <= first + half
        ]
        part = {"length": half, "radius": arm.radius, "density": arm.density, "disks": disks}
        part |= {"youngs_modulus": arm.youngs_modulus, "damping": arm.damping}
        parts.append(part | {"kappa_s": arm.kappa_s})
    uav = vehicle.uav.having(mount=(0.0, 0.0, 0.0))
    arms = [{"mount": vehicle.uav.mount, "section": parts}]
    return ca.Vehicle(name="halves", uav=uav, arm=arms)


def test_the_papers_section_is_two_halves_that_bend_alike() -> None:
    """M, C q̇, G and damping of the halves, added up, are those of the paper's eight coordinates."""
    disks = [{"position": 0.3, "mass": 0.08, "inertia": [2e-5, 3e-5]}, *FURNISHED.arm.disks]
    whole = FURNISHED.replace({"arm.disks": disks})
    halves = in_halves(whole)
    assert [len(part.disks) for part in halves.arms[0].section] == [1, 2]
    alike = np.vstack([np.eye(8), np.eye(8)[6:]])
    for q, qd in states_of_one(5, seed=78):
        both, both_rate = alike @ q, alike @ qd
        pairs = [
            (alike.T @ eq.mass_matrix(halves, both) @ alike, eq.mass_matrix(whole, q)),
            (
                alike.T @ eq.coriolis_matrix(halves, both, both_rate) @ both_rate,
                eq.coriolis_matrix(whole, q, qd) @ qd,
            ),
            (alike.T @ eq.gravity_vector(halves, both), eq.gravity_vector(whole, q)),
            (
                alike.T @ eq.damping_vector(halves, both, both_rate),
                eq.damping_vector(whole, q, qd),
            ),
        ]
        for found, expected in pairs:
            # Polar roundings 1/κ² at |κ| >= 0.2; the integrals themselves agree to rounding.
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_arms_see_each_other_through_the_uav_and_not_at_all_in_the_decoupled_model() -> None:
    """Another bend, bend rate and force of one arm, in the same motion of the UAV."""
    vehicle = TREES["1+1"]
    q, qd = states(vehicle, 1, seed=79)[0]
    of_left, of_right = (eq.columns_of(vehicle, arm) for arm in (0, 1))
    for mask, seen in (("coupled", True), ("block", False)):
        here = eq.forward_dynamics(vehicle, q, qd, mask=mask)
        for changed in range(3):
            at, rate, tau = q.copy(), qd.copy(), np.zeros(10)
            (at, rate, tau)[changed][of_left] += 0.5
            there = eq.forward_dynamics(vehicle, at, rate, tau, mask=mask)
            shares = np.abs(there - here) / np.abs(here)
            assert shares[of_left].min() > 1e-6
            assert (shares[of_right].min() > 1e-6) == seen
            assert seen or shares[of_right].max() < 1e-13


def test_the_camera_looks_from_the_tip_of_its_arm() -> None:
    """J_c is the rate of the camera's pose, on the second of two arms."""
    vehicle = TREES["2+1"].replace({"camera.arm": "1", "camera.position": [0.01, 0.02, 0.03]})
    q, _ = states(vehicle, 1, seed=80)[0]
    at, axes = eq.camera_pose(vehicle, q)
    linear = slope(lambda x: eq.camera_pose(vehicle, x)[0], q)
    rate = slope(lambda x: eq.camera_pose(vehicle, x)[1], q)
    spin = vector_of(np.einsum("ijk,lj->ilk", rate, axes))
    expected = np.vstack([axes.T @ linear, axes.T @ spin])
    np.testing.assert_allclose(eq.camera_jacobian(vehicle, q), expected, rtol=0, atol=1e-13)
    reach = eq.position(vehicle, q, **eq.tip_of(vehicle, 1))
    assert np.linalg.norm(at - reach) == pytest.approx(np.linalg.norm([0.01, 0.02, 0.03]))


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"arm": 2}, "arm"),
        ({"arm": 1, "section": 1}, "section"),
        ({"section": -1}, "section"),
    ],
)
def test_a_section_that_is_not_there_is_named(where: dict[str, Any], message: str) -> None:
    with refused(message):
        eq.jacobian(TREES["2+1"], np.ones(12), 0.1, **where)
