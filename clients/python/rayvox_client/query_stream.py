"""The connection for many questions, with calls that block."""

from __future__ import annotations

from types import TracebackType
from typing import Generic, Self, TypeVar, Unpack

from numpy.typing import ArrayLike

from rayvox_client.async_query_stream import AsyncPendingAnswer, AsyncQueryStream
from rayvox_client.collisions import CollisionCheck, MotionCheck
from rayvox_client.robot_info import RobotInfo
from rayvox_client.robot_question import CheckOptions, MotionOptions
from rayvox_client.transport import run_blocking

T = TypeVar("T")


class PendingAnswer(Generic[T]):
    """The answer to a question that was sent."""

    def __init__(self, pending: AsyncPendingAnswer[T]) -> None:
        self._pending = pending

    def result(self) -> T:
        """Wait for it. Raises the question's typed error; ConnectionFailedError when the retries are used up."""
        return run_blocking(self._pending.result())


class QueryStream:
    """Questions to one map over a WebSocket, without a request's overhead, answered in their order.

        with client.open_queries("lab") as queries:
            queries.check(robot, configurations)                              # one after the other,
            pending = [queries.send_check(robot, batch) for batch in batches]   # or without waiting in between
            answers = [answer.result() for answer in pending]

    A broken connection is opened again and what is unanswered is asked again. An error of one question leaves the
    others alone. Closing gives up what is unanswered, in the service too. One thread at a time.
    """

    def __init__(self, stream: AsyncQueryStream) -> None:
        self._stream = stream

    def check(
        self,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[CheckOptions],
    ) -> CollisionCheck:
        """As `Client.check`."""
        return run_blocking(self._stream.check(robot, configurations, T_map_base, **options))

    def check_motion(
        self,
        robot: str | RobotInfo,
        q_from: ArrayLike | None,
        q_to: ArrayLike | None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[MotionOptions],
    ) -> MotionCheck:
        """As `Client.check_motion`."""
        return run_blocking(self._stream.check_motion(robot, q_from, q_to, T_map_base, **options))

    def send_check(
        self,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[CheckOptions],
    ) -> PendingAnswer[CollisionCheck]:
        """Send the question and go on; blocks only while the service holds as many unanswered ones as it takes."""
        return PendingAnswer(run_blocking(self._stream.send_check(robot, configurations, T_map_base, **options)))

    def send_check_motion(
        self,
        robot: str | RobotInfo,
        q_from: ArrayLike | None,
        q_to: ArrayLike | None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[MotionOptions],
    ) -> PendingAnswer[MotionCheck]:
        """As `send_check`."""
        return PendingAnswer(run_blocking(self._stream.send_check_motion(robot, q_from, q_to, T_map_base, **options)))

    def open(self) -> None:
        """Connect now, so that a missing map or a wrong key shows here; entering the `with` block does this."""
        run_blocking(self._stream.open())

    def close(self) -> None:
        """Close the connection; the service gives up what it was not done with."""
        run_blocking(self._stream.close())

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return repr(self._stream).replace("Async", "", 1)
