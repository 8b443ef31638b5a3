"""WS /maps/{map_name}/stream: scans in with one acknowledgement each, the map's changes out."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from starlette.websockets import WebSocket

from rayvox_service.service import map_of, service_of
from rayvox_service.stream_session import StreamSession

router = APIRouter(tags=["stream"])


@router.websocket("/maps/{map_name}/stream")
async def stream(
    websocket: WebSocket, subscribe: bool = False, since: Annotated[int, Query(ge=0, lt=1 << 62)] = 0
) -> None:
    """The map is looked up before the handshake ends, so that its errors are plain HTTP answers."""
    session = StreamSession(websocket, service_of(websocket), map_of(websocket))
    await session.run(since if subscribe else None)
