"""`continuair view`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from continuair.cli.application import app
from continuair.cli.terminal import progress_bar
from continuair.errors import InputError

# Everything else is imported inside the command, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.viewer.scene import Scene


@app.command(epilog="Example: continuair view my_drone.toml")
def view(
    result: Annotated[
        str,
        typer.Argument(help="A flight (.nc), a study's folder, a preset's name or a .toml file."),
    ],
    flight: Annotated[
        str | None, typer.Option(help="Which flight of a folder or file. Default: the first.")
    ] = None,
    port: Annotated[int, typer.Option(help="Port of 127.0.0.1; 0 for any that is free.")] = 8080,
    export: Annotated[
        str | None,
        typer.Option(help="Write a page that needs nothing else instead.", metavar="FILE.html"),
    ] = None,
    video: Annotated[
        str | None, typer.Option(help="Write a video instead, .mp4 or .gif.", metavar="FILE")
    ] = None,
) -> None:
    """Show a flight in the browser: UAV, arms, camera, target and forces, as they move.

    A vehicle is simulated first, in a hover with swinging arms and a lateral force.
    """
    from continuair.viewer.export import check_page, write_page
    from continuair.viewer.server import check_server
    from continuair.viewer.video import animation, check_video

    if export is not None:
        check_page(export)
    if video is not None:
        check_video(video)
    if export is None and video is None:
        check_server(port)
    shown, label = _scene(result, flight)
    if export is not None:
        write_page(shown, export, label)
        typer.echo(f"The page is {export}.", err=True)
    if video is not None:
        with progress_bar() as progress:
            animation(shown, video, label, progress)
        typer.echo(f"The video is {video}.", err=True)
    if export is None and video is None:
        _serve(shown, port, label)


def _serve(shown: Scene, port: int, label: str) -> None:
    from continuair.viewer.view import View

    served = View(shown, port, label)
    try:
        typer.echo(f"The flight is at {served.url}; Ctrl-C ends it.", err=True)
        served.wait()
    finally:
        served.stop()


def _scene(result: str, name: str | None) -> tuple[Scene, str]:
    """Return the chosen flight as a scene, and its name."""
    from continuair.files import user_path
    from continuair.vehicle.vehicle import load_vehicle, preset_names
    from continuair.viewer.reading import chosen, recorded
    from continuair.viewer.scene import scene

    path = user_path("result", result)
    if result in preset_names() or path.suffix == ".toml" or not (path.suffix or path.exists()):
        vehicle = load_vehicle(result)
        if name is not None:
            raise InputError(
                "flight", f"is {name!r}, but {result} is a vehicle, which flies one", "leave it out"
            )
        return _flown(vehicle)
    flights = recorded(path)
    one = chosen(flights, name)
    if len(flights) > 1:
        names = ", ".join(each.name for each in flights)
        typer.echo(f"Flights: {names}. This is {one.name}; --flight names another.", err=True)
    vehicle, flown, ghost = one.load()
    return scene(flown, vehicle, ghost), f"{vehicle.name}: {one.name}"


def _flown(vehicle: object) -> tuple[Scene, str]:
    from continuair.vehicle.vehicle import check_vehicle
    from continuair.viewer.flying import fly
    from continuair.viewer.scene import scene

    flown = check_vehicle(vehicle)
    with progress_bar() as progress:
        progress(0, 1, "flying")
        scenario, coupled, decoupled = fly(flown)
    return scene(coupled, flown, decoupled, scenario), f"{flown.name}: {scenario.name}"
