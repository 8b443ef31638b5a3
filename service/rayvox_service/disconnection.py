"""Requests whose client hangs up before it is answered."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

from starlette.types import Receive

from rayvox_service.problems import Problem

T = TypeVar("T")


async def while_connected(receive: Receive, answering: Coroutine[Any, Any, T]) -> T:
    """The answer; it is given up when the client goes. To be called when the whole body was read.

    Raises Problem cancelled.
    """
    answer = asyncio.create_task(answering)
    gone = asyncio.create_task(_disconnected(receive))
    try:
        await asyncio.wait((answer, gone), return_when=asyncio.FIRST_COMPLETED)
        if not answer.done():
            raise Problem("cancelled", "the client went away before it was answered")
        return answer.result()
    finally:
        for task in (answer, gone):
            task.cancel()
        await asyncio.gather(answer, gone, return_exceptions=True)


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
