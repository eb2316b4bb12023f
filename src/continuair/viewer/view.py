"""`view`: a flight in the browser of this machine."""

from __future__ import annotations

import time
from typing import Any

import xarray as xr

from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.panel import Panel
from continuair.viewer.player import Player
from continuair.viewer.scene import Scene, scene
from continuair.viewer.server import HOST, PORT, close, open_server
from continuair.viewer.stage import Stage


class View:
    """A flight that is shown in browsers at `url` until `stop`."""

    def __init__(self, shown: Scene, port: int, label: str) -> None:
        self._server = open_server(port, label)
        self.stage = Stage(self._server, shown)
        self.player = Player(shown.times, self._show)
        self.player.playing = len(shown.times) > 1
        self._panel = Panel(self._server, self.stage, self.player)
        self.player.start()

    @property
    def url(self) -> str:
        """Where the browser finds it."""
        return f"http://{HOST}:{self._server.get_port()}"

    def wait(self) -> None:
        """Return when interrupted."""
        try:
            while True:
                time.sleep(3600.0)
        except KeyboardInterrupt:
            return

    def stop(self) -> None:
        """Show it no more."""
        self.player.stop()
        close(self._server)

    def _show(self, frame: int) -> None:
        with self._server.atomic():
            self.stage.show(frame)
            self._panel.follow(frame)


def view(
    flight: xr.Dataset,
    vehicle: Vehicle | None = None,
    *,
    ghost: xr.Dataset | None = None,
    port: int = PORT,
    block: bool = False,
) -> View:
    """Show a flight in the browser, at the `url` of what this returns, until its `stop`.

    flight: one run of `simulate`. vehicle: the one that flew, by default as the result says.
    ghost: another model's flight over the same times, drawn beside it. port: of 127.0.0.1, which no
    other machine reaches; 0 for any. block: return only when interrupted. Raises InputError.
    """
    shown = View(scene(flight, vehicle, ghost), port, "continuair")
    if block:
        shown.wait()
        shown.stop()
    return shown
