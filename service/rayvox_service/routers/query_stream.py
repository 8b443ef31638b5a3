"""WS /maps/{map_name}/queries: questions in, answers out, in order."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.websockets import WebSocket

from rayvox_service.query_session import QuerySession
from rayvox_service.service import map_of, service_of

router = APIRouter(tags=["queries"])


@router.websocket("/maps/{map_name}/queries")
async def query_stream(websocket: WebSocket) -> None:
    """The map is looked up before the handshake ends, so that its errors are plain HTTP answers."""
    map_of(websocket)
    await QuerySession(websocket, service_of(websocket), websocket.path_params["map_name"]).run()
