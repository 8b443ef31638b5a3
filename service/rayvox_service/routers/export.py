"""The map out: changes since a revision, or the whole as a file."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from rayvox_service import frame
from rayvox_service.changes import changes_frame
from rayvox_service.service import map_of, service_of

router = APIRouter(tags=["export"])

FILE_TYPES = {"bt": "application/octet-stream", "ot": "application/octet-stream", "ply": "model/vnd.ply"}


@router.get("/maps/{map_name}/changes")
async def changes(request: Request, since: Annotated[int, Query(ge=0, lt=1 << 62)] = 0) -> Response:
    """A `changes` frame that brings a copy at revision `since` to the present."""
    hosted, service = map_of(request), service_of(request)
    content, revision = await service.query(lambda: changes_frame(hosted.snapshot(), since))
    return Response(content, media_type=frame.MEDIA_TYPE, headers={"Rayvox-Revision": str(revision)})


@router.get("/maps/{map_name}/export")
async def export(request: Request, format: Literal["bt", "ot", "ply"]) -> Response:
    """OctoMap's .bt or .ot, or the occupied leaves' centres as .ply."""
    hosted, service = map_of(request), service_of(request)

    def work() -> tuple[bytes, int]:
        snapshot = hosted.snapshot()
        return snapshot.export_bytes(format), snapshot.revision

    content, revision = await service.query(work)
    headers = {
        "Content-Disposition": f'attachment; filename="{hosted.config.name}.{format}"',
        "Rayvox-Revision": str(revision),
    }
    return Response(content, media_type=FILE_TYPES[format], headers=headers)
