"""A controller of one's own on the device: a level hover that brakes the arm's vibration."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp
import xarray as xr

import continuair as ca


def law(code: Any) -> SimpleNamespace:
    """What the controller does; `code` names the types and functions of the device."""
    Real, Sense, vec3, push, two = code.Real, code.Sense, code.vec3, code.push, code.Real(2.0)

    @wp.struct
    class Gains:
        position: vec3
        mass: Real
        inertia: vec3
        brake: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        # PD loops at 3 rad/s and 1 rad/s; a small turn is twice the quaternion's vector.
        w = Real(3.0)
        f = gains.mass * w * (w * (gains.position - sense.position) - two * sense.velocity)
        w = Real(1.0)
        tilt = two * vec3(sense.attitude[0], sense.attitude[1], sense.attitude[2])
        m = -w * wp.cw_mul(gains.inertia, w * tilt + two * sense.angular_velocity)
        b = -gains.brake * sense.bend_rate
        return sense.weight + push(f, m, b)

    return SimpleNamespace(Gains=Gains, control=control)


def fly(brake: float) -> xr.Dataset:
    """Hover from a bent start; brake: moment against the bend rate [N m³ s]."""
    vehicle = ca.load_vehicle("paper")
    inertia = np.diag(ca.rigid_inertia(vehicle))[3:]
    gains = {"position": [0, 0, 3], "mass": vehicle.mass, "inertia": inertia, "brake": brake}
    hover = ca.Controller("braked hover", law, gains, looks=False)
    scenario = ca.Scenario("hover", [0, 0, 3, 0, 0, 0, 0.5, 0.3], duration=1.0, controller=hover)
    return ca.simulate(vehicle, scenario)


def main() -> None:
    for brake in (0.0, 0.3):
        left = float(np.abs(fly(brake).bend[200:]).max())
        print(f"brake {brake} N m³ s: the arm still bends by {left:.1e} 1/m after 0.2 s")


if __name__ == "__main__":
    main()
