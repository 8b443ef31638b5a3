"""The kernel's map as readers see it: only states whose every scan is on disk."""

from __future__ import annotations

import threading
from concurrent.futures import Future

from rayvox import MapSnapshot, OccupancyMap

# For so many revisions after the last question a map counts as being read: some seconds of a robot's scans.
READ_AHEAD = 20


class PublishedMap:
    """One writer changes the map between `begin` and `publish`; readers in any thread get snapshots.

    A snapshot is taken at most once per published revision, and only of a map that is being read: one that is not is
    never copied on write. A reader of a map that is being read never waits; the first one may come while a change is
    on its way, and gets the state right after it.
    """

    def __init__(self, occupancy_map: OccupancyMap) -> None:
        self._lock = threading.Lock()
        self._map = occupancy_map
        self._changing = False
        self._latest: MapSnapshot | None = None
        self._revisions_since_read = READ_AHEAD
        self._asked: list[Future[MapSnapshot]] = []
        self._failure: Exception | None = None
        self.revision: int = occupancy_map.revision

    def begin(self) -> OccupancyMap:
        with self._lock:
            self._changing = True
            return self._map

    def publish(self, replacement: OccupancyMap | None = None) -> None:
        """End a change; `replacement` takes the place of a map that was changed by something that did not last."""
        with self._lock:
            if replacement is not None:
                self._map = replacement
            self._changing = False
            being_read = bool(self._asked) or self._revisions_since_read < READ_AHEAD
            self._latest = self._map.snapshot() if being_read else None
            self._revisions_since_read += 1
            self.revision = self._map.revision
            asked, self._asked, latest = self._asked, [], self._latest
        for future in asked:
            assert latest is not None
            future.set_result(latest)

    def unchanging(self) -> OccupancyMap:
        """The map for what reads only its geometry, or memory in use: not for its content."""
        return self._map

    def snapshot(self) -> MapSnapshot:
        """The latest published state. May wait for a running change: not for the event loop's thread."""
        self._revisions_since_read = 0
        latest = self._latest
        if latest is not None:
            return latest
        with self._lock:
            if self._latest is not None:
                return self._latest
            if self._failure is not None:
                raise self._failure
            if not self._changing:
                self._latest = self._map.snapshot()
                return self._latest
            future: Future[MapSnapshot] = Future()
            self._asked.append(future)
        return future.result()

    def fail(self, error: Exception) -> None:
        """The change will never end; readers keep the last snapshot, if there is one."""
        with self._lock:
            self._failure = error
            asked, self._asked = self._asked, []
        for future in asked:
            future.set_exception(error)
