"""Maps: create, list, inspect, delete, clear a box."""

from __future__ import annotations

import asyncio
import dataclasses
from typing import Annotated, Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel, ConfigDict, Field

from rayvox_service.hosted_map import HostedMap
from rayvox_service.map_config import NewMap
from rayvox_service.request_body import read_json
from rayvox_service.service import map_of, service_of

router = APIRouter(tags=["maps"])

Coordinate = Annotated[float, Field(allow_inf_nan=False)]


class Box(BaseModel):
    """Corners in metres, map frame."""

    model_config = ConfigDict(extra="forbid")

    lo: tuple[Coordinate, Coordinate, Coordinate]
    hi: tuple[Coordinate, Coordinate, Coordinate]


@router.post("/maps")
async def create_map(request: Request) -> JSONResponse:
    wanted, settings = await read_json(request, NewMap), service_of(request).settings
    config = wanted.with_defaults(settings.map_resolution_m, settings.map_depth, settings.insertion)
    info = await asyncio.to_thread(lambda: service_of(request).store.create(config).info())
    return JSONResponse(info, 201, {"Location": f"/v1/maps/{config.name}"})


@router.get("/maps")
async def list_maps(request: Request) -> dict[str, Any]:
    service = service_of(request)
    infos = await service.query(lambda: [hosted.info() for hosted in service.store.all()])
    return {"maps": infos + service.store.failures()}


@router.get("/maps/{map_name}")
async def map_info(request: Request, statistics: bool = False) -> dict[str, Any]:
    hosted = map_of(request)
    return await service_of(request).query(lambda: _info(hosted, statistics))


@router.delete("/maps/{map_name}")
async def delete_map(request: Request) -> Response:
    await asyncio.to_thread(service_of(request).store.delete, request.path_params["map_name"])
    return Response(status_code=204)


@router.post("/maps/{map_name}/clear")
async def clear_box(request: Request) -> dict[str, int | None]:
    """Make a box unknown again; journaled and applied in order with the scans."""
    hosted, service = map_of(request), service_of(request)
    box = await read_json(request, Box)
    receipt = await service.wait(hosted.writer.submit_clear(box.lo, box.hi).applied, None, "the box was not cleared")
    return {"revision": receipt.revision, "sequence": receipt.sequence}


def _info(hosted: HostedMap, statistics: bool) -> dict[str, Any]:
    if not statistics:
        return hosted.info()
    return hosted.info() | {"statistics": dataclasses.asdict(hosted.snapshot().statistics())}
