"""Judges of the section on control, III-D: the camera's image, Eqs. (11) to (14), and J_L."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.agreement import natural_units
from amiri2026.paper.theorem import triangle
from amiri2026.verdicts import Case, Judgement, judged, or_misprint, over_cases
from continuair import Camera, Vehicle, paths
from continuair.analysis import percent
from continuair.equations import (
    camera_jacobian,
    camera_pose,
    euler_rate_matrix,
    image_jacobian,
    interaction_matrix,
    jacobian,
    look,
    project,
    rigid_motion,
    to_normalised,
    to_pixels,
)
from continuair.scenario import LETTER_HEIGHT, LETTERS, SETTINGS, strokes

Array = np.ndarray

DRAWS = 100
AGREES = 1e-6
"""Relative; central differences reach 1e-9."""

APART = 1e-5
"""Seconds between the two sides of a central difference, and their middle."""


FEATURES, TWIST = "features' rate", "camera's twist"
TEXT = ("J_t in tip axes", "T_e from Euler rates")
"""How the text has J_t, after Eq. (10), and T_e, before Eq. (8)."""


def camera_from_image(_: Evidence) -> Judgement:
    """Judge III-D.1: does L give the camera's twist from the motion of the image?"""
    rng = np.random.default_rng(1)
    conditions, errors = [], []
    for n in (3, 4, 6):
        for _draw in range(DRAWS):
            points, twist = points_in_view(rng, n), rng.normal(size=6)
            L = interaction_matrix(project(points), points[:, 2])
            sizes = np.linalg.svd(L, compute_uv=False)
            conditions.append(sizes[-1] / sizes[0])
            found = np.linalg.pinv(L) @ image_rate(points, twist)
            errors.append(np.linalg.norm(found - twist) / np.linalg.norm(twist))
    # Rounding leaves a matrix of rank 5 a sixth singular value below 1e-15.
    rank_6 = bool(min(conditions) > 1e-12)
    view = judged(
        rank_6 and bool(max(errors) < 1e-9),
        f"in {len(errors)} draws of 3, 4 and 6 points in view, the least singular value of L is at "
        f"least {min(conditions):.1g} of the largest: L has rank {6 if rank_6 else 'below 6'}. The "
        f"pseudo-inverse L⁺ returns the camera's twist from the image's rate, "
        f"with a residual {below(float(max(errors)), 1e-9)}. L itself maps from twist to image",
        least_over_largest_singular_value=float(min(conditions)),
    )
    return or_misprint(view, "the pseudo-inverse of a rank-6 L gives the twist")


def below(error: float, limit: float = AGREES) -> str:
    """Return an error in words: below its limit, as rounding differs between machines."""
    return f"below {limit:g}" if error < limit else f"{error:.2g}"


def points_in_view(rng: np.random.Generator, n: int) -> Array:
    """Return points (n, 3) in camera axes, 1 to 3 m away and up to 27° off the optical axis [m]."""
    image, depth = rng.uniform(-0.5, 0.5, (n, 2)), rng.uniform(1.0, 3.0, (n, 1))
    return np.asarray(np.hstack([image * depth, depth]))


def image_rate(points: Array, twist: Array) -> Array:
    """The rate (2n,) of the image of points at rest, by the quotient rule; twist: the camera's."""
    rate = -twist[:3] - np.cross(twist[3:], points)
    x = points[:, :2] / points[:, 2:]
    return np.asarray(((rate[:, :2] - x * rate[:, 2:]) / points[:, 2:]).ravel())


