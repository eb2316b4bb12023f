"""An eye in hand in plain NumPy, from the readable form, and states to look from."""

import numpy as np
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations
from continuair.equations.kinematics import skew
from continuair.scenario import paths
from continuair.scenario.targets import Target
from continuair.vehicle.coordinates import euler_to_body_rates

# Remark 1 off, so that these tests see the kinematics and not the threshold.
PLAIN = ca.load_vehicle("paper").replace({"arm.kappa_s": 0.0})
MOUNTED = PLAIN.replace(
    {
        "uav.mount": [0.03, -0.05, 0.04],
        "camera.position": [0.04, -0.02, 0.06],
        "camera.attitude": Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_quat().tolist(),
        "camera.focal_length": [800.0, 700.0],
        "camera.principal_point": [480.0, 510.0],
    }
)
CORNERS = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.02], [-0.1, -0.1, 0.0], [0.1, -0.12, 0.0]])


def with_frame(vehicle: ca.Vehicle, tip_frame: str) -> ca.Vehicle:
    return vehicle.replace({"camera.tip_frame": tip_frame})


def pose(vehicle: ca.Vehicle, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) and rotation (3, 3) of the camera in the world."""
    camera, length = vehicle.camera, vehicle.arm.length
    tip = equations.rotation(q) @ equations.section_rotation(vehicle, q, length, camera.tip_frame)
    at = equations.position(vehicle, q, length) + tip @ np.asarray(camera.position)
    return at, tip @ Rotation.from_quat(camera.attitude).as_matrix()


def twist_jacobian(vehicle: ca.Vehicle, q: np.ndarray) -> np.ndarray:
    """J_c (6, 8): the paper's rates to the camera's twist (v, ω), in camera axes."""
    camera, length = vehicle.camera, vehicle.arm.length
    J = equations.jacobian(vehicle, q, length, camera.tip_frame)
    tip = equations.rotation(q) @ equations.section_rotation(vehicle, q, length, camera.tip_frame)
    linear = J[:3] - skew(tip @ np.asarray(camera.position)) @ J[3:]
    R = pose(vehicle, q)[1]
    return np.vstack([R.T @ linear, R.T @ J[3:]])


def seen(vehicle: ca.Vehicle, q: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normalised image (2n,) and depths (n,) of points (n, 3) in the world."""
    at, R = pose(vehicle, q)
    inside = (points - at) @ R
    return (inside[:, :2] / inside[:, 2:]).ravel(), inside[:, 2]


def in_front(vehicle: ca.Vehicle, q: np.ndarray, distance: float = 3.0) -> np.ndarray:
    """The point (3,) on the optical axis."""
    at, R = pose(vehicle, q)
    return at + distance * R[:, 2]


def held_before(vehicle: ca.Vehicle, q: np.ndarray) -> list[Target]:
    """One still target per state, in the middle of its image."""
    return [Target(paths.hold(in_front(vehicle, at)), CORNERS) for at in q]


def in_paper_coordinates(push: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Generalised forces (runs, 8) conjugate to q from pushes (runs, 8)."""
    euler = np.einsum("nji,nj->ni", euler_to_body_rates(q), push[:, 3:6])
    cosine, sine = np.cos(q[:, 7]), np.sin(q[:, 7])
    along = cosine * push[:, 6] + sine * push[:, 7]
    around = q[:, 6] * (cosine * push[:, 7] - sine * push[:, 6])
    return np.column_stack([push[:, :3], euler, along, around])


def states(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """q and q̇ (n, 8): every attitude with |θ| <= 1.2, κ l from 0.02 to 4."""
    rng = np.random.default_rng(seed)
    q = np.column_stack(
        [
            rng.uniform(-2, 2, (n, 3)),
            rng.uniform(-np.pi, np.pi, n),
            rng.uniform(-1.2, 1.2, n),
            rng.uniform(-np.pi, np.pi, n),
            rng.uniform(0.02, 4.0, n) * rng.choice([-1, 1], n),
            rng.uniform(-np.pi, np.pi, n),
        ]
    )
    return q, rng.normal(size=(n, 8))
