"""The ASGI application: routes under /v1, every error a problem document."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError, WebSocketRequestValidationError
from rayvox.errors import RayvoxError
from starlette.exceptions import HTTPException

from rayvox_service import __version__
from rayvox_service.auth import ApiKeyGuard
from rayvox_service.frame import FrameError
from rayvox_service.map_store import MapStore
from rayvox_service.problems import Problem, answer_error, answer_http_exception, answer_validation_error
from rayvox_service.robot_store import RobotStore
from rayvox_service.routers import collisions, export, health, maps, queries, query_stream, robots, scans, stream
from rayvox_service.service import Service
from rayvox_service.settings import Settings

PREFIX = "/v1"


def create_app(settings: Settings, store: MapStore | None = None) -> FastAPI:
    """An application over `store`, or over `settings.data_dir`, which it then takes for itself when it starts up.

    Maps are restored in the background: /v1/health answers at once, /v1/ready when all are there.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        opened = store or MapStore(settings)
        robot_store = RobotStore(settings)
        with ThreadPoolExecutor(settings.query_threads, "query") as pool:
            app.state.service = Service(settings, opened, pool, robot_store)
            restoring = asyncio.create_task(_restore(opened, robot_store))
            try:
                yield
            finally:
                opened.stop_opening()
                robot_store.stop_opening()
                await restoring
                await asyncio.to_thread(opened.close)

    app = FastAPI(
        title="rayvox",
        version=__version__,
        lifespan=lifespan,
        openapi_url=f"{PREFIX}/openapi.json",
        # The pages that FastAPI would serve load their scripts from the internet.
        docs_url=None,
        redoc_url=None,
    )
    for module in (scans, stream, queries, query_stream, collisions, maps, robots, export, health):
        app.include_router(module.router, prefix=PREFIX)
    for error in (Problem, FrameError, RayvoxError, OSError, Exception):
        app.add_exception_handler(error, answer_error)
    app.add_exception_handler(RequestValidationError, answer_validation_error)
    app.add_exception_handler(WebSocketRequestValidationError, answer_validation_error)
    app.add_exception_handler(HTTPException, answer_http_exception)
    app.add_middleware(scans.ScanShortcut, prefix=PREFIX)
    # Added last, so in front of it.
    if settings.api_key is not None:
        app.add_middleware(ApiKeyGuard, api_key=settings.api_key.get_secret_value())
    return app


async def _restore(store: MapStore, robot_store: RobotStore) -> None:
    await asyncio.to_thread(store.open_all)
    await asyncio.to_thread(robot_store.open_all)
