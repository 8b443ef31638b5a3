"""What the service answers to a change of the map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rayvox_client.errors import ServiceError
from rayvox_client.fields import Fields


@dataclass(frozen=True)
class ScanReceipt:
    """The scan is on the service's disk and will survive a crash.

    Attributes:
        scan_id: the scan's UUID.
        sequence: its number in the map's journal.
        status: `journaled`, or `applied` when the map shows it.
        revision: the map's revision with the scan in it; None while only journaled.
        duplicate: the service had this scan already, nothing was added.
        statistics: the engine that ran, the kernel's counts and times; None while only journaled.
    """

    scan_id: str
    sequence: int
    status: str
    revision: int | None
    duplicate: bool
    statistics: Mapping[str, object] | None = field(default=None, repr=False)

    @classmethod
    def from_fields(cls, fields: Fields) -> ScanReceipt:
        """Read the answer to a scan."""
        return cls(
            scan_id=fields.text("scan_id"),
            sequence=fields.integer("sequence"),
            status=fields.text("status"),
            revision=fields.optional_integer("revision"),
            duplicate=fields.boolean("duplicate"),
            statistics=fields.nested("statistics").values if fields.has("statistics") else None,
        )


@dataclass(frozen=True)
class ClearReceipt:
    """A box was cleared: the map's revision with it, and its number in the journal."""

    revision: int
    sequence: int

    @classmethod
    def from_fields(cls, fields: Fields) -> ClearReceipt:
        """Read the answer to a clear."""
        return cls(fields.integer("revision"), fields.integer("sequence"))


@dataclass(frozen=True)
class ScanAck:
    """The stream's acknowledgement of one scan: it is on the service's disk."""

    scan_id: str
    sequence: int
    duplicate: bool

    @classmethod
    def from_fields(cls, fields: Fields) -> ScanAck:
        """Read an `ack` message."""
        return cls(fields.text("scan_id"), fields.integer("sequence"), fields.boolean("duplicate"))


@dataclass(frozen=True)
class RefusedScan:
    """A scan that the service refused, and why."""

    scan_id: str
    error: ServiceError
