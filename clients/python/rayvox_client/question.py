"""A question to a map as a value; no I/O."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from numpy.typing import NDArray

from rayvox_client.frame import Frame, OutgoingFrame, lay_out_frame

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Question(Generic[T]):
    """What is asked, and how the answer is read.

    Attributes:
        kind, fields, payloads: of the frame that asks; see docs/frame.md.
        read: makes the answer of the frame that answers; MalformedAnswerError if that does not fit.
        min_revision: wait until the map has got so far.
    """

    kind: str
    fields: Mapping[str, object]
    payloads: Mapping[str, NDArray[Any]] = field(repr=False)
    read: Callable[[Frame], T] = field(repr=False)
    min_revision: int | None = None

    def lay_out_frame(self) -> OutgoingFrame:
        """The question as an HTTP body; `min_revision` is in the address there."""
        return lay_out_frame(self.kind, self.fields, self.payloads)

    def to_message(self) -> bytes:
        """The question as a WebSocket message."""
        fresh = {} if self.min_revision is None else {"min_revision": self.min_revision}
        return lay_out_frame(self.kind, {**self.fields, **fresh}, self.payloads).to_bytes()