def error_rate(evidence: Evidence) -> Judgement:
    """Judge III-D.4: is ė = -L(v_c - v_t), for the e in pixels that the section defines?"""
    camera = evidence.vehicle.camera
    rng = np.random.default_rng(4)
    pixels, normalised, at_centroid = [], [], []
    for _ in range(DRAWS):
        points, camera_twist, target_twist = points_in_view(rng, 4), *rng.normal(size=(2, 6))
        seen = [seen_after(t, points, camera_twist, target_twist) for t in (APART, -APART)]
        ahead, behind = (to_pixels(camera, image) for image in seen)
        rate = -(ahead - behind) / (2.0 * APART)
        rate_normalised = rate / np.tile(camera.focal_length, 4)
        L = interaction_matrix(project(points), points[:, 2])
        v_t = target_twist.copy()
        v_t[:3] -= np.cross(target_twist[3:], points.mean(0))
        printed = -L @ (camera_twist - v_t)
        pixels.append(off(printed, rate))
        normalised.append(off(printed, rate_normalised))
        at_centroid.append(off(-L @ (camera_twist - target_twist), rate_normalised))
    ratio, centre = float(1.0 / (1.0 - np.median(pixels))), float(np.median(at_centroid))
    view = judged(
        max(pixels) < AGREES,
        f"with s in pixels, as the section defines it, ė is {ratio:.3g} times the right side of "
        "Eq. (12), because the L of Eq. (14) is that of normalised coordinates. v_t is the "
        "target's twist at the camera's origin; with the velocity of the target's centre the "
        f"error is {percent(centre)} in the median of {DRAWS} draws",
        rate_in_pixels_over_printed=ratio,
        median_error_with_velocity_of_the_centre=centre,
    )
    return or_misprint(
        view,
        "Eq. (12) is right with s in normalised coordinates; in pixels ė = -FL(v_c - v_t), with F "
        f"the focal lengths. The residual relative to ė is {percent(float(np.median(pixels)))} as "
        f"printed (median) and {below(max(normalised))} as corrected, also for a target that turns",
    )


def seen_after(time: float, points: Array, camera: Array, target: Array) -> Array:
    """Return the image (2n,) of points that move as a body, from a camera that moves.

    points: (n, 3) in camera axes at time 0. camera: its twist in its own axes; target: velocity of
    the points' centre and angular velocity, in camera axes at time 0.
    """
    centre = points.mean(0)
    turned = Rotation.from_rotvec(time * target[3:]).apply(points - centre)
    moved = centre + time * target[:3] + turned
    pose = rigid_motion(camera, time)
    return project((moved - pose[:3, 3]) @ pose[:3, :3])


def off(found: Array, right: Array) -> float:
    """Return the difference of two vectors, relative."""
    return float(np.linalg.norm(found - right) / np.linalg.norm(right))


def bounded_target(_: Evidence) -> Judgement:
    """Judge III-D.6: are velocity, acceleration and jerk bounded while the letters are traced?"""
    duration = SETTINGS["nominal"].duration
    counts = (20_001, 80_001)
    largest, growth, jump = np.zeros(3), 0.0, 0.0
    for name in LETTERS:
        path = paths.letter(name, LETTER_HEIGHT, duration)
        coarse, fine = (norms(path, count) for count in counts)
        largest = np.maximum(largest, fine)
        growth = max(growth, float((fine / coarse).max()) - 1.0)
        jump = max(jump, corner_jump(name, duration))
    speed, acceleration, jerk = largest.tolist()
    view = judged(
        growth < 0.01,
        f"this is an assumption, and the paper prints no time law. Our letters are {LETTER_HEIGHT} "
        f"m high, have rounded corners and take {duration:g} s. Their target has at most "
        f"{speed:.2g} m/s, {acceleration:.2g} m/s² and {jerk:.2g} m/s³, which finer times do not "
        "raise. At constant speed through sharp corners the velocity would jump by up to "
        f"{jump:.2g} m/s, with an unbounded acceleration",
        largest_speed_m_s=speed,
        largest_acceleration_m_s2=acceleration,
        largest_jerk_m_s3=jerk,
        jump_at_sharp_corner_m_s=jump,
    )
    return over_cases([Case("any vehicle", "letters with rounded corners", view)])


def norms(path: paths.Path, count: int) -> Array:
    """Return largest speed, acceleration and jerk (3,) of a path at that many times; SI units."""
    time = np.linspace(0.0, path.duration, count)
    _, velocity, acceleration = path(time)
    jerk = np.diff(acceleration, axis=0) / np.diff(time)[:, None]
    each = (velocity, acceleration, jerk)
    return np.array([np.linalg.norm(rates, axis=1).max() for rates in each])


