"""Collisions of a robot with a map. A frame is answered by a frame, JSON by JSON."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Request
from fastapi import Query as Parameter
from fastapi.responses import Response

from rayvox_service import frame
from rayvox_service.collision_query import (
    CollisionQuery,
    JsonCollisionQuery,
    check_as_frame,
    check_as_json,
    check_collisions,
    poses_of_frame,
)
from rayvox_service.frame import Bytes
from rayvox_service.hosted_map import HostedMap
from rayvox_service.request_body import JSON, RequestBody, check_fields, parse_json
from rayvox_service.service import Service, map_of, service_of

router = APIRouter(tags=["collisions"])


@router.post("/maps/{map_name}/collisions")
async def collisions(
    request: Request,
    min_revision: Annotated[int | None, Parameter(ge=0, lt=1 << 62, description="wait until the map is so new")] = None,
    timeout_s: Annotated[float | None, Parameter(gt=0, allow_inf_nan=False, description="seconds to wait")] = None,
) -> Response:
    """Per pose 0 free, 1 occupied, 2 unknown space met (where that counts)."""
    service, hosted = service_of(request), map_of(request)
    settings, incoming = service.settings, RequestBody(request.scope, request.receive)
    media = incoming.media_type((JSON, frame.MEDIA_TYPE))
    max_bytes = settings.max_json_bytes if media == JSON else settings.max_body_bytes
    body = await incoming.read(max_bytes, settings.body_timeout_s)
    await service.await_revision(hosted, min_revision, timeout_s)
    content = await service.query(lambda: _compute(service, hosted, media, body))
    return Response(content, media_type=media)


def _compute(service: Service, hosted: HostedMap, media: str, body: Bytes) -> bytes:
    """Runs in a query thread: neither parsing nor checking may hold up the event loop."""
    settings = service.settings
    if media == JSON:
        asked = parse_json(body, JsonCollisionQuery)
        poses = asked.poses()
        poses.require_at_most(settings.max_poses)
        robot = service.robots.get(asked.robot).robot
        return check_as_json(check_collisions(asked, poses, robot, hosted.snapshot()))
    decoded = frame.decode_frame(body, settings.frame_limits)
    query = check_fields(decoded.fields, CollisionQuery)
    poses = poses_of_frame(decoded, settings.max_poses)
    robot = service.robots.get(query.robot).robot
    return check_as_frame(check_collisions(query, poses, robot, hosted.snapshot()))
