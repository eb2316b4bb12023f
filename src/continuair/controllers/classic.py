"""Classic image-based visual servoing with its gains; kernels/laws/classic.py writes the law."""

from typing import Any

import numpy as np

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.controllers.inertias import camera_inertia
from continuair.kernels.laws.classic import law


def classic(
    vehicle: Any, rate: float = 0.5, inner: float = 6.0, *, feed_forward: bool = False
) -> Controller:
    """Proportional IBVS with a velocity loop around the dynamics.

    rate: λ of v = λ L⁺ e [1/s]; inner: rate of the loop that makes the camera follow v [1/s], well
    above λ; feed_forward: add the target's twist to v. Raises InputError.
    """
    settings = {
        "rate": checks.positive("rate", rate),
        "inner": checks.positive("inner", inner),
        "feed_forward": checks.flag("feed_forward", feed_forward),
    }
    gains = {name: np.asarray(value, float) for name, value in settings.items()}
    gains["inertia"] = camera_inertia(vehicle)
    return Controller("classic IBVS", law, gains, True, settings, asks=6)