def corner_jump(name: str, duration: float) -> float:
    """The largest jump of the velocity [m/s] on a letter's straight strokes at constant speed."""
    sides = np.diff(LETTER_HEIGHT * strokes(name, corners_per_arc=48), axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    velocities = sides / lengths[:, None] * lengths.sum() / duration
    return float(np.linalg.norm(np.diff(velocities, axis=0), axis=1).max())


def pixel_size(evidence: Evidence) -> Judgement:
    """Judge III-D.9: does the pixel's size drop out of Eq. (13) if all its values are in pixels?"""
    lens, sizes = 4e-3, (1e-6, 3e-6, 10e-6)
    centre = np.asarray(evidence.vehicle.camera.principal_point)
    points = points_in_view(np.random.default_rng(9), DRAWS)
    on_sensor = lens * points[:, :2] / points[:, 2:]
    spread = 0.0
    for size in sizes:
        camera = Camera(focal_length=(lens / size, lens / size), principal_point=tuple(centre))
        found = to_normalised(camera, (on_sensor / size + centre).ravel())
        spread = max(spread, float(np.abs(found - project(points)).max()))
    least, *_, most = (lens / size for size in reversed(sizes))
    view = judged(
        spread < 1e-9,
        f"with a lens of {1e3 * lens:g} mm, pixels of {1e6 * sizes[0]:g} to {1e6 * sizes[-1]:g} "
        f"µm give an f_x of {most:g} to {least:g} px. Differences of the normalised coordinates of "
        f"Eq. (13) are {below(spread, 1e-9)}: the focal length in pixels contains the "
        "pixel size",
        focal_length_of_the_smallest_pixels_px=most,
    )
    return or_misprint(view, "Eq. (13) with the focal length over the pixel size")


def matrix_of_a_point(_: Evidence) -> Judgement:
    """Judge III-D.10: are the twelve entries of Eq. (14) the slopes of the projection?"""
    rng = np.random.default_rng(10)
    worst = np.zeros((2, 6))
    for point in points_in_view(rng, DRAWS):
        slopes = np.column_stack([slope(point, twist) for twist in np.eye(6)])
        printed = interaction_matrix(project(point[None]), point[2])
        worst = np.maximum(worst, np.abs(printed - slopes) / np.maximum(np.abs(slopes), 1.0))
    agreeing = int((worst < AGREES).sum())
    view = judged(
        agreeing == worst.size,
        f"{agreeing} of the {worst.size} entries agree to {AGREES:g} with central differences of "
        f"the projection at {DRAWS} points, in normalised coordinates",
        entries_that_agree=float(agreeing),
    )
    return or_misprint(view, "the slopes of the projection, which differ from Eq. (14)")


def slope(point: Array, twist: Array) -> Array:
    """The rate (2,) of the image of a point (3,) at rest under a camera's twist, by differences."""
    still = np.zeros(6)
    ahead, behind = (seen_after(t, point[None], twist, still) for t in (APART, -APART))
    return np.asarray((ahead - behind) / (2.0 * APART))


def image_jacobian_as_printed(evidence: Evidence) -> Judgement:
    """Judge III-D.12: do the sizes fit, and is J_L q̇ as printed a motion of camera or features?"""
    vehicle = evidence.vehicle
    fitting = [n for n in range(3, 9) if sizes_fit(n)]
    errors = printed_errors(vehicle, np.random.default_rng(12))
    level = printed_errors(vehicle, np.random.default_rng(12), level=True)
    middle = {name: float(np.median(each)) for name, each in errors.items()}
    of_features, of_twist = (
        min(middle[name] for name in middle if name[-1] == meant) for meant in (FEATURES, TWIST)
    )
    as_text = (*TEXT, FEATURES)
    right = max(corrected_errors(vehicle, np.random.default_rng(12)))
    view = judged(
        bool(fitting) and min(max(each) for each in errors.values()) < AGREES,
        f"e_a in R⁶ and 6×6 gains fit N = {listed(fitting)} only. The paper prints v_c = J_Lq̇ "
        "without saying which motion it is. With J_t and T_e as the text defines them, it "
        f"{'is' if max(level[as_text]) < AGREES else 'is not'} the features' rate for a level UAV "
        f"without yaw, and differs by {percent(middle[as_text])} in the median of {DRAWS} random "
        f"states. Other readings differ by at least {percent(of_features)} from this rate and by "
        f"{percent(of_twist)} from the camera's twist",
        median_error_from_feature_rate_as_the_text_has_it=middle[as_text],
        least_median_error_from_feature_rate=of_features,
        least_median_error_from_camera_twist=of_twist,
    )
    return or_misprint(
        view,
        "J_L = L diag(R_c, R_c)ᵀJ_t, with R_c the rotation from camera to world axes and J_t in "
        "world axes at the camera. T_a⁻¹ holds the matrix of the Euler rates instead. The residual "
        f"relative to the features' rate is {percent(middle[as_text])} as printed (median) and "
        f"{below(right)} as corrected",
    )


def corrected_errors(vehicle: Vehicle, rng: np.random.Generator) -> list[float]:
    """Return relative errors of J_L q̇ with the rotation of the camera, at random states."""
    return [
        off(image_jacobian(vehicle, q, points) @ qd, features_rate(vehicle, q, qd, points))
        for q, qd, points in random_motions(vehicle, rng)
    ]


def sizes_fit(n: int) -> bool:
    """Whether Eqs. (15) to (17) can be evaluated in the sizes that they print, for n points."""
    e, L, T_a, J_t, gain = (
        np.zeros(size) for size in ((2 * n,), (2 * n, 6), (6, 6), (6, 8), (6, 6))
    )
    J_L = L @ T_a @ J_t
    try:
        e_a = gain @ (L @ np.zeros(6)) + gain @ e + gain @ np.tanh(e)
        tau = J_L.T @ (gain @ e_a - gain @ (J_L @ np.zeros(8)))
    except ValueError:
        return False
    return e_a.shape == (6,) and tau.shape == (8,)


def listed(values: list[int]) -> str:
    """Format whole numbers as evidence prints them."""
    return " and ".join(str(value) for value in values) or "no number of points"


def printed_errors(
    vehicle: Vehicle, rng: np.random.Generator, *, level: bool = False
) -> dict[tuple[str, str, str], list[float]]:
    """Return relative errors of J_L q̇ as printed at random states, by reading and meant motion.

    level: with the UAV level and without yaw.
    """
    errors: dict[tuple[str, str, str], list[float]] = {}
    for q, qd, points in random_motions(vehicle, rng, level=level):
        meant = {
            FEATURES: features_rate(vehicle, q, qd, points),
            TWIST: camera_jacobian(vehicle, q) @ qd,
        }
        L = interaction_matrix(*look(vehicle, q, points))
        for reading, twist in twist_readings(vehicle, q, qd):
            for name, motion in meant.items():
                errors.setdefault((*reading, name), []).append(off(L @ twist, motion))
    return errors


def random_motions(
    vehicle: Vehicle, rng: np.random.Generator, *, level: bool = False
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield q, q̇ (8,) and points (3, 3) in view [m], the same in arm lengths for every arm."""
    length = vehicle.arm.length
    units = natural_units(length)
    for _ in range(DRAWS):
        angles = rng.uniform(-1.0, 1.0, 3) * [0.5, 0.5, np.pi] * (not level)
        bend, direction = rng.uniform(0.1, 2.0), rng.uniform(-np.pi, np.pi)
        q = units * np.array([0.0, 0.0, 3.0, *angles, bend, direction])
        qd = units * rng.normal(size=8)
        at, axes = camera_pose(vehicle, q)
        yield q, qd, at + length * (triangle() + [0.0, 0.0, 2.0]) @ axes.T


def features_rate(vehicle: Vehicle, q: Array, qd: Array, points: Array) -> Array:
    """Return the rate (2n,) of the image of points at rest, by central differences."""
    ahead, behind = (look(vehicle, q + t * qd, points)[0] for t in (APART, -APART))
    return np.asarray((ahead - behind) / (2.0 * APART))


def twist_readings(
    vehicle: Vehicle, q: Array, qd: Array
) -> Iterator[tuple[tuple[str, str], Array]]:
    """T_a⁻¹ J_t q̇ (6,) with J_t in tip or world axes, and T_e of Euler rates or its inverse."""
    T = euler_rate_matrix(q)
    length, frame = vehicle.arm.length, vehicle.camera.tip_frame
    of_tip = {
        TEXT[0]: camera_jacobian(vehicle, q),
        "J_t in world axes": jacobian(vehicle, q, length, frame),
    }
    of_angles = {TEXT[1]: np.linalg.inv(T), "T_e to Euler rates": T}
    for axes, J_t in of_tip.items():
        for direction, inverse in of_angles.items():
            yield (axes, direction), np.kron(np.eye(2), inverse) @ J_t @ qd


JUDGES = {
    "III-D.1": camera_from_image,
    "III-D.4": error_rate,
    "III-D.6": bounded_target,
    "III-D.9": pixel_size,
    "III-D.10": matrix_of_a_point,
    "III-D.12": image_jacobian_as_printed,
}
"""Judge of every sentence of the section on what the camera sees, by its id."""
