"""The server of the editor's page: on 127.0.0.1 alone, for whoever knows the token."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from deskew.editor.desk import Desk
from deskew.editor.gate import Gate
from deskew.errors import StepError, require

HOST = "127.0.0.1"
PORT = 2718
"""Asked for unless the user names another one."""

_NEEDED = ("marimo", "anywidget", "uvicorn")
_STATIC = Path(__file__).parent / "static"

_served: list[Desk] = []


def require_editor() -> None:
    """Raise an InputError unless what serves the page is installed."""
    missing = [name for name in _NEEDED if find_spec(name) is None]
    remedy = "find its packages (pip install 'deskew3d[editor]')"
    require(not missing, "deskew edit", remedy, f"no {' and no '.join(missing)}")


def served_desk() -> Desk:
    """Return the desk that the page shows; the notebook asks for it.

    Raises
    ------
    StepError
        If the notebook was opened by itself.
    """
    if not _served:
        raise StepError("This page shows a capture's desk, and there is none: open it by `deskew edit CAPTURE`.")
    return _served[-1]


def bound(port: int) -> socket.socket:
    """Take a port of 127.0.0.1, any free one if that is in use or 0."""
    for wanted in (port, 0):
        server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with suppress(OSError):
            server.bind((HOST, wanted))
            return server
        server.close()
    raise StepError(f"Serving the editor failed: no port of {HOST} is free; close a program and try again.")


def serve(desk: Desk, port: int, ready: Callable[[str], None]) -> None:
    """Serve a desk's page until the process is interrupted.

    Parameters
    ----------
    desk : Desk
        What the page shows.
    port : int
        Of 127.0.0.1; another one is taken if it is in use.
    ready : callable
        Is given the page's address, with its token, once the server listens.

    Raises
    ------
    StepError
        If no port is free.
    """
    import uvicorn

    listening = bound(port)
    port = listening.getsockname()[1]
    token = secrets.token_urlsafe(32)
    inner: list[Any] = []
    application = Gate(_application(token, port, inner), port)
    config = uvicorn.Config(application, log_level="critical", timeout_graceful_shutdown=1, lifespan="off")
    server = uvicorn.Server(config)
    listening.listen()  # what the browser asks from now on waits until the server runs
    _served.append(desk)
    try:
        ready(f"http://{HOST}:{port}/?access_token={token}")
        with suppress(KeyboardInterrupt):  # the server has ended by then, and raises it once more
            server.run(sockets=[listening])
    finally:
        _served.remove(desk)
        for notebook in inner:
            asyncio.run(notebook.state.session_manager.shutdown())  # else its threads would be waited for
        listening.close()


def _application(token: str, port: int, inner: list[Any]) -> Any:
    """Make marimo's application; the notebook's own one goes to `inner`."""
    import marimo

    def noted(notebook: Any) -> Any:
        notebook.state.port = port  # two editors on one machine then keep their cookies apart
        inner.append(notebook)
        return notebook

    page = Path(__file__).parent / "page.py"
    style = (_STATIC / "page.css").read_text(encoding="utf-8")
    builder = marimo.create_asgi_app(quiet=True, token=token, html_head=f"<style>{style}</style>")
    return builder.with_app(path="", root=str(page), middleware=[noted]).build()
