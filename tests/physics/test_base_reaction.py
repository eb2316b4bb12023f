"""What the arm puts on the UAV: by the UAV's own balance, by the arm's, and at rest."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair import equations as eq
from tests.equations.samples import FURNISHED
from tests.physics.free_flight import tumbling
from tests.physics.slopes import INSIDE, matrices, slope

STEP, INTERVAL = 2.5e-5, 2e-4
MOTION = ["q", "position", "attitude", "velocity", "angular_velocity", "bend", "bend_rate"]
# The bending's ω is 150 rad/s at most: RK4 keeps the slopes of what it logs to (ω STEP)⁴/120 =
# 2e-12, differences err by (ω INTERVAL)⁸/630 = 1e-15, and roundings count 2/INTERVAL = 1e4 times.
# Reached: 1e-12 by the UAV's balance, and 1e-11 by the arm's, whose momentum sums larger parts.
OF_UAV, OF_ARM = 1e-10, 1e-9
ARM = FURNISHED.arm
WEIGHT = np.array([0.0, 0.0, -9.81])


def force(t: Any) -> np.ndarray:
    return np.array([3.0 * np.cos(7 * t), -1.0 + 0 * t, 20.0 + 5.0 * np.sin(11 * t)])


def moment(t: Any) -> np.ndarray:
    return np.array([0.1 + 0 * t, -0.2 * np.cos(9 * t), 0.05 * np.sin(8 * t)])


def tau(t: Any) -> np.ndarray:
    """World force and Euler torques."""
    one, nil = 1.0 + 0 * t, 0 * t
    return np.array([one, 2 * one, -one, 0.1 * np.sin(6 * t), 0.3 * one, -0.1 * one, nil, nil])


def tip_wrench(t: Any) -> np.ndarray:
    one = 1.0 + 0 * t
    return np.array([one, -2.0 * np.cos(5 * t), 3.0 * one, 0.2 * np.sin(9 * t), 0.1 * one, -one])


@pytest.fixture(scope="module")
def runs() -> dict[str, xr.Dataset]:
    """All inputs at once, on a vehicle with a mount, disks, damping and a full inertia."""
    scenario = tumbling(0.05, gravity=9.81).replace(
        force=force, moment=moment, bend_moment=[4.0, -7.0], tau=tau, tip_wrench=tip_wrench
    )
    return {
        model: ca.simulate(
            FURNISHED,
            scenario,
            model=model,
            method="RK4",
            step=STEP,
            sample=INTERVAL,
            variables=[*MOTION, "base_force", "base_moment"],
        )
        for model in ca.MODELS
    }


def turned(R: np.ndarray, vectors: Any) -> np.ndarray:
    return np.einsum("nij,nj->ni", R, np.asarray(vectors))


def assert_close(found: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    """Of the largest component of the flight."""
    assert np.abs(found - expected).max() < tolerance * np.abs(expected).max()


@pytest.mark.parametrize("model", ca.MODELS)
def test_it_is_what_the_uavs_own_motion_asks_for(runs: dict[str, xr.Dataset], model: str) -> None:
    """Newton and Euler on the UAV alone: slopes of m v and of R J ω, less what acts on it."""
    run = runs[model]
    t, R = run.time.to_numpy(), matrices(run.attitude.to_numpy())
    to_body = np.swapaxes(R, 1, 2)
    uav = FURNISHED.uav
    pushed = (force(t) + tau(t)[:3]).T + uav.mass * WEIGHT
    gained = slope(uav.mass * turned(R, run.velocity), INTERVAL)
    assert_close(
        run.base_force.to_numpy()[INSIDE], turned(to_body[INSIDE], gained - pushed[INSIDE]), OF_UAV
    )
    # Torques conjugate to Euler angles do the work of a moment: (Rᵀ T)ᵀ moment = torque.
    T = np.array([eq.euler_rate_matrix(q) for q in run.q.to_numpy()])
    twisted = (
        moment(t).T
        + np.linalg.solve(np.swapaxes(to_body @ T, 1, 2), tau(t)[3:6].T[..., None])[..., 0]
    )
    spun = turned(R, run.angular_velocity.to_numpy() @ np.asarray(uav.inertia))
    gained = slope(spun, INTERVAL)
    assert_close(
        run.base_moment.to_numpy()[INSIDE],
        turned(to_body[INSIDE], gained) - twisted[INSIDE],
        OF_UAV,
    )


def motion(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """(q, q̇), both (samples, 8), from what is logged."""
    q, R = run.q.to_numpy().copy(), matrices(run.attitude.to_numpy())
    bend_rate = run.bend_rate.to_numpy()
    T = np.array([eq.euler_rate_matrix(at) for at in q])
    euler = np.linalg.solve(T, turned(R, run.angular_velocity)[..., None])[..., 0]
    cosine, sine = np.cos(q[:, 7]), np.sin(q[:, 7])
    radial = cosine * bend_rate[:, 0] + sine * bend_rate[:, 1]
    around = (cosine * bend_rate[:, 1] - sine * bend_rate[:, 0]) / q[:, 6]
    return q, np.column_stack([turned(R, run.velocity), euler, radial, around])


NODES, SHARES = np.polynomial.legendre.leggauss(24)


def momentum(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of backbone and disks: linear, angular about the world origin, and mass times position."""
    ds = 0.5 * ARM.length * SHARES
    s = np.append(0.5 * ARM.length * (1 + NODES), [disk.position for disk in ARM.disks])
    mass = np.append(ARM.mass_per_length * ds, [disk.mass for disk in ARM.disks])
    of_section = [ARM.transverse_inertia_per_length] * 2 + [ARM.axial_inertia_per_length]
    of_disks = [np.repeat(disk.inertia, (2, 1)) for disk in ARM.disks]
    inertia = np.vstack([np.outer(ds, of_section), *of_disks])
    twist = eq.jacobian(FURNISHED, q, s) @ qd
    at, linear = eq.position(FURNISHED, q, s), mass[:, None] * twist[:, :3]
    axes = eq.rotation(q) @ eq.section_rotation(FURNISHED, q, s)
    spin = turned(axes, inertia * turned(np.swapaxes(axes, 1, 2), twist[:, 3:]))
    return linear.sum(0), (np.cross(at, linear) + spin).sum(0), mass @ at


