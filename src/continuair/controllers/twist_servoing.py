"""Visual servoing by a flight controller's set-points; kernels/laws/twists.py writes the law."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.controllers.flight import flight_controller
from continuair.kernels.laws.twists import LAWS


def twist_servoing(
    vehicle: Any,
    servo: float = 0.5,
    *,
    speed: float = 0.3,
    conditioning: float = 0.03,
    feed_forward: bool = True,
    **choices: Any,
) -> Controller:
    """Image-based servoing of a vehicle that must tilt to move, such as a quadrotor.

    The camera's twist v = λ L⁺ e becomes set-points of velocity, yaw and bends for a flight
    controller. servo: λ [1/s], well below the bandwidths of that; speed: the largest velocity that
    is asked for [m/s], which tilts the camera the more the larger it is; conditioning: directions
    of which the image shows less than this share come home more slowly, as noise moves them most;
    feed_forward: add the target's twist to v; choices: the others of `flight_controller`.

    Sections whose bend_bandwidth is 0 are not moved; the others move as fast as the twist asks for,
    whatever theirs. Positions are not asked for, nor their noise. Set-points of the scenario are
    refused. Raises InputError.
    """
    rate, ahead, share = (
        checks.positive("servo", servo, " [1/s]"),
        checks.flag("feed_forward", feed_forward),
        checks.number("conditioning", conditioning, least=0.0),
    )
    flight = flight_controller(vehicle, speed=speed, **choices)
    lengths = np.array([each.length for arm in vehicle.arms for each in arm.section])
    moved = flight.settings["bend_bandwidth"] > 0.0
    gains = {
        "servo": np.array(rate),
        "feed_forward": np.array(float(ahead)),
        "conditioning": np.array(share),
        # A bend counts by the angle at its section's end.
        "bend_weight": np.repeat(np.where(moved, lengths**-2.0, 0.0), 2),
    }
    return replace(
        flight,
        name="IBVS by twists",
        law=LAWS[flight.settings["feedforward"]],
        gains={**flight.gains, **gains},
        looks=True,
        settings={
            "servo": rate,
            "feed_forward": ahead,
            "conditioning": share,
            **flight.settings,
        },
    )
