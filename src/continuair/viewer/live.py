"""The present state of a `Simulation` as geometry, and a clock that polls it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from continuair.flight.live import Simulation
from continuair.viewer.bodies import bodies
from continuair.viewer.camera import Aim
from continuair.viewer.player import Clock
from continuair.viewer.scene import Scene

_TICK = 1.0 / 30.0
"""Period of polling the simulation [s]."""


class Watch(Clock):
    """Poll a simulation while another thread steps it, and show changes."""

    def __init__(self, simulation: Simulation, show: Callable[[Scene], None]) -> None:
        super().__init__()
        self._simulation, self._show = simulation, show

    def _run(self) -> None:
        shown = -1.0
        while not self._done.wait(_TICK):
            if self._simulation.time != shown:
                now = present(self._simulation)
                shown = float(now.times[0])
                self._show(now)


def present(simulation: Simulation) -> Scene:
    """Return the scene of a simulation's present, of one frame."""
    vehicle, time, state = simulation.vehicle, simulation.time, simulation.state
    layout = vehicle.layout
    bend = state[None, layout.bend]
    placed = bodies(vehicle, state[None, layout.position], state[None, layout.attitude], bend)
    aim = None
    if simulation.scenario.targets:
        target = simulation.scenario.targets[0]
        centroid = np.asarray(target.path(np.array([time]))[0]).reshape(1, 3)
        aim = Aim(centroid, centroid[:, None] + np.asarray(target.points))
    return Scene(
        vehicle, "live", np.array([time]), placed, None, "", None, aim, {}, np.ones(1, bool)
    )
