"""What every route needs: the settings, the maps, the robots, and the threads that queries run in."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from rayvox import CancellationToken
from starlette.requests import HTTPConnection

from rayvox_service.hosted_map import HostedMap
from rayvox_service.map_store import MapStore
from rayvox_service.problems import Problem
from rayvox_service.robot_store import RobotStore
from rayvox_service.settings import Settings
from rayvox_service.steps import CancellableSteps, Unfinished, advance

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Service:
    settings: Settings
    store: MapStore
    query_pool: ThreadPoolExecutor
    robots: RobotStore

    async def query(self, work: Callable[[], T]) -> T:
        """Run reading work in the query threads: the event loop and the writers go on meanwhile."""
        return await asyncio.get_running_loop().run_in_executor(self.query_pool, work)

    async def query_in_steps(self, work: CancellableSteps[T]) -> T:
        """As `query`. Every step queues behind what came meanwhile, so that all unfinished queries take turns; who
        stops waiting cancels the work.
        """
        cancellation = CancellationToken()
        steps = work(cancellation)
        try:
            while isinstance(answer := await self.query(partial(advance, steps)), Unfinished):
                pass
            return answer
        finally:
            cancellation.cancel()

    async def await_revision(self, hosted: HostedMap, min_revision: int | None, timeout_s: float | None) -> None:
        """Wait until a query would see `min_revision`. Raises Problem timeout."""
        if min_revision is not None:
            reached = hosted.writer.revision.reached(min_revision)
            await self.wait(reached, timeout_s, f"revision {min_revision} was not reached")

    async def wait(
        self, future: Future[T], timeout_s: float | None, what: str, begin: Callable[[], object] | None = None
    ) -> T:
        """The future's result. `begin` starts what will set it: last, so that the thread which that wakes up finds the
        interpreter free. Raises Problem timeout."""
        limit_s = min(timeout_s or self.settings.wait_s, self.settings.wait_s)
        waiting = asyncio.wrap_future(future)
        try:
            async with asyncio.timeout(limit_s):
                if begin is not None:
                    begin()
                return await waiting
        except TimeoutError:
            raise Problem("timeout", f"{what} within {limit_s:g} s") from None


def service_of(connection: HTTPConnection) -> Service:
    service = connection.app.state.service
    assert isinstance(service, Service)
    return service


def map_of(connection: HTTPConnection) -> HostedMap:
    """The map that the address names. Raises Problem."""
    return service_of(connection).store.get(connection.path_params["map_name"])
