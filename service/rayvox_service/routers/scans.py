"""Scans in: the hot path, so a plain route without models between the socket and the map's writer."""

from __future__ import annotations

import asyncio
import json
from functools import partial

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from rayvox_service import frame
from rayvox_service.map_writer import MapWriter
from rayvox_service.point_cloud_file import POINT_CLOUD_TYPES, point_cloud_to_frame
from rayvox_service.problems import Problem
from rayvox_service.request_body import JSON, announced_bytes, media_type, read_body
from rayvox_service.scan import KIND, parse_scan_id
from rayvox_service.service import Service, map_of, service_of
from rayvox_service.submission import Receipt, Submission

router = APIRouter(tags=["scans"])
ACCEPTED = (frame.MEDIA_TYPE, *POINT_CLOUD_TYPES)


async def put_scan(request: Request) -> Response:
    """PUT /maps/{map_name}/scans/{scan_id}?wait=journaled|applied"""
    service, hosted = service_of(request), map_of(request)
    scan_id = parse_scan_id(request.path_params["scan_id"])
    wait = request.query_params.get("wait", "journaled")
    if wait not in ("journaled", "applied"):
        raise Problem("invalid-input", f"wait is journaled or applied, not {wait[:40]!r}")
    media = media_type(request, ACCEPTED)
    hosted.writer.check_room(announced_bytes(request))
    body = await read_body(request, service.settings.max_body_bytes)
    if media != frame.MEDIA_TYPE:
        parameters = dict(request.query_params)
        max_points = service.settings.max_points
        body = await asyncio.to_thread(point_cloud_to_frame, media, bytes(body), scan_id, parameters, max_points)
    receipt = await _insert(service, hosted.writer, Submission(KIND, body, scan_id), wait)
    return Response(json.dumps(receipt.document()), 200 if receipt.duplicate else 201, media_type=JSON)


async def _insert(service: Service, writer: MapWriter, submission: Submission, wait: str) -> Receipt:
    begin = partial(writer.submit, submission)
    if wait == "journaled":
        return await service.wait(submission.journaled, None, "the scan was not journaled", begin)
    try:
        return await service.wait(submission.applied, None, "the scan was not applied", begin)
    except Problem as problem:
        # On disk is on disk: the sender need not send it again, only wait longer.
        if problem.slug != "timeout" or not submission.journaled.done():
            raise
        return submission.journaled.result()


router.add_route("/maps/{map_name}/scans/{scan_id}", put_scan, methods=["PUT"])
