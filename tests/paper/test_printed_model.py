"""The paper's model as printed, beside an independent Lagrangian, its compiled form, `simulate`."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026 import open_loop_test
from amiri2026.paper.judges.agreement import random_states
from amiri2026.table.compiled import Job, fly
from amiri2026.table.metrics import error
from amiri2026.table.printed import CURLED, FLOWN, SINGULAR, Flight, PrintedModel
from amiri2026.table.reading import Reading
from continuair.typing import Model
from continuair.vehicle.vehicle import Vehicle, load_vehicle

Array = np.ndarray

LIKE_SIMULATE = Reading(
    decoupled="block", remark1=False, damping="bend vector", rotary_inertia=True
)
"""The reading that the product's own decoupled model has."""


def bent_states(vehicle: Vehicle, count: int = 100) -> list[tuple[Array, Array]]:
    """Random (q, q̇) with |κ| > 0.02 1/m."""
    return [(q, qd) for q, qd in random_states(vehicle.arm.length, count) if abs(q[6]) > 0.02]


@cache
def lagrangian(mass: float, inertia: tuple[float, ...], length: float, per_length: float) -> Any:
    """M, C and G (gravity alone) as a CasADi function of (q, q̇), from ½ Σ m |v|² and Σ m g z.

    The arm is an arc in a plane turned by ψa; nothing here is shared with the package.
    """
    casadi = pytest.importorskip("casadi")
    q, qd = casadi.SX.sym("q", 8), casadi.SX.sym("qd", 8)

    def about(axis: int, angle: Any) -> Any:
        c, s = casadi.cos(angle), casadi.sin(angle)
        rows = {
            0: [[1, 0, 0], [0, c, -s], [0, s, c]],
            1: [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            2: [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[axis]
        return casadi.vertcat(*[casadi.horzcat(*row) for row in rows])

    R = about(2, q[5]) @ about(1, q[4]) @ about(0, q[3])
    spin = sum(casadi.jacobian(casadi.vec(R), q)[:, k] * qd[k] for k in range(8))
    wx = R.T @ casadi.reshape(spin, 3, 3)
    w = casadi.vertcat(wx[2, 1], wx[0, 2], wx[1, 0])
    kinetic = 0.5 * mass * casadi.dot(qd[:3], qd[:3])
    kinetic += 0.5 * w.T @ casadi.SX(np.diag(inertia)) @ w
    potential = mass * 9.81 * q[2]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    for x, weight in zip(nodes, weights, strict=True):
        s, dm = 0.5 * length * (1 + x), 0.5 * length * weight * per_length
        in_plane = casadi.vertcat(
            (1 - casadi.cos(q[6] * s)) / q[6], 0, -casadi.sin(q[6] * s) / q[6]
        )
        point = q[:3] + R @ about(2, q[7]) @ in_plane
        velocity = casadi.jacobian(point, q) @ qd
        kinetic += 0.5 * dm * casadi.dot(velocity, velocity)
        potential += dm * 9.81 * point[2]
    M = casadi.hessian(kinetic, qd)[0]
    slopes = [casadi.reshape(casadi.jacobian(casadi.vec(M), q[k]), 8, 8) for k in range(8)]
    C = casadi.SX(8, 8)
    for i in range(8):
        for j in range(8):
            C[i, j] = 0.5 * sum(
                (slopes[k][i, j] + slopes[j][i, k] - slopes[i][j, k]) * qd[k] for k in range(8)
            )
    return casadi.Function("lagrangian", [q, qd], [M, C, casadi.gradient(potential, q)])


def test_mass_coriolis_and_gravity_are_those_of_an_independent_lagrangian() -> None:
    vehicle = load_vehicle("table1")
    arm, uav = vehicle.arm, vehicle.uav
    oracle = lagrangian(uav.mass, tuple(np.diag(uav.inertia)), arm.length, arm.mass_per_length)
    model = PrintedModel(vehicle, Reading(remark1=False), nodes=24)
    states = bent_states(vehicle)
    assert len(states) == 100
    for q, qd in states:
        M, C, G = model.matrices(q, qd)
        G[6] -= arm.bending_stiffness * arm.length * q[6]
        for ours, theirs in zip((M, C, G), oracle(q, qd), strict=True):
            right = np.array(theirs).reshape(ours.shape)
            np.testing.assert_allclose(ours, right, rtol=0, atol=1e-9 * np.abs(right).max())


def test_the_readable_matrices_of_the_package_are_the_same() -> None:
    vehicle = ca.load_vehicle("paper").replace(
        {"uav.mount": [0.03, -0.02, -0.05], "arm.kappa_s": 0.0}
    )
    model = PrintedModel(vehicle, Reading(rotary_inertia=True), nodes=24)
    for q, qd in bent_states(vehicle, 20):
        M, C, G = model.matrices(q, qd)
        right = (
            ca.equations.mass_matrix(vehicle, q),
            ca.equations.coriolis_matrix(vehicle, q, qd),
            ca.equations.gravity_vector(vehicle, q),
        )
        for ours, theirs in zip((M, C, G), right, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.long
@pytest.mark.parametrize(
    ("test", "decoupled"),
    [("A", "element"), ("B", "block"), ("C", "uav blocks"), ("D", "element, full C")],
)
def test_the_compiled_form_flies_what_the_readable_one_does(test: str, decoupled: Any) -> None:
    vehicle = load_vehicle("table1")
    readings = (
        Reading(decoupled=decoupled),
        Reading(decoupled=decoupled, kappa="bend angle", damping="bend vector", force_sign=1),
    )
    for reading, rotary in zip(readings, (False, True), strict=True):
        reading = reading.replace(rotary_inertia=rotary)
        # Short of the first passage through straight, after which ψa of Test C spins chaotically.
        options: dict[str, Any] = {"tolerance": 1e-9, "sample": 1e-3, "duration": 0.008}
        jobs = [Job(vehicle, reading, test, name) for name in ("coupled", decoupled)]
        for job, found in zip(jobs, fly(jobs, **options), strict=True):
            right = PrintedModel(vehicle, reading).fly(test, job.model, **options)
            assert found.status == right.status == FLOWN
            scale = 1.0 + np.abs(right.q).max(axis=0)
            np.testing.assert_allclose(found.q / scale, right.q / scale, rtol=0, atol=1e-7)


@pytest.mark.long
def test_blocks_without_remark_1_are_the_decoupled_model_of_simulate() -> None:
    """Tests A and B to 1e-6 of each range, the step halved until converged."""
    vehicle = load_vehicle("paper")
    for test in "AB":
        jobs = [Job(vehicle, LIKE_SIMULATE, test, name) for name in ("coupled", "block")]
        for job, printed in zip(jobs, fly(jobs, tolerance=1e-12, sample=1e-2), strict=True):
            model: Model = "coupled" if job.model == "coupled" else "decoupled"
            flown = ca.simulate(
                vehicle,
                open_loop_test(test),
                model=model,
                method="RK4",
                step=2.5e-5,
                sample=1e-2,
            )
            finer = ca.simulate(
                vehicle,
                open_loop_test(test),
                model=model,
                method="RK4",
                step=1.25e-5,
                sample=1e-2,
            )
            position, bend = bend_and_position(printed)
            for ours, name in ((position, "position"), (bend, "bend")):
                right = finer[name].to_numpy().reshape(ours.shape)
                span = np.ptp(right, axis=0)
                moves = span > 1e-9
                halved = flown[name].to_numpy().reshape(ours.shape)
                assert (np.abs(halved - right).max(axis=0)[moves] < 1e-7 * span[moves]).all()
                assert (np.abs(ours - right).max(axis=0)[moves] < 1e-6 * span[moves]).all()


def bend_and_position(flight: Flight) -> tuple[Array, Array]:
    """UAV position (n, 3) and bend vector (n, 2) of a flight in the paper's coordinates."""
    κ, ψa = flight.q[:, 6], flight.q[:, 7]
    return flight.q[:, :3], κ[:, None] * np.stack([np.cos(ψa), np.sin(ψa)], axis=-1)


@pytest.mark.long
@pytest.mark.parametrize("test", "CD")
def test_accelerations_along_flights_are_those_of_the_product(test: str) -> None:
    """Wherever |κ| > 0.02 1/m, in Tests C and D, to 1e-9."""
    vehicle = load_vehicle("paper").replace({"arm.damping_ratio": 0.01, "arm.kappa_s": 0.0})
    model = PrintedModel(vehicle, LIKE_SIMULATE, nodes=24)
    products: dict[str, Model] = {"coupled": "coupled", "block": "decoupled"}
    for name, product in products.items():
        (flight,) = fly([Job(vehicle, LIKE_SIMULATE, test, name)], tolerance=1e-8, sample=1e-2)
        bent = np.flatnonzero(np.abs(flight.q[:, 6]) > 0.02)
        assert len(bent) > 20
        for row in bent:
            q, qd = flight.q[row], flight.qd[row]
            tau, force = model.inputs(test, flight.time[row])
            ours = model.accelerations(q, qd, tau, force, name)
            wrench = -np.concatenate([force, np.zeros(3)])
            right = ca.forward_dynamics(vehicle, q, qd, tau, wrench, model=product)
            np.testing.assert_allclose(ours, right, rtol=0, atol=1e-9 * np.abs(right).max())


def test_flights_that_cannot_go_on_have_a_status_and_no_samples() -> None:
    vehicle = load_vehicle("table1")
    # Without Remark 1 ψa has no inertia where the arm is straight.
    (singular,) = fly([Job(vehicle, Reading(remark1=False), "C", "element")], most=500_000)
    assert singular.status in (SINGULAR, 3)
    soft = vehicle.replace({"arm.youngs_modulus": 1e6})
    (curled,) = fly([Job(soft, Reading(force_sign=1), "D", "coupled")])
    assert curled.status == CURLED
    for flight in (singular, curled):
        assert np.isnan(flight.q[-1]).all()
        assert np.isfinite(flight.q[0]).all()


def sines(phase: float) -> Array:
    """Samples (n, 1) of a sine of amplitude 2 over whole periods."""
    return 2.0 * np.sin(np.linspace(0.0, 20.0 * np.pi, 20_000, endpoint=False)[:, None] + phase)


@pytest.mark.parametrize(
    ("metric", "expected"),
    [
        # Two sines of amplitude a differ by √2 a sin(δ/2) in RMS, and have a range of 2 a.
        ("rmse", lambda half: 2.0 * np.sqrt(2.0) * np.sin(half)),
        ("per axis", lambda half: np.sin(half) / np.sqrt(2.0)),
        ("pooled", lambda half: np.sin(half) / np.sqrt(2.0)),
    ],
)
def test_two_sines_of_known_phase(metric: str, expected: Callable[[float], float]) -> None:
    for phase in (0.01, 0.3, 1.0):
        found = error(sines(0.0), sines(phase), metric)
        assert found == pytest.approx(expected(0.5 * phase), rel=1e-6)


def test_axes_are_normalised_one_by_one_or_together() -> None:
    small, large = sines(0.0), 50.0 * sines(0.0)
    first, second = np.hstack([small, large]), np.hstack([sines(0.2), large])
    alone = error(small, sines(0.2), "per axis")
    assert error(first, second, "per axis") == pytest.approx(alone)
    assert error(first, second, "pooled") == pytest.approx(alone / np.sqrt(1 + 50.0**2))
    # The range of both runs is that of the larger one.
    assert error(small, 3.0 * small, "per axis", "joint") == pytest.approx(
        error(small, 3.0 * small, "per axis") / 3.0
    )


def test_an_axis_without_range_counts_nothing_if_equal_and_is_infinite_otherwise() -> None:
    rest, moving = np.zeros((100, 1)), np.linspace(0.0, 1.0, 100)[:, None]
    assert error(np.hstack([rest, moving]), np.hstack([rest, moving]), "per axis") == 0.0
    assert error(rest, moving, "per axis") == np.inf
