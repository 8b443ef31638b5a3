"""One stream connection, while it lasts. Nothing of it outlives the socket: scan ids make resuming idempotent."""

from __future__ import annotations

import asyncio
import logging
from functools import partial
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from rayvox_service.changes import changes_frame
from rayvox_service.frame import Bytes
from rayvox_service.hosted_map import HostedMap
from rayvox_service.problems import Problem, as_problem
from rayvox_service.service import Service
from rayvox_service.submission import Submission

CLOSE_BROKEN_FRAME = 1007
CLOSE_REFUSED = 1008
# The map went away or gave up: nothing that the sender sent now could be taken.
CLOSING_SLUGS = {"invalid-frame": CLOSE_BROKEN_FRAME, "map-not-found": CLOSE_REFUSED}
ROOM_POLL_S = 0.02

log = logging.getLogger(__name__)


class StreamSession:
    """Three tasks: *receive* queues scans, *acknowledge* answers them in order, *publish* sends changes."""

    def __init__(self, websocket: WebSocket, service: Service, hosted: HostedMap) -> None:
        self._socket = websocket
        self._service = service
        self._hosted = hosted
        self._max_in_flight = service.settings.max_in_flight
        self._slots = asyncio.Semaphore(self._max_in_flight)
        self._unanswered: asyncio.Queue[Submission] = asyncio.Queue()

    async def run(self, changes_since: int | None) -> None:
        """Until either side closes. `changes_since`: the subscriber's revision, None for no subscription."""
        await self._socket.accept()
        await self._socket.send_json(
            {
                "type": "opened",
                "max_in_flight": self._max_in_flight,
                "revision": self._hosted.published.revision,
                "last_sequence": self._hosted.writer.last_sequence,
            }
        )
        jobs = [self._receive(), self._acknowledge()]
        if changes_since is not None:
            jobs.append(self._publish(changes_since))
        tasks = [asyncio.create_task(job) for job in jobs]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        for task in done:
            await self._end(task.exception())

    async def _end(self, error: BaseException | None) -> None:
        if error is None or isinstance(error, (WebSocketDisconnect, asyncio.CancelledError)):
            return
        if not isinstance(error, Exception):
            raise error
        try:
            problem = as_problem(error)
            await self._send_error(None, problem)
            await self._socket.close(CLOSING_SLUGS.get(problem.slug, 1011), problem.slug)
        except (WebSocketDisconnect, RuntimeError):
            # The socket was closed from the other side or by another task meanwhile: nobody is left to tell.
            return

    async def _receive(self) -> None:
        while True:
            # Not reading is what holds a fast sender back: TCP passes it on.
            await self._slots.acquire()
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                raise WebSocketDisconnect(message.get("code", 1005))
            data = message.get("bytes")
            if data is None:
                await self._refuse_text()
                return
            self._unanswered.put_nowait(await self._submit(data))

    async def _refuse_text(self) -> None:
        await self._send_error(None, Problem("invalid-frame", "scans are sent as binary messages"))
        await self._socket.close(CLOSE_REFUSED, "invalid-frame")

    async def _submit(self, data: Bytes) -> Submission:
        while True:
            try:
                return self._hosted.writer.submit_scan(data, find_robot=self._service.robots.get)
            except Problem as problem:
                if problem.slug != "overloaded":
                    raise
            await asyncio.sleep(ROOM_POLL_S)

    async def _acknowledge(self) -> None:
        while True:
            submission = await self._unanswered.get()
            try:
                receipt = await asyncio.wrap_future(submission.journaled)
            except Problem as problem:
                scan_id = None if submission.scan_id is None else str(submission.scan_id)
                await self._send_error(scan_id, problem)
                if problem.slug in CLOSING_SLUGS:
                    await self._socket.close(CLOSING_SLUGS[problem.slug], problem.slug)
                    return
            else:
                await self._socket.send_json(
                    {
                        "type": "ack",
                        "scan_id": str(receipt.scan_id),
                        "sequence": receipt.sequence,
                        "duplicate": receipt.duplicate,
                    }
                )
            self._slots.release()

    async def _publish(self, sent: int) -> None:
        """At most one change is under way: a slow subscriber gets fewer and larger ones, the writer never waits."""
        # A copy that is ahead of the map belongs to another life of it; everything is sent anew.
        target = 0 if sent > self._hosted.published.revision else sent + 1
        while True:
            await asyncio.wrap_future(self._hosted.writer.revision.reached(target))
            content, sent = await self._service.query(partial(self._changes, sent))
            await self._socket.send_bytes(content)
            target = sent + 1

    def _changes(self, since: int) -> tuple[bytes, int]:
        return changes_frame(self._hosted.snapshot(), since)

    async def _send_error(self, scan_id: str | None, problem: Problem) -> None:
        document: dict[str, Any] = problem.document(self._socket.url.path)
        await self._socket.send_json({"type": "error", "scan_id": scan_id, "problem": document})
