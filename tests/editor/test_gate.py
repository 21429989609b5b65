"""Who may speak to the server: a browser that was led here by another site, or by a rebound name, may not."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from deskew.editor.gate import Gate

OWN = {"host": "127.0.0.1:2718"}


def asked(kind: str, headers: dict[str, str] | list[tuple[str, str]]) -> tuple[bool, list[dict[str, Any]]]:
    """Send a request; whether it came through, and what was answered."""
    through, sent = [], []

    async def inner(scope: Any, receive: Any, send: Any) -> None:
        through.append(scope)
        await send({"type": "http.response.start", "status": 200, "headers": [(b"x", b"y")]})

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        raise AssertionError("nothing is read")

    pairs = headers.items() if isinstance(headers, dict) else headers
    scope = {"type": kind, "headers": [(name.encode(), value.encode()) for name, value in pairs]}
    asyncio.run(Gate(inner, 2718)(scope, receive, send))
    return bool(through), sent


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "headers",
    [
        OWN,
        {"host": "localhost:2718"},
        {**OWN, "origin": "http://127.0.0.1:2718"},
        {**OWN, "origin": "http://localhost:2718"},
    ],
)
def test_the_page_itself_comes_through(kind: str, headers: dict[str, str]) -> None:
    through, _ = asked(kind, headers)
    assert through


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"host": "rebound.example:2718"},
        {"host": "127.0.0.1"},
        {"host": "127.0.0.1:2719"},
        {**OWN, "origin": "https://other.example"},
        {**OWN, "origin": "http://127.0.0.1:8888"},
        {**OWN, "origin": "null"},
        [("host", "127.0.0.1:2718"), ("host", "rebound.example")],
    ],
)
def test_other_names_sites_and_ports_are_refused(kind: str, headers: Any) -> None:
    through, sent = asked(kind, headers)
    assert not through
    assert sent[0] == {"type": "websocket.close", "code": 1008} if kind == "websocket" else sent[0]["status"] == 403


def test_the_browser_is_told_to_load_from_nowhere_else() -> None:
    _, sent = asked("http", OWN)
    headers = dict(sent[0]["headers"])
    assert headers[b"x"] == b"y"
    assert b"default-src 'self'" in headers[b"content-security-policy"]
    assert b"http" not in headers[b"content-security-policy"]


def test_what_is_no_request_passes() -> None:
    through, _ = asked("lifespan", {})
    assert through
