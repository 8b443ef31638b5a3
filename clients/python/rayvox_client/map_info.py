"""What the service says about a map, and about itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rayvox_client.fields import Fields
from rayvox_client.sensor_model import SensorModel


@dataclass(frozen=True)
class MapInfo:
    """One map.

    Attributes:
        resolution_m: edge of a finest-level cell.
        depth: levels of the octree.
        revision: counts the map's changes.
        scans_acknowledged: scans that are on the service's disk.
        scans_applied: those of them that the map shows.
        last_sequence: journal number of the last acknowledged entry.
        queue_bytes, memory_bytes: waiting to be applied; held by the octree.
        statistics: leaf counts, volumes and bounds, when asked for.
    """

    name: str
    resolution_m: float
    depth: int
    sensor_model: SensorModel
    revision: int
    scans_acknowledged: int
    scans_applied: int
    last_sequence: int
    queue_bytes: int
    memory_bytes: int
    statistics: Mapping[str, object] | None = field(default=None, repr=False)

    @classmethod
    def from_fields(cls, fields: Fields) -> MapInfo:
        """Read the API's map object."""
        return cls(
            name=fields.text("name"),
            resolution_m=fields.number("resolution_m"),
            depth=fields.integer("depth"),
            sensor_model=SensorModel.from_fields(fields.nested("sensor_model")),
            revision=fields.integer("revision"),
            scans_acknowledged=fields.integer("scans_acknowledged"),
            scans_applied=fields.integer("scans_applied"),
            last_sequence=fields.integer("last_sequence"),
            queue_bytes=fields.integer("queue_bytes"),
            memory_bytes=fields.integer("memory_bytes"),
            statistics=fields.nested("statistics").values if fields.has("statistics") else None,
        )


@dataclass(frozen=True)
class ServiceVersion:
    """Versions of the service, of the mapping kernel in it, and of the API."""

    service: str
    kernel: str
    api: str

    @classmethod
    def from_fields(cls, fields: Fields) -> ServiceVersion:
        """Read the answer of /version."""
        return cls(fields.text("service"), fields.text("kernel"), fields.text("api"))
