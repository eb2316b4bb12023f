"""DPD-SM-IBVS, the paper's law, Eqs. (15) and (16): τ = G + J_Lᵀ (K_p e_a - K_d J_L q̇).

e_a = C_d ė + C_p e + C_s tanh(e/σ), e = s_d - s, ė = -L (v_c - v_t), J_L = L J_c. The image is in
normalised coordinates, L is computed from the measured image and depths, and v_t is the target's
true twist in camera axes. Where the paper prints T_a⁻¹ in J_L, the rotation into camera axes
belongs. Named choices, with the printed one last: damping "camera" (on J_L q̇ = L v_c, printed) or
"feature" (on -ė); feed_forward False or True (printed); compensation "gravity_only" or "literal".
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.carried import Carried, carrying_control, carrying_gains
from continuair.controllers.controller import Controller, definite, gain_matrix, over_runs
from continuair.controllers.current import CurrentGains, current_fields, current_wrench
from continuair.errors import InputError, shown
from continuair.kernels.sensing.sense import LawCode, gains_of
from continuair.typing import ArrayLike

_MOST_POINTS = 100

CHOICES = {
    "damping": ("camera", "feature"),
    "compensation": ("gravity_only", "literal"),
}


def servoing(
    Kp: ArrayLike | CurrentGains,
    Kd: ArrayLike | CurrentGains,
    Cp: ArrayLike = 1.0,
    Cd: ArrayLike | CurrentGains = 1.0,
    Cs: ArrayLike = 1e-6,
    sigma: float = 1e-3,
    *,
    points: int = 4,
    damping: Literal["camera", "feature"] = "camera",
    feed_forward: bool = True,
    compensation: Literal["gravity_only", "literal"] = "gravity_only",
    posture_damping: float = 0.0,
    integral: float = 0.0,
    arms: Carried | None = None,
) -> Controller:
    """Make the paper's controller.

    Parameters
    ----------
    Kp : array_like or CurrentGains
        K_p: a scalar, a diagonal (2 points,) or a matrix (2 points, 2 points), symmetric positive
        definite; or as `design` returns it with ``gains="current"``.
    Kd : array_like or CurrentGains
        K_d, likewise.
    Cp : array_like, default 1.0
        C_p, likewise; 1 with current gains.
    Cd : array_like or CurrentGains, default 1.0
        C_d, likewise.
    Cs : array_like, default 1e-6
        C_s, likewise; a scalar with current gains.
    sigma : float, default 1e-3
        Width σ of tanh, in the normalised image.
    points : int, default 4
        Number of feature points.
    damping : {"camera", "feature"}, default "camera"
        Damping on J_L q̇ = L v_c, as printed, or on -ė.
    feed_forward : bool, default True
        Whether ė contains the target's motion, as printed.
    compensation : {"gravity_only", "literal"}, default "gravity_only"
        "gravity_only" compensates gravity; "literal" also the elastic force, as in the printed G.
    posture_damping : float, default 0.0
        Moment against the bend rate [N m³ s], for the two joint directions that do not change the
        image.
    integral : float, default 0.0
        Rate at which the integrated error adds to the error [1/s], so that a constant force leaves
        no steady error. It integrates while no point is farther than 0.1 from its goal. Choose it
        below the bandwidth of the slowest direction.
    arms : Carried, optional
        As `design` returns it for a vehicle with [[arm]]: moments that keep the arms straight as
        the vehicle moves. This extension is ours, not the paper's.

    Returns
    -------
    Controller
        The controller of one run.

    Raises
    ------
    InputError
        If a gain is not symmetric positive definite or not of this size, or a choice is unknown.

    Notes
    -----
    Eqs. (15) and (16) of Amiri et al. (2026).
    """
    chosen = {"damping": damping, "compensation": compensation}
    for name, value in chosen.items():
        checks.choice(name, value, CHOICES[name])
    size = 2 * checks.whole("points", points, 3, _MOST_POINTS)
    given = {"Kp": Kp, "Kd": Kd, "Cp": Cp, "Cd": Cd, "Cs": Cs}
    follow = any(isinstance(value, CurrentGains) for value in given.values())
    fields, told = _of_the_image(given) if follow else _constant(given, size)
    settings: dict[str, Any] = {
        **told,
        **chosen,
        "sigma": checks.positive("sigma", sigma),
        "feed_forward": checks.flag("feed_forward", feed_forward),
        "posture_damping": checks.number("posture_damping", posture_damping, least=0.0),
    }
    rate = checks.number("integral", integral, least=0.0, otherwise=" [1/s]")
    if rate:
        settings["integral"] = rate
    gains = {
        **fields,
        "sigma": settings["sigma"],
        "feed_forward": float(settings["feed_forward"]),
        "on_feature_rate": float(damping == "feature"),
        "spring": float(compensation == "literal"),
        "posture": settings["posture_damping"],
    }
    name = "DPD-SM-IBVS, current gains" if follow else "DPD-SM-IBVS"
    laws = (current_law, carrying_current_law) if follow else (law, carrying_law)
    if arms is not None:
        name, gains = f"{name}, arms carried", gains | _carrying(arms)
        settings["bend_rate"] = arms.rate
    flown = laws[arms is not None]
    return Controller(name, flown, gains, settings=settings, asks=6, integral=rate)


def _carrying(arms: Any) -> dict[str, Any]:
    """Return the laws' additional fields for arms that follow the vehicle."""
    if not isinstance(arms, Carried):
        raise InputError("arms", f"is {shown(arms)}", "give arms of design(vehicle, ...), or None")
    return {"per_push": arms.per_push, "bend_inertia": arms.inertia, "bend_rate": arms.rate}


