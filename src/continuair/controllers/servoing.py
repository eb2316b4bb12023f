"""The paper's law, DPD-SM-IBVS, with its gains and choices; kernels/laws/servoing.py writes it."""

from typing import Any

import numpy as np

from continuair.controllers.controller import Controller, gain_matrix, number
from continuair.errors import InputError, shown
from continuair.kernels.laws.servoing import law

CHOICES = {
    "damping": ("camera", "feature"),
    "compensation": ("gravity_only", "literal"),
}


def servoing(
    Kp: Any,
    Kd: Any,
    Cp: Any = 1.0,
    Cd: Any = 1.0,
    Cs: Any = 1e-6,
    sigma: float = 1e-3,
    *,
    points: int = 4,
    damping: str = "camera",
    feed_forward: bool = True,
    compensation: str = "gravity_only",
    posture_damping: float = 0.0,
) -> Controller:
    """The paper's controller for `points` feature points.

    Kp, Kd, Cp, Cd, Cs: scalars, diagonals (2 points,) or matrices (2 points, 2 points), symmetric
    positive definite; sigma: width of tanh, normalised image. compensation: "gravity_only" leaves
    the arm its spring, "literal" cancels the elastic force too, as the printed G does.
    posture_damping: a moment against the bend rate [N m² s], for the two joint directions that the
    image does not see. Raises InputError.
    """
    chosen = {"damping": damping, "compensation": compensation}
    for name, value in chosen.items():
        if not isinstance(value, str) or value not in CHOICES[name]:
            raise InputError(f"{name} is {shown(value)}; use {' or '.join(CHOICES[name])}.")
    if isinstance(points, bool) or not isinstance(points, int) or points < 3:
        raise InputError(f"points is {shown(points)}; give a whole number of points, 3 or more.")
    if not isinstance(feed_forward, (bool, np.bool_)):
        raise InputError(f"feed_forward is {shown(feed_forward)}; give True or False.")
    matrices = {
        name: gain_matrix(name, value, 2 * points)
        for name, value in (("Kp", Kp), ("Kd", Kd), ("Cp", Cp), ("Cd", Cd), ("Cs", Cs))
    }
    numbers = {
        "sigma": number("sigma", sigma, 0.0, above=True),
        "feed_forward": float(bool(feed_forward)),
        "on_feature_rate": float(damping == "feature"),
        "spring": float(compensation == "literal"),
        "posture": number("posture_damping", posture_damping, 0.0),
    }
    settings = {**matrices, "sigma": sigma, **chosen, "feed_forward": bool(feed_forward)}
    settings["posture_damping"] = posture_damping
    return Controller("DPD-SM-IBVS", law, {**matrices, **numbers}, settings=settings)
