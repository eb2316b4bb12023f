"""A viser server that only this machine reaches, without messages of its own."""

from __future__ import annotations

import inspect
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
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

    with _answering_own_pages():
        server = _quietly(
            lambda: viser.ViserServer(host=HOST, port=port, label=label, verbose=False)
        )
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


def is_own(host: str | None, origin: str | None, port: int) -> bool:
    """Return whether a request comes from a page of this server, by its headers Host and Origin.

    A page of another site in the same browser reaches the port, too, and one whose name was bound
    to this machine afterwards (DNS rebinding) names itself in Host.
    """
    names = {f"{name}:{port}" for name in (HOST, "localhost", "[::1]")}
    return host in names and origin in (None, *(f"http://{name}" for name in names))


@contextmanager
def _answering_own_pages() -> Iterator[None]:
    """Restrict servers that viser opens in the block to requests of their own pages."""
    from websockets.asyncio import server as sockets

    serve = sockets.serve

    def guarded(*given: Any, process_request: Any = None, **options: Any) -> Any:
        async def checked(connection: Any, request: Any) -> Any:
            headers, port = request.headers, connection.local_address[1]
            if not is_own(headers.get("Host"), headers.get("Origin"), port):
                return connection.respond(HTTPStatus.FORBIDDEN, "Open the address that was told.\n")
            answer = process_request and process_request(connection, request)
            return await answer if inspect.isawaitable(answer) else answer

        return serve(*given, process_request=checked, **options)

    sockets.serve = guarded  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        sockets.serve = serve  # type: ignore[misc]


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
        "port",
        f"is {port}, which another program uses or which is not allowed",
        "name another, or 0 for any that is free",
    )


def _quietly(call: Any) -> Any:
    """Call a function that prints a banner through rich, without the banner."""
    from rich import get_console

    console = get_console()
    before, console.quiet = console.quiet, True
    try:
        return call()
    finally:
        console.quiet = before
