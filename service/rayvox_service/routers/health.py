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
    """Ready: every map that was on disk is restored, or known to be damaged."""
    if not service_of(request).store.ready:
        raise Problem("unavailable", "maps are being restored")
    return {"status": "ready"}


@router.get("/version")
async def version() -> dict[str, str]:
    return {"service": __version__, "kernel": rayvox.__version__, "api": "v1"}
