"""Collisions and motions of a robot in a map. A frame is answered by a frame, JSON by JSON."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response

from rayvox_service.answers import (
    answer_collisions,
    answer_json_collisions,
    answer_json_motions,
    answer_motions,
)
from rayvox_service.routers.query_exchange import MinRevision, Timeout, answer_query

router = APIRouter(tags=["collisions"])


@router.post("/maps/{map_name}/collisions")
async def collisions(request: Request, min_revision: MinRevision = None, timeout_s: Timeout = None) -> Response:
    """Per pose 0 free, 1 occupied, 2 unknown space met (where that counts)."""
    return await answer_query(request, min_revision, timeout_s, answer_collisions, answer_json_collisions)


@router.post("/maps/{map_name}/motions")
async def motions(request: Request, min_revision: MinRevision = None, timeout_s: Timeout = None) -> Response:
    """Per motion the verdict of where it first collides, and up to where it is free."""
    return await answer_query(request, min_revision, timeout_s, answer_motions, answer_json_motions)
