"""Classic image-based visual servoing, v = λ L⁺ e, with an inner loop on the camera's twist.

The inner loop is a wrench on the camera, Λ k (v - v_c), with Λ the inertia at the camera with the
arm frozen straight. The arm keeps its spring; the weight is compensated.
"""

from types import SimpleNamespace

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.controllers.definite import definite_code
from continuair.controllers.inertias import camera_inertia
from continuair.kernels.sensing.sense import LawCode
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


def classic(
    vehicle: Vehicle, rate: float = 0.5, inner: float = 6.0, *, feed_forward: bool = False
) -> Controller:
    """Make a proportional image-based servoing law with an inner velocity loop.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch), with a camera.
    rate : float, default 0.5
        Gain λ of v = λ L⁺ e [1/s].
    inner : float, default 6.0
        Rate of the loop that makes the camera follow v [1/s]; choose it well above λ.
    feed_forward : bool, default False
        Whether to add the target's twist to v.

    Returns
    -------
    Controller
        The controller of one run.

    Raises
    ------
    InputError
        If `vehicle` is a batch, or a rate is not positive.
    """
    check_single_vehicle(vehicle, strain=True)
    settings = {
        "rate": checks.positive("rate", rate),
        "inner": checks.positive("inner", inner),
        "feed_forward": checks.flag("feed_forward", feed_forward),
    }
    gains = {name: np.asarray(value, float) for name, value in settings.items()}
    gains["inertia"] = camera_inertia(vehicle)
    return Controller("classic IBVS", law, gains, True, settings, asks=6)


def law(code: LawCode) -> SimpleNamespace:
    """Return the law on the device."""
    Real, Sense, interaction = code.Real, code.Sense, code.interaction
    camera_push, definite = code.camera_push, definite_code(code)
    TwistGain, determined = definite.Matrix, definite.determined
    factored, solved = definite.factored, definite.solved

    @wp.struct
    class Gains:
        inertia: TwistGain
        rate: Real
        inner: Real
        feed_forward: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        H = factored(determined(wp.transpose(L) * L))
        v = gains.rate * solved(H, wp.transpose(L) * e)
        v += gains.feed_forward * sense.target_twist
        wrench = gains.inertia * (gains.inner * (v - sense.camera_twist))
        return sense.weight + camera_push(sense, wrench)

    return SimpleNamespace(Gains=Gains, control=control)
