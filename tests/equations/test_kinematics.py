"""The readable form's kinematics against slopes of positions and frames, and SymPy."""

from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations as eq
from continuair.equations.turns import TipFrame, euler_angles
from tests.equations.samples import FURNISHED, PLAIN, slope, states, vector_of
from tests.refusals import refused

ARC_LENGTHS = np.array([0.0, 0.25, 0.7, 1.0])


def test_linear_jacobian_is_the_slope_of_position() -> None:
    for q, _ in states(10, seed=1):
        expected = slope(lambda x: eq.position(FURNISHED, x, ARC_LENGTHS), q)
        found = eq.jacobian(FURNISHED, q, ARC_LENGTHS)[:, :3]
        # Complex steps are exact; 1/κ² at |κ| >= 0.2 leaves some tens of roundings.
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-14)


@pytest.mark.parametrize("frame", ["untwisted", "frenet"])
def test_angular_jacobian_is_the_spin_of_the_section(frame: TipFrame) -> None:
    for q, _ in states(10, seed=2):
        turned = eq.rotation(q) @ eq.section_rotation(FURNISHED, q, 0.7, frame)
        rate = slope(lambda x: eq.rotation(x) @ eq.section_rotation(FURNISHED, x, 0.7, frame), q)
        spin = np.einsum("ijk,lj->ilk", rate, turned)
        found = eq.jacobian(FURNISHED, q, 0.7, frame)[3:]
        np.testing.assert_allclose(found, vector_of(spin), rtol=0, atol=2e-14)


def test_real_differences_agree_with_the_jacobian_too() -> None:
    """Central differences at 1e-6: what a complex step would miss if a formula lost its i."""
    for q, qd in states(5, seed=3):
        ahead, behind = (eq.position(FURNISHED, q + h * qd, ARC_LENGTHS) for h in (1e-6, -1e-6))
        found = eq.jacobian(FURNISHED, q, ARC_LENGTHS)[:, :3] @ qd
        # Rounding 1e-16/1e-6 and third derivatives times 1e-12.
        np.testing.assert_allclose(found, (ahead - behind) / 2e-6, rtol=0, atol=1e-8)


def test_euler_rate_matrix_is_the_spin_of_the_body_and_its_inverse_is_not() -> None:
    for q, _ in states(5, seed=4):
        spin = np.einsum("ijk,lj->ilk", slope(eq.rotation, q), eq.rotation(q))
        T = eq.euler_rate_matrix(q)
        np.testing.assert_allclose(T, vector_of(spin)[:, 3:6], rtol=0, atol=1e-14)
        assert np.abs(np.linalg.inv(T) - T).max() > 0.1


@pytest.mark.parametrize("frame", ["untwisted", "frenet"])
def test_section_frames_are_rotations_whose_z_axis_is_the_tangent(frame: TipFrame) -> None:
    q, _ = states(1, seed=5)[0]
    frames = eq.section_rotation(FURNISHED, q, ARC_LENGTHS, frame)
    unit = np.einsum("nij,nkj->nik", frames, frames)
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3), (4, 3, 3)), rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, rtol=0, atol=1e-14)
    ahead, behind = (eq.arm_position(FURNISHED, q, ARC_LENGTHS + h) for h in (1e-5, -1e-5))
    # Central differences: third derivatives κ² times 1e-11.
    np.testing.assert_allclose(frames[..., 2], (ahead - behind) / 2e-5, rtol=0, atol=1e-9)


def test_untwisted_frame_does_not_turn_with_the_direction_of_a_vanishing_bend() -> None:
    """The Frenet frame turns by as much as ψa does, at any bend; material must not."""
    straight = PLAIN.replace({"arm.kappa_s": 0.0})
    here, there = np.zeros(8), np.zeros(8)
    here[6] = there[6] = 1e-9
    there[7] = 1.0
    frames: list[tuple[TipFrame, float]] = [("untwisted", 0.0), ("frenet", 1.0)]
    for frame, angle in frames:
        a, b = (eq.section_rotation(straight, q, 1.0, frame) for q in (here, there))
        turned = np.arccos((np.trace(a.T @ b) - 1) / 2)
        assert turned == pytest.approx(angle, abs=1e-7)  # arccos near 1 keeps half the digits


