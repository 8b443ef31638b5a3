"""Collisions of a robot with a map. A frame is answered by a frame, JSON by JSON."""

from __future__ import annotations

from fastapi import APIRouter, Request
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
from rayvox_service.request_body import JSON, check_fields, parse_json
from rayvox_service.routers.query_exchange import MinRevision, Timeout, answer_query
from rayvox_service.service import Service

router = APIRouter(tags=["collisions"])


@router.post("/maps/{map_name}/collisions")
async def collisions(request: Request, min_revision: MinRevision = None, timeout_s: Timeout = None) -> Response:
    """Per pose 0 free, 1 occupied, 2 unknown space met (where that counts)."""
    return await answer_query(request, min_revision, timeout_s, _compute)


def _compute(service: Service, hosted: HostedMap, media: str, body: Bytes) -> bytes:
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
