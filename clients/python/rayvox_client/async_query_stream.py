"""A connection for many questions to one map, for asyncio; also the one place where its behaviour is written down."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any, Generic, Self, TypeVar, Unpack

from numpy.typing import ArrayLike

from rayvox_client.collisions import CollisionCheck, MotionCheck
from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import (
    ConnectionFailedError,
    MalformedAnswerError,
    RayvoxClientError,
    RefusedInputError,
    TooLargeError,
)
from rayvox_client.fields import Fields
from rayvox_client.frame import decode_frame
from rayvox_client.http_message import problem_from_fields
from rayvox_client.question import Question
from rayvox_client.retry import RetryPolicy
from rayvox_client.robot_info import RobotInfo
from rayvox_client.robot_question import CheckOptions, MotionOptions, check_question, motion_question
from rayvox_client.transport import MessageStream, StreamRefusedError, Transport

T = TypeVar("T")
TOO_LARGE_CLOSE_CODE = 1009


class AsyncPendingAnswer(Generic[T]):
    """The answer to a question that was sent."""

    def __init__(self, stream: AsyncQueryStream, question: Question[T]) -> None:
        self._stream = stream
        self._question = question
        self._answer: T | RayvoxClientError | None = None
        self.message = question.to_message()

    @property
    def done(self) -> bool:
        """Whether it is there."""
        return self._answer is not None

    def settle(self, message: bytes | RayvoxClientError) -> None:
        """Take the service's answer, which may be an error of this question alone."""
        try:
            self._answer = self._question.read(decode_frame(message)) if isinstance(message, bytes) else message
        except MalformedAnswerError as error:
            self._answer = error

    async def result(self) -> T:
        """Wait for it. Raises the question's typed error; ConnectionFailedError when the retries are used up."""
        await self._stream.run_until(lambda: self.done)
        if isinstance(self._answer, RayvoxClientError):
            raise self._answer
        assert self._answer is not None
        return self._answer


class AsyncQueryStream:
    """Questions to one map over a WebSocket, without a request's overhead, answered in their order.

    A broken connection is opened again and what is unanswered is asked again. An error of one question leaves the
    others alone. One task at a time.
    """

    def __init__(
        self, transport: Transport, endpoint: Endpoint, policy: RetryPolicy, timeout_s: float, map_name: str
    ) -> None:
        self._transport = transport
        self._endpoint = endpoint
        self._policy = policy
        self._timeout_s = timeout_s
        self._map_name = map_name
        self._target = endpoint.map_target(map_name, "queries")
        self._socket: MessageStream | None = None
        self._attempts = policy.start()
        self._max_in_flight = 1
        self._unanswered: deque[AsyncPendingAnswer[Any]] = deque()
        self._unsent: deque[AsyncPendingAnswer[Any]] = deque()

    async def check(
        self,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[CheckOptions],
    ) -> CollisionCheck:
        """As `Client.check`."""
        return await (await self.send_check(robot, configurations, T_map_base, **options)).result()

    async def check_motion(
        self,
        robot: str | RobotInfo,
        q_from: ArrayLike | None,
        q_to: ArrayLike | None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[MotionOptions],
    ) -> MotionCheck:
        """As `Client.check_motion`."""
        return await (await self.send_check_motion(robot, q_from, q_to, T_map_base, **options)).result()

    async def send_check(
        self,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[CheckOptions],
    ) -> AsyncPendingAnswer[CollisionCheck]:
        """Send the question and go on; waits only while the service holds as many unanswered ones as it takes."""
        return await self._send(check_question(robot, configurations, T_map_base, options))

    async def send_check_motion(
        self,
        robot: str | RobotInfo,
        q_from: ArrayLike | None,
        q_to: ArrayLike | None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[MotionOptions],
    ) -> AsyncPendingAnswer[MotionCheck]:
        """As `send_check`."""
        return await self._send(motion_question(robot, q_from, q_to, T_map_base, options))

    async def _send(self, question: Question[T]) -> AsyncPendingAnswer[T]:
        pending = AsyncPendingAnswer(self, question)
        await self.run_until(lambda: self._socket is not None and len(self._unanswered) < self._max_in_flight)
        self._unanswered.append(pending)
        self._unsent.append(pending)
        await self.run_until(lambda: not self._unsent)
        return pending

    async def run_until(self, done: Callable[[], bool]) -> None:
        """Send what is due and take what arrives until `done`, through broken connections."""
        while True:
            try:
                socket = await self._open()
                while self._unsent:
                    await socket.send(self._unsent[0].message)
                    self._unsent.popleft()
                if done():
                    return
                message = await socket.receive(self._timeout_s)
                if message is None:
                    raise ConnectionFailedError(f"no answer from {self._endpoint.url} in {self._timeout_s} s")
                self._take(message)
                self._attempts = self._policy.start()
            except ConnectionFailedError as error:
                await self.close()
                await self._transport.sleep(self._attempts.delay_after(error))
            except StreamRefusedError as error:
                await self.close()
                detail = f"the service closed the connection: {error.reason}"
                if error.code == TOO_LARGE_CLOSE_CODE:
                    raise TooLargeError(413, "too-large", detail) from error
                raise RefusedInputError(400, "", detail) from error
            except MalformedAnswerError:
                await self.close()
                raise

    def _take(self, message: str | bytes) -> None:
        if not self._unanswered:
            raise MalformedAnswerError("an answer to no question")
        answer: bytes | RayvoxClientError
        if isinstance(message, bytes):
            answer = message
        else:
            fields = Fields.parse(message, "answer")
            if fields.text("type") != "error":
                raise MalformedAnswerError(f"message of unknown type {fields.text('type')!r}")
            answer = problem_from_fields(fields.nested("problem"))
        self._unanswered.popleft().settle(answer)

    async def _open(self) -> MessageStream:
        if self._socket is None:
            socket = await self._transport.open_messages(self._target)
            greeting = await socket.receive(self._timeout_s)
            if not isinstance(greeting, str):
                await socket.close()
                raise ConnectionFailedError(f"{self._endpoint.url} opened the connection and did not say so")
            fields = Fields.parse(greeting, "greeting")
            self._max_in_flight = max(1, fields.integer("max_in_flight"))
            self._socket, self._unsent = socket, deque(self._unanswered)
        return self._socket

    async def open(self) -> None:
        """Connect now, so that a missing map or a wrong key shows here."""
        await self.run_until(lambda: True)

    async def close(self) -> None:
        """Close the connection; the service gives up what it was not done with."""
        socket, self._socket = self._socket, None
        if socket is not None:
            await socket.close()

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        state = "open" if self._socket is not None else "closed"
        return f"{type(self).__name__}({self._map_name!r} at {self._endpoint.url}, {state})"
