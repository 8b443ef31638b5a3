"""One revision of a map."""

from __future__ import annotations

from rayvox import _native
from rayvox.map_queries import MapQueries
from rayvox.sensor_model import SensorModel


class MapSnapshot(MapQueries):
    """An immutable revision of an OccupancyMap. Cheap, readable from any thread while the map goes on."""

    def __init__(self, native: _native.MapSnapshot, sensor_model: SensorModel) -> None:
        self._native = native
        self.sensor_model = sensor_model
        self.resolution_m = native.resolution_m
        self.depth = native.depth

    def _revision_asked(self) -> _native.MapSnapshot:
        return self._native
