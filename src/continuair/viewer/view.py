"""`view`: a flight in a browser on this machine."""

from __future__ import annotations

import time

import numpy as np
import xarray as xr

from continuair.errors import InputError
from continuair.flight.live import Simulation
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.live import Watch, present
from continuair.viewer.panel import Panel
from continuair.viewer.player import Clock, Player
from continuair.viewer.scene import Scene, scene
from continuair.viewer.server import HOST, PORT, close, open_server
from continuair.viewer.stage import Stage

_WIDEST = 0.5 * np.pi
"""Bend angle at the end of the scale of colours of a flight that is not known beforehand [rad]."""


class View:
    """A flight that is shown in browsers at `url` until `stop`."""

    def __init__(
        self, shown: Scene, port: int, label: str, simulation: Simulation | None = None
    ) -> None:
        self._server = open_server(port, label)
        self.player: Clock
        if simulation is None:
            self._stage = Stage(self._server, shown)
            player = self.player = Player(shown.times, self._show)
            player.playing = len(shown.times) > 1
            self._panel = Panel(self._server, self._stage, player)
        else:
            self._stage = Stage(self._server, shown, _WIDEST)
            self._panel, self._went = Panel(self._server, self._stage, None), False
            self.player = Watch(simulation, self._show_now)
        self.player.start()

    @property
    def url(self) -> str:
        """Address for the browser."""
        return f"http://{HOST}:{self._server.get_port()}"

    @property
    def scene(self) -> Scene:
        """The scene shown: all frames of a flight, or the present state of a simulation."""
        return self._stage.scene

    @property
    def follows(self) -> bool:
        """Whether the picture follows the UAV."""
        return self._stage.follows

    def wait(self) -> None:
        """Return when interrupted."""
        try:
            while True:
                time.sleep(3600.0)
        except KeyboardInterrupt:
            return

    def stop(self) -> None:
        """Close the server."""
        self.player.stop()
        close(self._server)

    def _show(self, frame: int) -> None:
        with self._server.atomic():
            self._stage.show(frame)
            self._panel.follow(frame)

    def _show_now(self, now: Scene) -> None:
        self._stage.scene = now
        if self._stage.gone_far and not self._went:
            self._went = True
            self._panel.go_along()
        self._show(0)


def view(
    flight: xr.Dataset | Simulation,
    vehicle: Vehicle | None = None,
    *,
    ghost: xr.Dataset | None = None,
    scenario: Scenario | None = None,
    port: int = PORT,
    block: bool = False,
) -> View:
    """Show a flight in the browser.

    Parameters
    ----------
    flight : xarray.Dataset or Simulation
        Result of one run of `simulate`, or a simulation, whose present state is shown as it is
        stepped.
    vehicle : Vehicle, optional
        The simulated vehicle. Default: that of the result's attributes.
    ghost : xarray.Dataset, optional
        Flight of another model over the same times, drawn beside it.
    scenario : Scenario, optional
        The simulated scenario. A result does not hold its functions of time.
    port : int, optional
        Port of 127.0.0.1, which no other machine reaches; 0 for any free one.
    block : bool, default False
        Whether to return only when interrupted.

    Returns
    -------
    View
        The page, at its `url` until `stop`.

    Raises
    ------
    InputError
        If a flight is unsuitable, or other arguments are given with a Simulation.
    """
    if isinstance(flight, Simulation):
        if vehicle is not None or ghost is not None or scenario is not None:
            raise InputError(
                "vehicle", "and ghost and scenario are of results", "leave them out of a Simulation"
            )
        shown = View(present(flight), port, flight.vehicle.name, flight)
    else:
        found = scene(flight, vehicle, ghost, scenario)
        shown = View(found, port, found.vehicle.name)
    if block:
        shown.wait()
        shown.stop()
    return shown
