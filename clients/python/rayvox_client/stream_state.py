"""The bookkeeping of a scan stream: what is sent, acknowledged, refused, and due to be sent again. No I/O."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from rayvox_client.errors import InvalidInputError, MalformedAnswerError, OverloadedError
from rayvox_client.fields import Fields
from rayvox_client.frame import decode_frame
from rayvox_client.http_message import problem_from_fields
from rayvox_client.map_changes import MapChanges
from rayvox_client.receipt import RefusedScan, ScanAck

RECENT_ACKS = 1024


class StreamState:
    """Scans keep their frame here until they are acknowledged or refused.

    Attributes:
        max_in_flight: how many unacknowledged scans the service reads; 1 until it said so.
        acks: the most recent acknowledgements.
        acknowledged: how many scans were acknowledged in all. duplicates: how many the service had already.
        last_sequence: journal number of the last acknowledged scan, None before the first.
        refused: scans that the service refused since the last `take_refused`.
        changes: map changes received and not yet taken.
        since: revision that a subscriber's changes have reached; where a new connection takes up.
    """

    def __init__(self, since: int | None = None) -> None:
        self.max_in_flight = 1
        self.acks: deque[ScanAck] = deque(maxlen=RECENT_ACKS)
        self.acknowledged = 0
        self.duplicates = 0
        self.last_sequence: int | None = None
        self.refused: list[RefusedScan] = []
        self.changes: deque[MapChanges] = deque()
        self.since = since
        self._frames: dict[str, bytes] = {}
        self._unsent: deque[str] = deque()

    @property
    def unacknowledged(self) -> tuple[str, ...]:
        """scan_ids that are neither acknowledged nor refused, oldest first."""
        return tuple(self._frames)

    @property
    def in_flight(self) -> int:
        """How many scans are neither acknowledged nor refused."""
        return len(self._frames)

    @property
    def has_room(self) -> bool:
        """Whether another scan may go out."""
        return len(self._frames) < self.max_in_flight

    def add(self, scan_id: str, frame: bytes) -> None:
        """Take on a scan to be sent; InvalidInputError when its id is in flight already."""
        if scan_id in self._frames:
            raise InvalidInputError(f"scan_id {scan_id} is in flight on this stream already")
        self._frames[scan_id] = frame
        self._unsent.append(scan_id)

    def due(self) -> Iterator[bytes]:
        """Frames to send now; each counts as sent once the next one is asked for."""
        while self._unsent:
            frame = self._frames.get(self._unsent[0])
            if frame is not None:
                yield frame
            self._unsent.popleft()

    def on_opened(self, fields: Fields) -> None:
        """A connection is open: everything unacknowledged goes out again, in order."""
        if fields.text("type") != "opened":
            raise MalformedAnswerError(f"the stream began with {fields.values!r:.200}")
        self.max_in_flight = max(1, fields.integer("max_in_flight"))
        self._unsent = deque(self._frames)

    def on_message(self, message: str | bytes) -> None:
        """Take one message from the service.

        Raises:
            OverloadedError: the service could not take a scan now; it is due again.
            ServiceError: the stream as a whole is refused.
            MalformedAnswerError: the message is none that the API knows.
        """
        if isinstance(message, bytes):
            changes = MapChanges.from_frame(decode_frame(message))
            self.changes.append(changes)
            self.since = changes.revision
            return
        fields = Fields.parse(message, "stream message")
        kind = fields.text("type")
        if kind == "ack":
            self._on_ack(ScanAck.from_fields(fields))
        elif kind == "error":
            self._on_error(fields)
        else:
            raise MalformedAnswerError(f"stream message of unknown type {kind!r}")

    def _on_ack(self, ack: ScanAck) -> None:
        if self._frames.pop(ack.scan_id, None) is None:
            return
        self.acks.append(ack)
        self.acknowledged += 1
        self.duplicates += ack.duplicate
        self.last_sequence = max(ack.sequence, self.last_sequence or 0)

    def _on_error(self, fields: Fields) -> None:
        error = problem_from_fields(fields.nested("problem"))
        scan_id = fields.text("scan_id") if fields.has("scan_id") else None
        if scan_id is None:
            raise error
        if scan_id not in self._frames:
            return
        if isinstance(error, OverloadedError):
            self._unsent.append(scan_id)
            raise error
        del self._frames[scan_id]
        self.refused.append(RefusedScan(scan_id, error))

    def take_refused(self) -> list[RefusedScan]:
        """The refused scans, once."""
        taken, self.refused = self.refused, []
        return taken

    def raise_for_refused(self) -> None:
        """Raise the first refused scan's typed error, its note naming the scan; all count as reported after."""
        taken = self.take_refused()
        if not taken:
            return
        first = taken[0]
        others = f"; {len(taken) - 1} other scans were refused too" if len(taken) > 1 else ""
        first.error.add_note(f"scan {first.scan_id} was refused{others}")
        raise first.error
