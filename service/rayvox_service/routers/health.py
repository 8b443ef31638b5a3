"""Is the process alive, are its maps restored, and what is it."""

from __future__ import annotations

import rayvox
from fastapi import APIRouter, Request

from rayvox_service import __version__
from rayvox_service.problems import Problem
from rayvox_service.service import service_of

router = APIRouter(tags=["health"])


@router.get("/health")
async def health() -> dict[str, str]:
    """Alive: the event loop answers."""
    return {"status": "ok"}


@router.get("/ready")
async def ready(request: Request) -> dict[str, str]:
    """Ready: every map and robot that was on disk is restored, or known to be damaged."""
    service = service_of(request)
    if not (service.store.ready and service.robots.ready):
        raise Problem("unavailable", "maps and robots are being restored")
    return {"status": "ready"}


@router.get("/version")
async def version() -> dict[str, str]:
    return {"service": __version__, "kernel": rayvox.__version__, "api": "v1"}
