"""API key check in front of everything but health and readiness."""

from __future__ import annotations

import hmac

from starlette.types import ASGIApp, Receive, Scope, Send

from rayvox_service.problems import Problem

OPEN_PATHS = ("/v1/health", "/v1/ready")


class ApiKeyGuard:
    """ASGI middleware: `Authorization: Bearer <key>` on HTTP and on the WebSocket handshake."""

    def __init__(self, app: ASGIApp, api_key: str) -> None:
        self._app = app
        self._expected = f"Bearer {api_key}".encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan" or scope["path"] in OPEN_PATHS or self._is_allowed(scope):
            await self._app(scope, receive, send)
            return
        problem = Problem("unauthorized", "send the header 'Authorization: Bearer <API key>'")
        # Before a WebSocket is accepted, a Response is sent as the handshake's HTTP answer.
        await problem.response(scope["path"])(scope, receive, send)

    def _is_allowed(self, scope: Scope) -> bool:
        given = [value for name, value in scope["headers"] if name == b"authorization"]
        return len(given) == 1 and hmac.compare_digest(given[0], self._expected)
