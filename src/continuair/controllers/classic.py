"""Classic image-based visual servoing with its gains; kernels/laws/classic.py writes the law."""

from typing import Any

import numpy as np

from continuair.controllers.controller import Controller, number
from continuair.controllers.gains import camera_inertia
from continuair.kernels.laws.classic import law


def classic(
    vehicle: Any, rate: float = 0.5, inner: float = 6.0, *, feed_forward: bool = False
) -> Controller:
    """Proportional IBVS with a velocity loop around the dynamics.

    rate: λ of v = λ L⁺ e [1/s]; inner: rate of the loop that makes the camera follow v [1/s], well
    above λ; feed_forward: add the target's twist to v. Raises InputError.
    """
    gains = {
        "inertia": camera_inertia(vehicle),
        "rate": number("rate", rate, 0.0, above=True),
        "inner": number("inner", inner, 0.0, above=True),
        "feed_forward": float(bool(feed_forward)),
    }
    settings = {"rate": rate, "inner": inner, "feed_forward": bool(feed_forward)}
    return Controller(
        "classic IBVS", law, {k: np.asarray(v) for k, v in gains.items()}, True, settings
    )
