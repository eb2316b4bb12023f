"""A flight as one page that plays without a server and fetches nothing."""

from __future__ import annotations

import html
import os
from pathlib import Path

from continuair.analysis.motion import evenly
from continuair.errors import InputError
from continuair.files import new_file, printed, save
from continuair.viewer.panel import legend
from continuair.viewer.scene import Scene
from continuair.viewer.server import check_server, close, open_server
from continuair.viewer.stage import Stage

RATE = 30.0
"""Frames per second of a page at most."""

_POLICY = (
    '<meta http-equiv="Content-Security-Policy" content="default-src \'unsafe-inline\' '
    "'unsafe-eval' data: blob:\">"
)
"""The browser refuses whatever the page would fetch."""

_CAPTION = (
    "<div style='position:fixed;left:1em;bottom:4em;z-index:9;width:17em;padding:.6em;"
    "background:#ffffffd0;font-family:sans-serif;font-size:.9em;pointer-events:none'>"
)


def check_page(path: str | os.PathLike[str]) -> Path:
    """Return the path of a page that can be written; raises InputError."""
    if not os.fspath(path).endswith(".html"):
        raise InputError("export", f"is {printed(path)}", "name a file that ends in .html")
    check_server()
    return new_file("export", path)


def write_page(shown: Scene, path: str | os.PathLike[str], label: str) -> None:
    """Write a scene as one HTML file; raises InputError."""
    file = check_page(path)
    server = open_server(0, label)
    try:
        stage = Stage(server, shown)
        recording = server.get_scene_serializer()
        before = float(shown.times[0])
        for frame in evenly(shown.times, RATE):
            now = float(shown.times[frame])
            recording.insert_sleep(now - before)
            stage.show(int(frame))
            before = now
        page = recording.as_html()
    finally:
        close(server)
    save("export", file, _finished(page, label, legend(stage)))


def _finished(page: str, label: str, said: str) -> str:
    """Return a page of viser with our title, a caption, and a policy against loading anything."""
    title = html.escape(label)
    page = page.replace("<head>", f"<head>{_POLICY}", 1)
    page = page.replace("<title>Viser</title>", f"<title>{title}</title>", 1)
    return page.replace("</body>", f"{_CAPTION}<b>{title}</b>{said}</div></body>", 1)
