"""Peter Corke's machinevision-toolbox, run live: interaction matrices and servo runs."""

from importlib.metadata import version

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.controllers.classic import classic
from continuair.controllers.inertias import camera_inertia
from continuair.equations.camera import interaction_matrix_in_pixels, to_pixels
from continuair.scenario.paths import circle
from continuair.scenario.targets import Target
from continuair.vehicle.camera import Camera
from tests.oracles.conftest import Claim

pytest.importorskip("machinevisiontoolbox", exc_type=ImportError)
from machinevisiontoolbox import IBVS, CentralCamera  # noqa: E402
from spatialmath import SE3  # noqa: E402

SOURCE = f"machinevision-toolbox {version('machinevision-toolbox-python')}"
CAMERA = Camera()
FLOOR = 1e-11
"""What the classic law adds to the diagonal of LᵀL, in normalised coordinates."""


def their_camera(pose: SE3 | None = None) -> CentralCamera:
    """The default camera of ours: 800 px, 1000 x 1000, centre (500, 500)."""
    return CentralCamera(f=0.008, rho=1e-5, imagesize=1000, pp=(500, 500), pose=pose)


def test_interaction_matrix(claim: Claim) -> None:
    rng = np.random.default_rng(1)
    camera, worst = their_camera(), 0.0
    for _ in range(100):
        pixels, depth = rng.uniform(0, 1000, (4, 2)), rng.uniform(0.3, 5.0, 4)
        theirs = camera.visjac_p(pixels.T, depth)
        ours = interaction_matrix_in_pixels(CAMERA, pixels.ravel(), depth)
        worst = max(worst, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
    claim(
        "interaction matrices of four points, 100 random images, largest difference over the "
        "largest entry",
        SOURCE,
        1e-13,
        worst,
    )


def test_its_servo_run(claim: Claim) -> None:
    """At every iteration of its run, from its image and depths, our law gives its velocity."""
    points = np.array([[-0.25, -0.25, 3], [-0.25, 0.25, 3], [0.25, 0.25, 3], [0.25, -0.25, 3.0]])
    goal = 200.0 * np.array([[-1, -1, 1, 1], [-1, 1, 1, -1]]) + 500.0
    start = SE3.Trans(1, 1, -3) * SE3.Rz(0.6)
    rate = 0.08
    servo = IBVS(their_camera(start), P=points.T, p_d=goal, lmbda=rate, graphics=False)
    servo.run(60)
    poses, off, errors = [start], [], []
    for moment in servo.history:
        pixels = moment.p.T.ravel()
        depth = (poses[-1].inv() * points.T)[2]
        L = interaction_matrix_in_pixels(CAMERA, pixels, depth)
        e = goal.T.ravel() - pixels
        # Its history holds the velocity as read back from the step's orthonormal rotation.
        off.append(SE3.Delta(rate * np.linalg.pinv(L) @ e).delta() - moment.vel)
        errors.append(np.linalg.norm(e))
        poses.append(SE3(moment.pose))
    claim(
        f"its servo run of {len(off)} iterations ({errors[0]:.0f} px to {errors[-1]:.1f} px): "
        "camera velocity v = λ L⁺ e, largest difference of a component",
        SOURCE,
        1e-12,
        float(np.abs(off).max()),
        unit="m, rad per iteration",
    )


def test_our_servo_run(claim: Claim) -> None:
    """A closed loop in the kernels: what the camera saw, and what the controller made of it."""
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.05})
    rate, inner = 0.5, 6.0
    scenario = ca.Scenario(
        "servoing",
        [0.1, 0, 3.1, 0, 0, 0, 0.1, 0],
        duration=0.5,
        gravity=0.0,  # the push is then the servo law's alone
        controller=classic(vehicle, rate, inner),
        control_period=None,  # smooth motion, so that image velocities can be taken by differences
        target=Target(circle(radius=0.2, period=10.0)),
    )
    flight = ca.simulate(vehicle, scenario, sample=5e-5, rtol=1e-10)
    camera, inertia = their_camera(), camera_inertia(vehicle)
    pixels = flight.features.values
    seen = (8 * (pixels[3:-1] - pixels[1:-3]) - pixels[4:] + pixels[:-4]) / 6e-4
    moved, wanted, exact = [], [], []
    for i in range(2, len(pixels) - 2, 100):
        now = flight.isel(time=i)
        L = camera.visjac_p(pixels[i].reshape(4, 2).T, now.depth.values)
        into_camera = Rotation.from_quat(now.camera_attitude.values).inv()
        drift = np.concatenate([into_camera.apply(now.target_velocity.values), np.zeros(3)])
        moved.append(L @ (now.camera_twist.values - drift) - seen[i - 2])
        e = to_pixels(CAMERA, scenario.targets[0].desired) - pixels[i]
        found = _velocity(now, inertia, inner)
        exact.append(rate * np.linalg.pinv(L) @ e - found)
        L, e = L / 800.0, e / 800.0
        H = L.T @ L
        wanted.append(rate * np.linalg.solve(H + FLOOR * np.diag(np.diag(H)), L.T @ e) - found)
    claim(
        "closed loop in the kernels: image velocity of the features against its interaction matrix "
        "times the camera's motion, largest difference over the largest",
        SOURCE,
        1e-7,
        float(np.abs(moved).max() / np.abs(seen).max()),
        note="image velocity by fourth-order differences of features sampled every 50 µs",
    )
    what = "closed loop in the kernels: camera velocity that the classic law asks for against"
    recovered = "recovered from the logged push, Λ k (v - v_c) on the camera"
    claim(
        f"{what} λ (LᵀL + 1e-11 diag LᵀL)⁻¹Lᵀ e by its interaction matrix, largest difference",
        SOURCE,
        1e-10,
        float(np.abs(wanted).max()),
        unit="m/s, rad/s",
        note=recovered,
    )
    claim(
        f"{what} λ L⁺ e by its interaction matrix, largest difference",
        SOURCE,
        1e-6,
        float(np.abs(exact).max()),
        unit="m/s, rad/s",
        note="that share of LᵀL on its diagonal is what it changes",
    )


def _velocity(now: xr.Dataset, inertia: np.ndarray, inner: float) -> np.ndarray:
    """The velocity (6,) that the classic law asked for, camera axes, from the push it gave."""
    to_body = Rotation.from_quat(now.attitude.values).inv()
    to_camera = Rotation.from_quat(now.camera_attitude.values).inv()
    push = now.command.values
    # The moment is about B; the wrench acts at the camera.
    lever = now.camera_position.values - now.position.values
    moment = to_body.inv().apply(push[3:6]) - np.cross(lever, push[:3])
    wrench = np.concatenate([to_camera.apply(push[:3]), to_camera.apply(moment)])
    return np.asarray(np.linalg.solve(inertia, wrench) / inner + now.camera_twist.values)
