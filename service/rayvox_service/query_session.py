"""One connection for questions, while it lasts: query frames in, one answer each, in order."""

from __future__ import annotations

import asyncio
from typing import Annotated

from pydantic import BaseModel, Field
from rayvox import CancellationToken
from starlette.websockets import WebSocket, WebSocketDisconnect

from rayvox_service.answers import answer_frame
from rayvox_service.checked_fields import check_fields
from rayvox_service.frame import Bytes, Frame, decode_frame
from rayvox_service.problems import Problem, as_problem
from rayvox_service.service import Service
from rayvox_service.steps import Steps

CLOSE_REFUSED = 1008


class _Freshness(BaseModel):
    """What HTTP has in the address: fields that any question may bring."""

    min_revision: Annotated[int | None, Field(ge=0, lt=1 << 62)] = None
    timeout_s: Annotated[float | None, Field(gt=0, allow_inf_nan=False)] = None


class QuerySession:
    """Two tasks: *receive* queues messages, *answer* answers one after the other.

    One question of a connection is worked on at a time, so that no client gets more than its turn. Receiving never
    stops: it is how the service learns that the client is gone, and with it the reason to go on.
    """

    def __init__(self, websocket: WebSocket, service: Service, map_name: str) -> None:
        self._socket = websocket
        self._service = service
        self._map_name = map_name
        self._unanswered: asyncio.Queue[Bytes | None] = asyncio.Queue()
        self._in_flight = 0

    async def run(self) -> None:
        """Until either side closes."""
        most = self._service.settings.max_in_flight
        await self._socket.accept()
        revision = self._service.store.get(self._map_name).published.revision
        await self._socket.send_json({"type": "opened", "max_in_flight": most, "revision": revision})
        tasks = [asyncio.create_task(job) for job in (self._receive(most), self._answer())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        for task in done:
            error = task.exception()
            # RuntimeError: the socket was closed by the other task meanwhile.
            if error is not None and not isinstance(error, (WebSocketDisconnect, RuntimeError)):
                raise error

    async def _receive(self, most: int) -> None:
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if self._in_flight == most:
                problem = Problem("overloaded", f"{most} questions may be unanswered at a time")
                await self._send_error(problem)
                await self._socket.close(CLOSE_REFUSED, problem.slug)
                return
            self._in_flight += 1
            self._unanswered.put_nowait(message.get("bytes"))

    async def _answer(self) -> None:
        while True:
            data = await self._unanswered.get()
            try:
                answer = await self._answer_to(data)
            except Exception as error:
                await self._send_error(as_problem(error))
            else:
                await self._socket.send_bytes(answer)
            self._in_flight -= 1

    async def _answer_to(self, data: Bytes | None) -> bytes:
        if data is None:
            raise Problem("invalid-frame", "questions are sent as binary messages")
        hosted = self._service.store.get(self._map_name)
        limits = self._service.settings.frame_limits
        question, fresh = await self._service.query(lambda: _opened(decode_frame(data, limits)))
        await self._service.await_revision(hosted, fresh.min_revision, fresh.timeout_s)

        def steps(cancellation: CancellationToken) -> Steps[bytes]:
            return answer_frame(self._service, hosted, question, cancellation)

        return await self._service.query_in_steps(steps)

    async def _send_error(self, problem: Problem) -> None:
        await self._socket.send_json({"type": "error", "problem": problem.document(self._socket.url.path)})


def _opened(frame: Frame) -> tuple[Frame, _Freshness]:
    """The question, and how fresh its answer has to be. Raises Problem."""
    wanted = {name: frame.fields.pop(name) for name in _Freshness.model_fields if name in frame.fields}
    return frame, check_fields(wanted, _Freshness)
