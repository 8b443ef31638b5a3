"""Robots: upload, list, inspect, delete."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response

from rayvox_service.checked_fields import check_fields
from rayvox_service.names import check_name
from rayvox_service.request_body import RequestBody
from rayvox_service.robot_config import ROBOT_TYPES, RobotConfig
from rayvox_service.robot_store import sha256_of
from rayvox_service.service import service_of

router = APIRouter(tags=["robots"])
_OPTIONS = ("scale", "geometry", "description")


@router.put("/robots/{robot_name}")
async def put_robot(request: Request) -> JSONResponse:
    """PUT /robots/{robot_name}?scale=1&geometry=collision|visual&description=robot.urdf"""
    service = service_of(request)
    name = check_name("robot", request.path_params["robot_name"])
    incoming = RequestBody(request.scope, request.receive)
    file_format = ROBOT_TYPES[incoming.media_type(tuple(ROBOT_TYPES))]
    body = bytes(await incoming.read(service.settings.max_body_bytes, service.settings.body_timeout_s))
    options = {key: request.query_params[key] for key in _OPTIONS if key in request.query_params}
    upload = {"name": name, "format": file_format, "sha256": sha256_of(body), "nbytes": len(body)}
    config = check_fields({**options, **upload}, RobotConfig)
    stored, new = await asyncio.to_thread(service.robots.put, config, body)
    return JSONResponse(stored.info(), 201 if new else 200, {"Location": f"/v1/robots/{name}"})


@router.get("/robots")
async def list_robots(request: Request) -> dict[str, Any]:
    return {"robots": service_of(request).robots.summaries()}


@router.get("/robots/{robot_name}")
async def robot_info(request: Request) -> Response:
    stored = service_of(request).robots.get(request.path_params["robot_name"])
    return Response(json.dumps(stored.info(), allow_nan=False), media_type="application/json")


@router.delete("/robots/{robot_name}")
async def delete_robot(request: Request) -> Response:
    await asyncio.to_thread(service_of(request).robots.delete, request.path_params["robot_name"])
    return Response(status_code=204)
