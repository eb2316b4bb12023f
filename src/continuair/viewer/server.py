"""A viser server that only this machine reaches, and says nothing of its own."""

from __future__ import annotations

import socket
from typing import Any

from continuair import checks
from continuair.errors import InputError

HOST = "127.0.0.1"
"""No other machine can connect."""

PORT = 8080

_HIGHEST = 65535


def check_server(port: int = 0) -> None:
    """Raise InputError unless there is viser, and a port is free; 0 is any."""
    checks.installed("viser", "view")
    checks.whole("port", port, 0, _HIGHEST)
    if port and not _is_free(port):
        raise _taken(port)


def open_server(port: int, label: str) -> Any:
    """Return a server at a port, 0 for any that is free; raises InputError if it is taken."""
    check_server(port)
    import viser

    server = _quietly(lambda: viser.ViserServer(host=HOST, port=port, label=label, verbose=False))
    if port and server.get_port() != port:
        close(server)
        raise _taken(port)
    server.gui.configure_theme(
        show_logo=False, show_share_button=False, control_width="medium", brand_color=(0, 114, 178)
    )
    server.gui.main_panel.dock_right()  # beside the picture, not over it
    return server


def close(server: Any) -> None:
    """Stop a server."""
    _quietly(server.stop)


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as attempt:
        attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            attempt.bind((HOST, port))
        except OSError:
            return False
    return True


def _taken(port: int) -> InputError:
    return InputError(
        f"port is {port}, which another program uses or which is not allowed; name another, or 0 "
        "for any that is free."
    )


def _quietly(call: Any) -> Any:
    """Call what prints a banner through rich, without the banner."""
    from rich import get_console

    console = get_console()
    before, console.quiet = console.quiet, True
    try:
        return call()
    finally:
        console.quiet = before
