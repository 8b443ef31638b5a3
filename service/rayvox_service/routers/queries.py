"""Questions to a map: points, boxes, rays. A frame is answered by a frame, JSON by JSON."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Request
from fastapi.responses import Response

from rayvox_service import frame
from rayvox_service.answers import answer_json_rows, answer_rows
from rayvox_service.depth_image import DepthImageQuery, depth_png
from rayvox_service.problems import Problem
from rayvox_service.queries import BoxesQuery, PointsQuery, Query, RaysQuery, answer_as_frame
from rayvox_service.request_body import read_json
from rayvox_service.routers.query_exchange import MinRevision, Timeout, answer_query
from rayvox_service.service import map_of, service_of

router = APIRouter(tags=["queries"])


@router.post("/maps/{map_name}/points")
async def points(request: Request, min_revision: MinRevision = None, timeout_s: Timeout = None) -> Response:
    """States (0 unknown, 1 free, 2 occupied) and log-odds at points."""
    return await _answer(request, PointsQuery, min_revision, timeout_s)


@router.post("/maps/{map_name}/boxes")
async def boxes(request: Request, min_revision: MinRevision = None, timeout_s: Timeout = None) -> Response:
    """2 where anything in the box is occupied, else 0 where anything is unknown, else 1."""
    return await _answer(request, BoxesQuery, min_revision, timeout_s)


@router.post("/maps/{map_name}/rays")
async def rays(request: Request, min_revision: MinRevision = None, timeout_s: Timeout = None) -> Response:
    """What each ray meets first, and where."""
    return await _answer(request, RaysQuery, min_revision, timeout_s)


@router.post("/maps/{map_name}/depth_image")
async def depth_image(
    request: Request,
    format: Literal["png", "frame"] = "png",
    min_revision: MinRevision = None,
    timeout_s: Timeout = None,
) -> Response:
    """What a depth camera at a pose would measure: a 16-bit PNG in millimetres, or a frame in metres."""
    service, hosted = service_of(request), map_of(request)
    asked = await read_json(request, DepthImageQuery)
    if asked.width * asked.height > service.settings.max_points:
        raise Problem("too-large", f"more than {service.settings.max_points} pixels")
    await service.await_revision(hosted, min_revision, timeout_s)

    def work() -> tuple[bytes, int]:
        snapshot = hosted.snapshot()
        depth_m = asked.render(snapshot)
        if format == "png":
            return depth_png(depth_m), snapshot.revision
        return answer_as_frame("depth_image", {"depth_m": depth_m}, snapshot.revision), snapshot.revision

    content, revision = await service.query(work)
    media = "image/png" if format == "png" else frame.MEDIA_TYPE
    return Response(content, media_type=media, headers={"Rayvox-Revision": str(revision)})


async def _answer(request: Request, kind: type[Query], min_revision: int | None, timeout_s: float | None) -> Response:
    return await answer_query(request, min_revision, timeout_s, answer_rows(kind), answer_json_rows(kind))
