"""Whether rotor wash acted on an arm in a flight, as results do not record its effect."""

from __future__ import annotations

import numpy as np

from continuair.analysis.backbone import along_at, parts
from continuair.analysis.motion import Motion
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.rotors import WASH_EDGE, Rotors
from continuair.vehicle.section import DRAG_NODES

Array = np.ndarray


def was_washed(motion: Motion) -> bool:
    """Return whether an arm with drag was in the wash of a rotor with thrust at some sample.

    Rotors count as running if the result does not record their thrusts.
    """
    vehicle, rotors = motion.vehicle, motion.vehicle.uav.rotors
    if rotors is None or rotors.radius is None or not vehicle.arms:
        return False
    thrusts = motion.dataset.get("rotor_thrust")
    pushing = True if thrusts is None else thrusts.to_numpy()[:, None] > 0.0
    nodes = np.concatenate([_nodes(*each) for each in parts(vehicle, motion.bend)], axis=1)
    return bool((_in_wash(nodes, rotors) & pushing).any())


def _nodes(arm: ArmChain, bend: Array) -> Array:
    """Return the points of an arm's drag (samples, nodes, 3), body axes [m]."""
    start, found = 0.0, []
    for section in arm.section:
        if section.drag_coefficient:
            found.append(start + 0.5 * section.length * (1.0 + DRAG_NODES))
        start += section.length
    return along_at(arm, bend, np.concatenate([np.empty(0), *found]))[0]


def _in_wash(points: Array, rotors: Rotors) -> Array:
    """Return whether each rotor washes points (samples, n, 3), body axes: (samples, n, rotors)."""
    radius = float(rotors.radius or 0.0)
    from_hub = points[..., None, :] - rotors.hubs
    height = (from_hub * rotors.axes).sum(-1)
    aside = np.linalg.norm(from_hub - height[..., None] * rotors.axes, axis=-1)
    return np.asarray((aside**2 < (1.0 + WASH_EDGE) * radius**2) & (height < WASH_EDGE * radius))