def _constant(given: dict[str, Any], size: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the law's fields for its gains, and their provenance."""
    matrices = {name: gain_matrix(name, value, size) for name, value in given.items()}
    return matrices, matrices


def _of_the_image(given: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the same for gains that are recomputed for the current image."""
    made = given["Kp"]
    if not (given["Kd"] is made and given["Cd"] is made):
        raise InputError(
            "Kp",
            "with Kd and Cd is not of one design(..., gains='current')",
            "give all three as it returns them",
        )
    sliding = checks.positive("Cs", given["Cs"], " with current gains")
    if np.any(np.asarray(given["Cp"]) != 1.0):
        raise InputError(
            "Cp", f"is {shown(given['Cp'])}", "with current gains it is 1, leave it out"
        )
    return {**made.fields(), "sliding": sliding}, {**made.describe(), "Cs": sliding}


def servoings(
    gains: Mapping[str, Any], posture_damping: np.ndarray, integral: float = 0.0
) -> Controller:
    """Return `servoing` for a batch, with the gains of `designs`.

    posture_damping: (runs,); integral: one for all.
    """
    own = {name: definite(name, gains[name]) for name in ("Kp", "Kd", "Cd", "Cs")}
    first = servoing(
        **{name: rows[0] for name, rows in own.items()},
        Cp=gains["Cp"],
        points=gains["points"],
        posture_damping=posture_damping[0].item(),
        integral=integral,
    )
    damped = {"posture": posture_damping}, {"posture_damping": posture_damping}
    return over_runs(first, own | damped[0], own | damped[1])


def law(code: LawCode) -> SimpleNamespace:
    """Return the law on the device."""
    Gains = gains_of(constant_gains(code) | choices(code))
    return SimpleNamespace(
        Gains=Gains, control=camera_control(code, Gains, camera_wrench(code, Gains))
    )


def carrying_law(code: LawCode) -> SimpleNamespace:
    """Return the law for a vehicle whose arms are kept straight; ours, not the paper's."""
    Gains = gains_of(constant_gains(code) | choices(code) | carrying_gains(code))
    return SimpleNamespace(
        Gains=Gains, control=carrying_control(code, Gains, camera_wrench(code, Gains))
    )


def current_law(code: LawCode) -> SimpleNamespace:
    """Return the law with gains that are recomputed for the current image."""
    Gains = gains_of(current_fields(code) | choices(code))
    return SimpleNamespace(
        Gains=Gains, control=camera_control(code, Gains, current_wrench(code, Gains))
    )


def carrying_current_law(code: LawCode) -> SimpleNamespace:
    """Return the law with current gains for a vehicle whose arms are kept straight."""
    Gains = gains_of(current_fields(code) | choices(code) | carrying_gains(code))
    return SimpleNamespace(
        Gains=Gains, control=carrying_control(code, Gains, current_wrench(code, Gains))
    )


def constant_gains(code: LawCode) -> dict[str, Any]:
    """Return the types of the law's gains."""
    return dict.fromkeys(("Kp", "Kd", "Cp", "Cd", "Cs"), code.ImageGain)


def choices(code: LawCode) -> dict[str, Any]:
    """Return the types of its other fields: σ, named choices and the posture damping."""
    names = ("sigma", "feed_forward", "on_feature_rate", "spring", "posture")
    return dict.fromkeys(names, code.Real)


def camera_control(code: LawCode, Gains: Any, wrench_of: Any) -> Any:
    """Return the wrench as a function of (sense, gains): weight, spring, camera and damping."""
    Sense, push, camera_push, vec3 = code.Sense, code.push, code.camera_push, code.vec3

    @wp.func
    def control(sense: Sense, gains: Gains):
        tau = sense.weight + gains.spring * sense.spring
        tau += camera_push(sense, wrench_of(sense, gains))
        return tau + push(vec3(), vec3(), -gains.posture * sense.bend_rate)

    return control


def camera_wrench(code: LawCode, Gains: Any) -> Any:
    """Return the camera wrench Lᵀ (K_p e_a - K_d L v_c) as a function of (sense, gains)."""
    Image, Sense, interaction = code.Image, code.Sense, code.interaction
    rows, tanh = 2 * code.points, code.tanh

    @wp.func
    def wrench_of(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        target_rate = L * sense.target_twist
        camera_rate = L * sense.camera_twist
        e_dot = gains.feed_forward * target_rate - camera_rate
        sliding = Image()
        for i in range(rows):
            sliding[i] = tanh(e[i] / gains.sigma)
        e_a = gains.Cd * e_dot + gains.Cp * e + gains.Cs * sliding
        damped = camera_rate - gains.on_feature_rate * target_rate
        return wp.transpose(L) * (gains.Kp * e_a - gains.Kd * damped)

    return wrench_of