def test_arm_hangs_from_its_mount() -> None:
    q = np.array([1.0, 2.0, 3.0, 0, 0, 0, 1e-6, 0.3])
    mount = np.array(FURNISHED.uav.mount)
    np.testing.assert_allclose(eq.position(FURNISHED, q, 0.0), q[:3] + mount, rtol=0, atol=1e-14)
    expected = q[:3] + mount + [0, 0, -1]
    np.testing.assert_allclose(eq.position(FURNISHED, q, 1.0), expected, rtol=0, atol=1e-6)


def test_arm_bends_towards_psi_a() -> None:
    q = np.array([0, 0, 0, 0, 0, 0, 0.5, np.pi / 2])
    tip = eq.arm_position(PLAIN, q, 1.0)
    assert tip[1] > 0.2
    assert abs(tip[0]) < 1e-15


def printed_appendix_a(s: sp.Symbol, κ: sp.Symbol, ψ: sp.Symbol) -> sp.Matrix:
    sine, cosine = sp.sin(κ * s), sp.cos(κ * s)
    radial = (cosine - 1) / κ**2 + s * sine / κ
    return sp.Matrix(
        [
            [sp.cos(ψ) * radial, sp.sin(ψ) * (cosine - 1) / κ],
            [sp.sin(ψ) * radial, -sp.cos(ψ) * (cosine - 1) / κ],
            [sine / κ**2 - s * cosine / κ, 0],
        ]
    )


def test_appendix_a_is_the_slope_of_the_hanging_arm_and_not_of_the_printed_equation_2() -> None:
    """Eq. (2) prints z = +sin(κs)/κ, and the code hangs the arm."""
    symbols = sp.symbols("s kappa psi")
    exact = sp.lambdify(symbols, printed_appendix_a(*symbols))
    for q, _ in states(10, seed=6):
        appendix = exact(0.8, q[6], q[7])
        found, _ = eq.arm_jacobian(PLAIN, q, 0.8)
        hanging = slope(lambda x: eq.arm_position(PLAIN, x, 0.8), q)[:, 6:]
        # 1/κ² at |κ| >= 0.2 leaves some tens of roundings.
        np.testing.assert_allclose(found, appendix, rtol=0, atol=1e-14)
        np.testing.assert_allclose(hanging, appendix, rtol=0, atol=1e-14)
        assert np.abs(np.diag([1, 1, -1]) @ hanging - appendix).max() > 0.01


def test_frenet_frame_has_the_printed_column_and_the_hanging_arm_the_other_sign() -> None:
    """Eq. (5) prints [-s sin ψa, s cos ψa, 0] and [0, 0, 1]; an arm that points up turns so."""
    q = np.array([0, 0, 0, 0, 0, 0, 1.3, 0.4])
    _, J_oa = eq.arm_jacobian(PLAIN, q, 0.8, "frenet")
    printed = 0.8 * np.array([-np.sin(0.4), np.cos(0.4), 0.0])
    np.testing.assert_array_equal(J_oa[:, 0], -printed)
    np.testing.assert_array_equal(J_oa[:, 1], [0.0, 0.0, 1.0])


def test_arrays_of_arc_lengths_give_what_single_ones_give() -> None:
    q, _ = states(1, seed=7)[0]
    for function in (eq.position, eq.jacobian, eq.section_rotation, eq.arm_position):
        together = function(FURNISHED, q, ARC_LENGTHS)
        alone = [function(FURNISHED, q, s) for s in ARC_LENGTHS]
        np.testing.assert_allclose(together, alone, rtol=0, atol=1e-14)


