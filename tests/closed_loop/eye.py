"""States to look from, what an eye in hand looks at there, and the slopes of what it sees."""

import numpy as np
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations
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
# Of the largest element: central differences reach 1e-10.
DIFFERENCES = 5e-9
CORNERS = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.02], [-0.1, -0.1, 0.0], [0.1, -0.12, 0.0]])


def with_frame(vehicle: ca.Vehicle, tip_frame: str) -> ca.Vehicle:
    return vehicle.replace({"camera.tip_frame": tip_frame})


def finite_differences(vehicle: ca.Vehicle, q: np.ndarray, points: np.ndarray) -> np.ndarray:
    """∂(image)/∂q (2n, 8) by central differences: h² of 1e-10 and rounding of 1e-11."""
    h = 1e-5
    columns = []
    for shift in h * np.eye(8):
        ahead, behind = (equations.look(vehicle, at, points)[0] for at in (q + shift, q - shift))
        columns.append((ahead - behind) / (2 * h))
    return np.stack(columns, axis=-1)


def in_front(vehicle: ca.Vehicle, q: np.ndarray, distance: float = 3.0) -> np.ndarray:
    """The point (3,) on the optical axis."""
    at, R = equations.camera_pose(vehicle, q)
    return at + distance * R[:, 2]


def held_before(vehicle: ca.Vehicle, q: np.ndarray) -> list[Target]:
    """One still target per state, in the middle of its image, and desired from where it is seen."""
    return [before(vehicle, at, paths.hold(in_front(vehicle, at))) for at in q]


def before(vehicle: ca.Vehicle, q: np.ndarray, path: paths.Path) -> Target:
    """A target on a path, desired from the side from which the camera sees it."""
    attitude = Rotation.from_matrix(equations.camera_pose(vehicle, q)[1])
    return Target(path, CORNERS, camera_attitude=attitude.as_quat())


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