def reaction(run: xr.Dataset, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about B's origin, in world axes at the samples INSIDE: weight and tip
    wrench less what the arm gains in momentum."""
    linear, angular, moved = (np.array(part) for part in zip(*map(momentum, q, qd), strict=True))
    tip = np.array([eq.position(FURNISHED, at, ARM.length) for at in q])
    wrench = tip_wrench(run.time.to_numpy()).T
    force = ARM.mass * WEIGHT + wrench[INSIDE, :3] - slope(linear, INTERVAL)
    about_origin = np.cross(moved, WEIGHT) + np.cross(tip, wrench[:, :3]) + wrench[:, 3:]
    moment = about_origin[INSIDE] - slope(angular, INTERVAL)
    return force, moment - np.cross(run.position.to_numpy()[INSIDE], force)


def of_kernel(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    R = matrices(run.attitude.to_numpy())
    return turned(R, run.base_force)[INSIDE], turned(R, run.base_moment)[INSIDE]


def test_the_coupled_arm_loses_in_momentum_what_it_puts_on_the_uav(
    runs: dict[str, xr.Dataset],
) -> None:
    run = runs["coupled"]
    for found, expected in zip(of_kernel(run), reaction(run, *motion(run)), strict=True):
        assert_close(found, expected, OF_ARM)


def test_the_independent_payload_keeps_the_shape_of_the_start(runs: dict[str, xr.Dataset]) -> None:
    run = runs["independent"]
    q, qd = motion(run)
    q[:, 6:], qd[:, 6:] = q[0, 6:], 0.0
    for found, expected in zip(of_kernel(run), reaction(run, q, qd), strict=True):
        assert_close(found, expected, OF_ARM)


def test_the_decoupled_force_is_that_of_an_arm_whose_bending_carries_no_momentum(
    runs: dict[str, xr.Dataset],
) -> None:
    """Its moment is no arm's: half of what the turning of a changing shape asks for."""
    run = runs["decoupled"]
    q, qd = motion(run)
    qd[:, 6:] = 0.0
    found, expected = of_kernel(run)[0], reaction(run, q, qd)[0]
    assert_close(found, expected, OF_ARM)


def test_at_rest_it_is_the_arms_weight_where_the_arms_centre_of_mass_is() -> None:
    hover = ca.trim(FURNISHED, bend=(0.8, -0.3), yaw=0.7)
    scenario = ca.Scenario(
        "hover", hover.q, force=hover.force, moment=hover.moment, bend_moment=hover.bend_moment
    )
    run = ca.simulate(FURNISHED, scenario, duration=0.01)
    R = eq.rotation(hover.q)
    centre = R.T @ momentum(hover.q, np.zeros(8))[2] / ARM.mass
    weight = ARM.mass * WEIGHT
    # Reached: 1e-13, the rounding of a spring that holds up to 100 N m.
    assert_close(run.base_force[-1].to_numpy(), weight, 1e-11)
    assert_close(run.base_moment[-1].to_numpy(), np.cross(centre, weight), 1e-11)
