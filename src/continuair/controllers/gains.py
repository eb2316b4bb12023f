"""Gains of the paper's law from a bandwidth."""

from __future__ import annotations

from typing import Any, Literal, NotRequired, TypedDict, cast

import numpy as np

from continuair import checks
from continuair.controllers.carried import Carried, carried
from continuair.controllers.current import CAP, CurrentGains, current_gains
from continuair.controllers.inertias import camera_inertia, camera_inertia_of
from continuair.equations.camera import interaction_matrix
from continuair.errors import InputError, shown
from continuair.typing import ArrayLike
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

GAINS = ("constant", "current")
"""Designed for the desired image, or recomputed for the current image."""

_UNSEEN = 5e-5
"""W in the 2n - 6 directions that no camera motion reaches, over its least value in the others.

It makes W definite."""


class ServoingGains(TypedDict):
    """Keyword arguments of `servoing` for its gains, as `design` returns them."""

    Kp: np.ndarray | CurrentGains
    Kd: np.ndarray | CurrentGains
    Cp: float
    Cd: np.ndarray | CurrentGains
    Cs: float | np.ndarray
    points: int
    arms: NotRequired[Carried]


def design(
    vehicle: Vehicle,
    bandwidth: float,
    *,
    gains: Literal["constant", "current"] = "constant",
    damping_ratio: float = 1.0,
    conditioning: float = 1.5e-3,
    rate_gain: float = 1e-4,
    sliding: float = 1e-6,
    desired: ArrayLike | None = None,
    distance: ArrayLike = 2.0,
    cap: ArrayLike | None = None,
    bend_rate: float | None = None,
) -> ServoingGains:
    """Design gains for `servoing` by placing the poles of the camera's motion.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch), with a camera.
    bandwidth : float
        Bandwidth ω [rad/s].
    gains : {"constant", "current"}, default "constant"
        "constant": for the desired image. "current": recomputed at every update for the current
        image, for starts far from the goal.
    damping_ratio : float, default 1.0
        Damping ratio ζ.
    conditioning : float, default 1.5e-3
        Share μ: directions whose singular value is below this share of the largest get a slower
        loop.
    rate_gain : float, default 1e-4
        K_d = rate_gain W.
    sliding : float, default 1e-6
        C_s.
    desired : array_like (2n,), optional
        Desired image, normalised. Default: our square of 0.5 m, as the paper prints none.
    distance : float or array_like (n,), default 2.0
        Depths of the desired points [m], one for all or one each.
    cap : array_like (2,), optional
        For current gains: camera displacements, a distance [m] and an angle [rad], beyond which the
        error's effect no longer grows. Default: 0.5 each.
    bend_rate : float, optional
        Bandwidth of the loops that keep the arms straight as the vehicle moves [rad/s]. 0: the
        paper's law, whose wrench bends the camera's arm. Default: twice `bandwidth` for a vehicle
        with [[arm]], 0 for one with [arm].

    Returns
    -------
    ServoingGains
        Keyword arguments of `servoing`: Kp, Kd, Cp, Cd, Cs, points, and arms if `bend_rate` is not
        0.

    Raises
    ------
    InputError
        If a value is out of range, the desired image does not determine the camera's pose, or gains
        are not finite.

    Notes
    -----
    This design is ours; Amiri et al. (2026) print none. With Λ the inertia at the camera, all arms
    straight and frozen, L Λ^(-1/2) = Σ s_i u_i v_iᵀ over the visible directions. K_p = ω² W = Σ
    ω_i² / s_i² u_i u_iᵀ and C_d = Σ 2 ζ / ω_i u_i u_iᵀ give direction i the poles of p² + 2 ζ ω_i p
    + ω_i², with ω_i = ω s_i² / (s_i² + μ² s_1²). μ = 0 makes all ω_i equal, and K_p = ω² (L⁺)ᵀ Λ
    L⁺; image noise then moves the camera most along directions that the image hardly determines.
    Current gains use s_1 of the desired image too, since pixel noise is the same anywhere.
    """
    check_single_vehicle(vehicle, strain=True)
    # NumPy's powers of a number may be infinite, which is refused below; Python's raise.
    ω = np.float64(checks.positive("bandwidth", bandwidth))
    ζ = checks.positive("damping_ratio", damping_ratio)
    μ = checks.number("conditioning", conditioning, least=0.0)
    L = _seen(desired, _depths(distance))
    share, Cs = checks.positive("rate_gain", rate_gain), checks.positive("sliding", sliding)
    found: dict[str, Any] = {"Cp": 1.0, "Cs": Cs, "points": len(L) // 2}
    if checks.choice("gains", gains, GAINS) == "current":
        made = current_gains(vehicle, L, ω, ζ, μ, share, CAP if cap is None else cap)
        found |= {"Kp": made, "Kd": made, "Cd": made}
    elif cap is not None:
        raise InputError(
            "cap", f"is {shown(cap)}, which constant gains have none of", "leave it out"
        )
    else:
        found |= _constant(vehicle, L, ω, ζ, μ, share, distance)
    if bend_rate is None:
        bend_rate = 2.0 * float(ω) if vehicle.has_arm_list else 0.0
    if checks.number("bend_rate", bend_rate, least=0.0, otherwise=" [rad/s]") > 0.0:
        found["arms"] = carried(vehicle, bend_rate)
    return cast(ServoingGains, found)


def _constant(
    vehicle: Vehicle, L: np.ndarray, ω: Any, ζ: float, μ: float, share: float, distance: Any
) -> dict[str, np.ndarray]:
    """Return Kp, Kd, Cd (2n, 2n) of `design`, or raise InputError."""
    Kp, Kd, Cd = _placed(camera_inertia(vehicle), L, ω, ζ, μ, share)
    if not np.isfinite([Kp, Kd, Cd]).all():
        raise InputError(
            "bandwidth",
            (
                f"is {shown(float(ω))}, which with damping_ratio {shown(ζ)}, conditioning "
                f"{shown(μ)}, rate_gain {shown(share)} and distance {shown(distance)} "
                "gives gains that no number holds"
            ),
            "give values nearer to 1",
        )
    return {"Kp": Kp, "Kd": Kd, "Cd": Cd}


def designs(
    vehicle: Vehicle, desired: np.ndarray, depths: np.ndarray, **settings: Any
) -> dict[str, Any]:
    """Return gains of `design` for many runs, (runs, …) each but Cp and points.

    vehicle: one or a batch; desired: (runs, 2n); depths: (runs, n); settings: those of `design` by
    name except distance, checked, one for all or (runs,) each. Raises InputError.
    """
    runs = len(desired)
    each = {name: np.broadcast_to(value, runs) for name, value in settings.items()}
    rows, which = np.unique(np.hstack([desired, depths]), axis=0, return_inverse=True)
    L = np.stack([_seen(*np.split(row, [desired.shape[1]])) for row in rows])[which.ravel()]
    one = vehicle.runs is None
    vehicles = [vehicle] if one else [vehicle.select(run) for run in range(runs)]
    inertia = np.stack([camera_inertia_of(each) for each in vehicles])
    names = ("bandwidth", "damping_ratio", "conditioning", "rate_gain")
    Kp, Kd, Cd = _placed(inertia, L, *(each[name][:, None] for name in names))
    for run in np.flatnonzero(~np.isfinite([Kp, Kd, Cd]).all((0, 2, 3))):
        # It is refused alone, in one sentence.
        seen = {"desired": desired[run], "distance": depths[run]}
        design(vehicles[0 if one else run], **seen, **_of_run(each, run))
    Cs = each["sliding"][:, None, None] * np.eye(L.shape[1])
    return {"Kp": Kp, "Kd": Kd, "Cp": 1.0, "Cd": Cd, "Cs": Cs, "points": L.shape[1] // 2}


def _of_run(settings: dict[str, np.ndarray], run: Any) -> dict[str, Any]:
    return {name: values[run].item() for name, values in settings.items()}


def _placed(
    inertia: np.ndarray, L: np.ndarray, ω: Any, ζ: Any, μ: Any, share: Any
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Kp, Kd, Cd (..., 2n, 2n) of `design`.

    inertia: (..., 6, 6), L: (..., 2n, 6), rest: (..., 1). Results are not finite where they
    overflow.
    """
    inertia, axes = np.linalg.eigh(inertia)
    whitened = L @ (axes / np.sqrt(inertia)[..., None, :]) @ axes.swapaxes(-1, -2)
    u, s, _ = np.linalg.svd(whitened, full_matrices=False)
    back, one = u.swapaxes(-1, -2), np.eye(L.shape[-2])
    with np.errstate(all="ignore"):
        ω_i = ω * s**2 / (s**2 + (μ * s[..., :1]) ** 2)
        seen = (ω_i / (ω * s)) ** 2
        unseen = _UNSEEN * seen.min(axis=-1)[..., None, None]
        W = (u * seen[..., None, :]) @ back + unseen * (one - u @ back)
        W = W + W.swapaxes(-1, -2)
        ω, ζ, share = (np.asarray(value)[..., None] for value in (ω, ζ, share))
        Kp, Kd = ω**2 * W / 2, share * W / 2
        Cd = (u * (2.0 * ζ[..., 0] / ω_i)[..., None, :]) @ back + 2.0 * ζ / ω * (one - u @ back)
    return Kp, Kd, Cd


def _depths(distance: Any) -> float | np.ndarray:
    """Return the depth of all points, or of each (n,), or raise InputError."""
    if checks.is_number(distance):
        return checks.positive("distance", distance)
    found = checks.finite_array(distance)
    if found is None or found.ndim != 1 or not (found > 0.0).all():
        raise InputError(
            "distance",
            f"is {shown(distance)}",
            "give one above 0 for all points, or one for each [m]",
        )
    return found


def _seen(desired: Any, depths: float | np.ndarray) -> np.ndarray:
    """Return the interaction matrix (2n, 6) at the desired image; refuse rank below 6."""
    if desired is None:
        if np.ndim(depths):
            raise InputError(
                "distance",
                f"is {shown(depths)}, of points whose image is not given",
                "give desired, or one distance for our square",
            )
        half = 0.25 / depths
        desired = [half, -half, -half, -half, -half, half, half, half]
    image = checks.finite_array(desired)
    if image is None or image.ndim != 1 or len(image) < 6 or len(image) % 2:
        raise InputError(
            "desired",
            f"is {shown(desired)}",
            "give finite x and y of each point in turn, normalised, of 3 points or more",
        )
    points = len(image) // 2
    if np.ndim(depths) and np.size(depths) != points:
        raise InputError(
            "distance",
            f"is {shown(depths)}, {np.size(depths)} numbers, but desired has {points} points",
            "give one for each, or one for all [m]",
        )
    with np.errstate(all="ignore"):
        L = interaction_matrix(image, depths)
    if not np.isfinite(L).all():
        raise InputError(
            "distance",
            (
                f"is {shown(depths)}, from which the points {shown(desired)} move faster "
                "than numbers reach"
            ),
            "give it in metres",
        )
    if np.linalg.matrix_rank(L) < 6:
        raise InputError(
            "desired",
            f"is {shown(desired)}, which does not determine the camera's pose",
            "give at least 4 points, not on a line (or 3 off the singular cylinder)",
        )
    return L
