"""Who may speak to the server at all, before anyone asks for a token: this machine's own browser, by this page's name.

A page of another site can make a browser send requests to 127.0.0.1. It cannot make it tell a false Host or Origin: a
name that was rebound to 127.0.0.1 shows in the Host, another site or port in the Origin. Both are refused.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]


class Gate:
    """An ASGI application round another one.

    Parameters
    ----------
    inner : ASGI application
        What is behind the gate.
    port : int
        Of the server on 127.0.0.1.
    """

    def __init__(self, inner: Application, port: int) -> None:
        self._inner = inner
        self._hosts = {f"127.0.0.1:{port}".encode(), f"localhost:{port}".encode()}
        self._origins = {b"http://" + host for host in self._hosts}
        # What the browser must not do even if the page asked it to: load from, or speak to, anything but this server.
        sockets = b" ".join(b"ws://" + host for host in sorted(self._hosts))
        policy = (
            b"default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' data: blob: "
            + sockets
            + b"; form-action 'self'; frame-ancestors 'none'"
        )
        self._headers = [(b"content-security-policy", policy), (b"referrer-policy", b"no-referrer")]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or refuse it with 403."""
        if scope["type"] not in ("http", "websocket"):
            await self._inner(scope, receive, send)
        elif self._is_own(scope):
            await self._inner(scope, receive, self._with_policy(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await send({"type": "http.response.start", "status": 403, "headers": [(b"content-type", b"text/plain")]})
            await send({"type": "http.response.body", "body": b"Open the address that `deskew edit` has printed.\n"})

    def _is_own(self, scope: Scope) -> bool:
        headers = list(scope["headers"])
        hosts = [value for name, value in headers if name == b"host"]
        origins = [value for name, value in headers if name == b"origin"]
        return len(hosts) == 1 and hosts[0] in self._hosts and all(origin in self._origins for origin in origins)

    def _with_policy(self, send: Send) -> Send:
        async def sent(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", []), *self._headers]}
            await send(message)

        return sent
