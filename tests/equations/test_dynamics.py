"""The readable form's dynamics: its structure, its energies, its limits."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import continuair as ca
from continuair import equations as eq
from tests.equations.samples import FURNISHED, PLAIN, THICK, VEHICLES, slope, states, vector_of
from tests.refusals import refused

EVERY_VEHICLE = pytest.mark.parametrize("vehicle", VEHICLES.values(), ids=VEHICLES)


def kinetic_energy_of_moving_masses(vehicle: ca.Vehicle, q: np.ndarray, qd: np.ndarray) -> float:
    """T from the motion of every mass, without Jacobians: complex steps along the motion."""
    along = q + 1e-30j * qd

    def spin(frames: Any) -> np.ndarray:
        """In the axes of the frames themselves."""
        skew = np.swapaxes(frames(q), -1, -2) @ frames(along).imag / 1e-30
        return np.moveaxis(vector_of(np.moveaxis(skew, (-2, -1), (0, 1))), 0, -1)

    x, weight = np.polynomial.legendre.leggauss(40)
    arm, disks = vehicle.arm, vehicle.arm.disks
    ds = 0.5 * arm.length * weight
    s = np.append(0.5 * arm.length * (1 + x), [d.position for d in disks])
    mass = np.append(arm.mass_per_length * ds, [d.mass for d in disks])
    rod = np.outer(ds, arm.transverse_inertia_per_length * np.array([1.0, 1.0, 2.0]))
    inertia = np.vstack([rod, *([d.inertia[0], d.inertia[0], d.inertia[1]] for d in disks)])
    v = eq.position(vehicle, along, s).imag / 1e-30
    w = spin(lambda x: eq.rotation(x) @ eq.section_rotation(vehicle, x, s))
    of_arm = 0.5 * mass @ (v**2).sum(1) + 0.5 * (inertia * w**2).sum()
    w_uav = spin(eq.rotation)
    of_uav = vehicle.uav.mass * qd[:3] @ qd[:3] + w_uav @ np.array(vehicle.uav.inertia) @ w_uav
    return float(of_arm + 0.5 * of_uav)


@EVERY_VEHICLE
def test_mass_matrix_is_the_hessian_of_the_kinetic_energy(vehicle: ca.Vehicle) -> None:
    for q, qd in states(2, seed=21):
        e = np.eye(8)
        single = [kinetic_energy_of_moving_masses(vehicle, q, e[i]) for i in range(8)]
        hessian = [
            [
                kinetic_energy_of_moving_masses(vehicle, q, e[i] + e[j]) - single[i] - single[j]
                for j in range(8)
            ]
            for i in range(8)
        ]
        M = eq.mass_matrix(vehicle, q, nodes=40)
        np.testing.assert_allclose(M, hessian, rtol=0, atol=2e-14 * np.abs(M).max())
        energy = kinetic_energy_of_moving_masses(vehicle, q, qd)
        assert eq.kinetic_energy(vehicle, q, qd) == pytest.approx(energy, rel=2e-14, abs=0)


@EVERY_VEHICLE
def test_mass_matrix_is_symmetric_and_positive_definite(vehicle: ca.Vehicle) -> None:
    for q, _ in states(20, seed=22):
        M = eq.mass_matrix(vehicle, q)
        np.testing.assert_allclose(M, M.T, rtol=0, atol=1e-15 * np.abs(M).max())
        assert np.linalg.eigvalsh(M)[0] > 0


@EVERY_VEHICLE
def test_mass_rate_less_twice_coriolis_is_skew(vehicle: ca.Vehicle) -> None:
    for q, qd in states(3, seed=23):
        rate = slope(lambda x: eq.mass_matrix(vehicle, x), q) @ qd
        S = rate - 2 * eq.coriolis_matrix(vehicle, q, qd)
        np.testing.assert_allclose(S, -S.T, rtol=0, atol=1e-14 * max(1.0, np.abs(S).max()))


@EVERY_VEHICLE
def test_coriolis_forces_are_what_lagrange_leaves_of_the_kinetic_energy(
    vehicle: ca.Vehicle,
) -> None:
    """C q̇ = Ṁ q̇ - ∂T/∂q; the test of skewness would pass for any skew part."""
    for q, qd in states(3, seed=24):
        dM = slope(lambda x: eq.mass_matrix(vehicle, x), q)
        expected = dM @ qd @ qd - 0.5 * np.einsum("ijk,i,j->k", dM, qd, qd)
        found = eq.coriolis_matrix(vehicle, q, qd) @ qd
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(dM).max())


@EVERY_VEHICLE
def test_gravity_vector_is_the_slope_of_potential_energy(vehicle: ca.Vehicle) -> None:
    for q, _ in states(3, seed=25):
        for gravity in (0.0, 9.81):
            expected = slope(
                lambda x, g=gravity: eq.potential_energy(vehicle, x, g),  # type: ignore[misc]
                q,
            )
            found = eq.gravity_vector(vehicle, q, gravity)
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * np.abs(expected).max())
        parts = eq.weight_vector(vehicle, q) + eq.elastic_vector(vehicle, q)
        np.testing.assert_array_equal(found, parts)


def test_potential_energy_is_weight_times_height_and_half_stiffness_times_bend_squared() -> None:
    vehicle = THICK
    q = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1e-5, 0.0])
    arm, mount = vehicle.arm, vehicle.uav.mount[2]
    moments = vehicle.uav.mass * 5.0 + arm.backbone_mass * (5.0 + mount - arm.length / 2)
    moments += sum(d.mass * (5.0 + mount - d.position) for d in arm.disks)
    assert eq.potential_energy(vehicle, q) == pytest.approx(9.81 * moments, rel=2e-10)
    q[6] = 2.0
    elastic = eq.potential_energy(vehicle, q, gravity=0.0)
    assert elastic == pytest.approx(
        0.5 * arm.bending_stiffness * arm.length * 4.0, rel=1e-14, abs=0
    )


@EVERY_VEHICLE
@pytest.mark.parametrize("mask", eq.MASKS)
def test_energy_changes_by_the_power_of_inputs_less_dissipation(
    vehicle: ca.Vehicle, mask: str
) -> None:
    """With masked M and T_d its energy: a mask on M and C keeps Ṁ - 2C skew."""
    rng = np.random.default_rng(26)
    kept = eq.MASKS[mask]
    for q, qd in states(10, seed=26):
        tau, wrench = rng.normal(0, 5, 8), rng.normal(0, 5, 6)
        qdd = eq.forward_dynamics(vehicle, q, qd, tau, wrench, mask=mask)
        M = kept * eq.mass_matrix(vehicle, q)
        M_rate = kept * (eq.mass_matrix(vehicle, q + 1e-30j * qd).imag / 1e-30)
        U_rate = eq.potential_energy(vehicle, q + 1e-30j * qd).imag / 1e-30
        tip_speed = eq.jacobian(vehicle, q, vehicle.arm.length) @ qd
        k_speed_squared = qd[6] ** 2 + (q[6] * qd[7]) ** 2
        lost = vehicle.arm.structural_damping * vehicle.arm.length * k_speed_squared
        gained = [qd @ M @ qdd, 0.5 * qd @ M_rate @ qd, U_rate]
        put_in = [qd @ tau, tip_speed @ wrench, -lost]
        # The largest power of all; reached: 5e-14 of it, with cond(M) some 1e4.
        scale = np.abs(gained + put_in).max()
        assert abs(sum(gained) - sum(put_in)) < 1e-12 * scale


@pytest.mark.long
@pytest.mark.parametrize("mask", ["coupled", "block"])
def test_free_motion_in_polar_coordinates_keeps_its_energy(mask: str) -> None:
    """A soft arm, so that 0.3 s neither meet κ = 0 nor take long."""
    vehicle = FURNISHED.replace({"arm.damping": 0.0, "arm.youngs_modulus": 2e9})
    q = np.array([0, 0, 5, 0.1, -0.2, 0.3, 1.5, 0.4])
    qd = np.array([0.5, -0.3, 0.2, 0.4, -0.3, 0.5, 0.3, 2.0])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        return np.append(y[8:], eq.forward_dynamics(vehicle, y[:8], y[8:], mask=mask))

    def energy(y: np.ndarray) -> float:
        kinetic = eq.kinetic_energy(vehicle, y[:8], y[8:], mask)
        return float(kinetic + eq.potential_energy(vehicle, y[:8]))

    flight = solve_ivp(rates, (0, 0.3), np.append(q, qd), "DOP853", rtol=1e-10, atol=1e-10)
    end = flight.y[:, -1]
    assert flight.success and np.abs(flight.y[6]).min() > 0.1
    exchanged = abs(eq.potential_energy(vehicle, end[:8]) - eq.potential_energy(vehicle, q))
    assert exchanged > 1.0  # [J]; else nothing was tested
    # The integrator's tolerance.
    assert abs(energy(end) - energy(np.append(q, qd))) < 5e-10 * exchanged


@EVERY_VEHICLE
def test_bend_inertia_of_the_straight_arm(vehicle: ca.Vehicle) -> None:
    arm = vehicle.arm
    μ, ρI = arm.mass_per_length, arm.density * np.pi * arm.radius**4 / 4
    expected = μ * arm.length**5 / 20 + ρI * arm.length**3 / 3
    for d in arm.disks:
        expected += d.mass * d.position**4 / 4 + d.inertia[0] * d.position**2
    κ = 1e-3
    M = eq.mass_matrix(vehicle, np.array([0, 0, 0, 0.1, 0.2, 0.3, κ, 0.4]))
    # The bend enters by its square, 1e-6; cancellation leaves 1e-9 at κ = 1e-3.
    assert M[6, 6] == pytest.approx(expected, rel=1e-6)
    assert M[7, 7] == pytest.approx(κ**2 * expected, rel=1e-6, abs=0)
    assert abs(M[6, 7]) < 1e-14 * κ * expected


def test_straight_arm_swings_at_the_clamped_frequency_on_a_heavy_uav() -> None:
    heavy = PLAIN.replace({"uav.mass": 1e9, "uav.inertia": [1e9] * 3})
    arm, q = heavy.arm, np.array([0, 0, 0, 0, 0, 0, 1e-3, 0.4])
    qdd = eq.forward_dynamics(heavy, q, np.zeros(8), gravity=0.0)
    thin = np.sqrt(20 * arm.bending_stiffness / (arm.mass_per_length * arm.length**4))
    # Rotary inertia lowers it by 20/3 (r/2l)²/2, 2e-5.
    assert np.sqrt(-qdd[6] / q[6]) == pytest.approx(thin, rel=1e-4)
    assert np.sqrt(-qdd[6] / q[6]) == pytest.approx(arm.clamped_frequency, rel=1e-6)


@EVERY_VEHICLE
@pytest.mark.parametrize("mask", ["coupled", "block"])
def test_turning_the_world_about_the_vertical_turns_the_motion(
    vehicle: ca.Vehicle, mask: str
) -> None:
    angle = 1.1
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )

    def turned(vector: np.ndarray, yaw: float = 0.0) -> np.ndarray:
        out = vector.copy()
        out[:3] = turn @ vector[:3]
        out[5] += yaw
        return out

    rng = np.random.default_rng(27)
    for q, qd in states(3, seed=27):
        tau, wrench = rng.normal(0, 5, 8), rng.normal(0, 5, 6)
        here = eq.forward_dynamics(vehicle, q, qd, tau, wrench, mask=mask)
        wrench_there = np.concatenate([turn @ wrench[:3], turn @ wrench[3:]])
        there = eq.forward_dynamics(
            vehicle, turned(q, angle), turned(qd), turned(tau), wrench_there, mask=mask
        )
        assert np.linalg.norm(there - turned(here)) < 5e-13 * np.linalg.norm(here)


def test_nodes_converge_spectrally() -> None:
    q, _ = states(1, seed=28)[0]
    q[6] = 2 * np.pi
    best = eq.mass_matrix(PLAIN, q, nodes=40)
    scale = np.abs(best).max()
    errors = [np.abs(eq.mass_matrix(PLAIN, q, nodes=n) - best).max() for n in (6, 8, 10, 12, 24)]
    assert all(b < 0.02 * a for a, b in zip(errors[:3], errors[1:4], strict=True))
    assert errors[3] < 1e-12 * scale and errors[4] < 1e-14 * scale


def test_tip_force_pushes_the_tip_its_way_and_the_papers_sign_the_other() -> None:
    rng = np.random.default_rng(29)
    for q, qd in states(5, seed=29):
        wrench = rng.normal(size=6)
        free = eq.forward_dynamics(FURNISHED, q, qd)
        pushed = eq.forward_dynamics(FURNISHED, q, qd, tip_wrench=wrench) - free
        J = eq.jacobian(FURNISHED, q, FURNISHED.arm.length)
        assert wrench @ J @ pushed > 0
        pulled = eq.forward_dynamics(FURNISHED, q, qd, tip_wrench=wrench, tip_wrench_sign=-1)
        # A difference of accelerations that the elastic one exceeds by 1e4.
        assert np.linalg.norm(pulled - free + pushed) < 2e-11 * np.linalg.norm(pushed)


def test_generalised_inputs_accelerate_what_they_are_conjugate_to() -> None:
    """τ = M q̈ + ..., so a wrench at the tip and J_tᵀ times it do the same."""
    q, qd = states(1, seed=30)[0]
    wrench = np.array([3.0, -2.0, 5.0, 0.4, 0.1, -0.3])
    J = eq.jacobian(FURNISHED, q, FURNISHED.arm.length)
    np.testing.assert_allclose(
        eq.forward_dynamics(FURNISHED, q, qd, tau=J.T @ wrench),
        eq.forward_dynamics(FURNISHED, q, qd, tip_wrench=wrench),
        rtol=1e-13,
    )


def test_damping_acts_against_the_bend_rate_alone() -> None:
    q, qd = states(1, seed=31)[0]
    D = eq.damping_vector(FURNISHED, q, qd)
    np.testing.assert_array_equal(D[:6], 0.0)
    assert D @ qd > 0
    np.testing.assert_array_equal(eq.damping_vector(PLAIN, q, qd), 0.0)


@pytest.mark.parametrize("bend", [0.0, -5e-4])
def test_remark_1_spares_the_spring(bend: float) -> None:
    """At the threshold's bend a straight arm would be pushed, and one bent the other way too."""
    vehicle = ca.load_vehicle("paper")
    q = np.array([0, 0, 0, 0, 0, 0, bend, 0])
    pulled = eq.elastic_vector(vehicle, q)[6]
    assert pulled == vehicle.arm.bending_stiffness * vehicle.arm.length * bend


@pytest.mark.parametrize(
    ("words", "field"),
    [
        ({"mask": "blocks"}, "mask"),
        ({"mask": np.ones(8)}, "mask"),
        ({"q": np.ones(7)}, "q"),
        ({"qd": "fast"}, "qd"),
        ({"tau": np.ones(6)}, "tau"),
        ({"tip_wrench": 1.0}, "tip_wrench"),
    ],
)
def test_a_bad_input_is_named(words: dict[str, Any], field: str) -> None:
    arguments = {"q": np.ones(8), "qd": np.ones(8), **words}
    with refused(field):
        eq.forward_dynamics(PLAIN, **arguments)