@pytest.mark.parametrize("bend", [0.0, 4e-4, -1e-3])
def test_remark_1_replaces_a_small_bend_of_either_sign_by_the_threshold(bend: float) -> None:
    vehicle = ca.load_vehicle("paper")
    small, at = (np.array([0, 0, 5, 0.1, 0.2, 0.3, κ, 0.4]) for κ in (bend, vehicle.arm.kappa_s))
    for function in (eq.position, eq.jacobian, eq.section_rotation):
        np.testing.assert_array_equal(function(vehicle, small, 0.7), function(vehicle, at, 0.7))
    np.testing.assert_array_equal(eq.mass_matrix(vehicle, small), eq.mass_matrix(vehicle, at))


def test_remark_1_leaves_the_bend_alone_above_the_threshold_or_without_one() -> None:
    q = np.array([0, 0, 5, 0.1, 0.2, 0.3, -1.1e-3, 0.4])
    above = eq.position(ca.load_vehicle("paper"), q, 0.7)
    np.testing.assert_array_equal(above, eq.position(PLAIN, q, 0.7))


def test_an_unknown_frame_is_named() -> None:
    with refused("tip_frame"):
        eq.jacobian(PLAIN, np.ones(8), 0.5, "twisted")  # type: ignore[arg-type]


@pytest.mark.parametrize("function", [eq.rotation, eq.euler_rate_matrix])
@pytest.mark.parametrize("shape", [(3, 8), (8, 8), (8, 1), (7,), (3,), ()])
def test_what_is_not_one_configuration_has_no_rotation(function: Any, shape: Any) -> None:
    with refused("q"):
        function(np.full(shape, 0.1))


OF_Q: dict[str, Any] = {
    "M": lambda q: eq.mass_matrix(PLAIN, q),
    "C": lambda q: eq.coriolis_matrix(PLAIN, q, np.ones(8)),
    "weight": lambda q: eq.weight_vector(PLAIN, q),
    "elasticity": lambda q: eq.elastic_vector(PLAIN, q),
    "damping": lambda q: eq.damping_vector(PLAIN, q, np.ones(8)),
    "position": lambda q: eq.position(PLAIN, q, 0.5),
    "jacobian": lambda q: eq.jacobian(PLAIN, q, 0.5),
    "section_rotation": lambda q: eq.section_rotation(PLAIN, q, 0.5),
    "potential energy": lambda q: eq.potential_energy(PLAIN, q),
    "camera": lambda q: eq.camera_pose(PLAIN, q),
}


@pytest.mark.parametrize("name", OF_Q)
@pytest.mark.parametrize("given", [np.full(10, 0.1), np.full(6, 0.1), np.full((8, 8), 0.1)])
def test_the_coordinates_of_another_vehicle_are_refused(name: str, given: np.ndarray) -> None:
    with refused("q"):
        OF_Q[name](given)


@pytest.mark.parametrize("name", OF_Q)
@pytest.mark.parametrize("given", [np.ma.array(np.full(8, 0.1), mask=np.eye(8)[3]), [True] * 8])
def test_coordinates_that_are_no_numbers_are_refused(name: str, given: Any) -> None:
    with refused("q"):
        OF_Q[name](given)


@pytest.mark.parametrize("function", [eq.coriolis_matrix, eq.damping_vector])
def test_one_rate_does_not_stand_for_eight(function: Any) -> None:
    with refused("qd"):
        function(PLAIN, np.full(8, 0.1), [1.0])


@pytest.mark.parametrize("pitch", [-np.pi / 2, -0.7, 0.0, 1.5707, np.pi / 2 - 1e-9, np.pi / 2])
def test_euler_angles_make_the_rotation_again_upright_too(pitch: float) -> None:
    rng = np.random.default_rng(5)
    roll, yaw = rng.uniform(-np.pi, np.pi, (2, 200))
    given = Rotation.from_euler("ZYX", np.column_stack([yaw, np.full(200, pitch), roll]))
    found = euler_angles(given.as_matrix())
    again = Rotation.from_euler("ZYX", found[:, ::-1])
    assert (given.inv() * again).magnitude().max() < 1e-14
    assert np.abs(found[:, 1] - pitch).max() < 3e-8
