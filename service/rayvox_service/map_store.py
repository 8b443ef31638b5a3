"""All maps of one data directory.

`maps/<name>/` holds a map; `staging/` and `trash/` hold what is on its way in or out, so that a map exists as a whole
or not at all, whatever happens in between.
"""

from __future__ import annotations

import fcntl
import logging
import os
import shutil
import threading
import uuid
from typing import Any

from rayvox.embree_library import load_embree

from rayvox_service.durable_files import sync_directory
from rayvox_service.hosted_map import HostedMap, MapOpenError
from rayvox_service.map_config import MapConfig, read_map_config, write_map_config
from rayvox_service.names import check_name
from rayvox_service.problems import Problem
from rayvox_service.settings import Settings

log = logging.getLogger(__name__)


class DataDirectoryInUseError(OSError):
    """Another service works on the same data directory."""


class MapStore:
    """Thread-safe. `open_all` restores the maps that are on disk; until it ends only those restored so far answer."""

    def __init__(self, settings: Settings) -> None:
        """Takes the data directory for this process alone.

        Raises OSError, DataDirectoryInUseError, and rayvox.EngineUnavailableError for an engine that is not installed.
        """
        if settings.engine == "embree":
            load_embree()
        self._settings = settings
        self._root = settings.data_dir
        self._maps_dir, self._staging, self._trash = (self._root / name for name in ("maps", "staging", "trash"))
        for directory in (self._maps_dir, self._staging, self._trash):
            directory.mkdir(parents=True, exist_ok=True)
        self._lock_file = (self._root / "lock").open("w")
        try:
            fcntl.flock(self._lock_file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock_file.close()
            raise DataDirectoryInUseError(f"{self._root} is in use by another rayvox service") from None
        self._lock = threading.Lock()
        self._maps: dict[str, HostedMap] = {}
        self._failures: dict[str, str] = {}
        self._opening: set[str] = {path.name for path in self._maps_dir.iterdir() if path.is_dir()}
        # Listed before anything is served: what comes into these folders later is somebody's work.
        self._leftovers = [*self._staging.iterdir(), *self._trash.iterdir()]
        self._closed = False

    @property
    def ready(self) -> bool:
        return not self._opening and not self._closed

    def open_all(self) -> None:
        """Restore every map; one that cannot be restored answers `unavailable` and leaves the others alone."""
        for leftover in self._leftovers:
            shutil.rmtree(leftover, ignore_errors=True)
        for name in sorted(self._opening):
            if self._closed:
                return
            try:
                directory = self._maps_dir / name
                hosted = HostedMap(directory, read_map_config(directory), self._settings)
            except (MapOpenError, OSError, ValueError) as error:
                log.error("map %s cannot be opened: %s", name, error)
                self._failures[name] = str(error)
            else:
                self._maps[name] = hosted
            self._opening.discard(name)

    def get(self, name: str) -> HostedMap:
        """Raises Problem map-not-found, invalid-map-name, or unavailable while it opens or when it could not."""
        hosted = self._maps.get(name)
        if hosted is not None:
            return hosted
        check_name("map", name)
        if name in self._opening:
            raise Problem("unavailable", f"map {name} is being restored")
        if name in self._failures:
            raise Problem("unavailable", f"map {name} could not be restored: {self._failures[name]}")
        raise _not_found(name)

    def all(self) -> list[HostedMap]:
        return [self._maps[name] for name in sorted(self._maps)]

    def failures(self) -> list[dict[str, Any]]:
        """Documents of the maps that could not be restored."""
        return [{"name": name, "state": "failed", "failure": text} for name, text in sorted(self._failures.items())]

    def create(self, config: MapConfig) -> HostedMap:
        """Raises Problem map-exists or invalid-map-name, rayvox.InvalidInputError, OSError."""
        check_name("map", config.name)
        config.new_map()
        with self._lock:
            if self._closed:
                raise Problem("unavailable", "the service is stopping")
            target = self._maps_dir / config.name
            if target.exists():
                raise Problem("map-exists", f"map {config.name} exists already")
            staged = self._staging / uuid.uuid4().hex
            staged.mkdir()
            try:
                write_map_config(staged, config)
                staged.rename(target)
            except OSError:
                shutil.rmtree(staged, ignore_errors=True)
                raise
            try:
                sync_directory(self._maps_dir)
                hosted = self._maps[config.name] = HostedMap(target, config, self._settings)
            except OSError:
                self._throw_away(config.name)
                raise
            return hosted

    def delete(self, name: str) -> None:
        """Raises Problem map-not-found; a map that could not be restored can be deleted too."""
        with self._lock:
            if name not in self._failures:
                hosted = self.get(name)
                del self._maps[name]
                hosted.close(_not_found(name), drain=False)
            self._failures.pop(name, None)
            self._throw_away(name)

    def stop_opening(self) -> None:
        """Let a running `open_all` end after the map it is at."""
        self._closed = True

    def close(self) -> None:
        """Finish what was taken, then let go of the data directory."""
        with self._lock:
            for hosted in self._maps.values():
                hosted.close(Problem("unavailable", "the service is stopping"), drain=True)
            self._lock_file.close()

    def _throw_away(self, name: str) -> None:
        # Renamed first: a map that is only half deleted must not come back at the next start.
        trashed = self._trash / uuid.uuid4().hex
        os.rename(self._maps_dir / name, trashed)
        sync_directory(self._maps_dir)
        shutil.rmtree(trashed, ignore_errors=True)


def _not_found(name: str) -> Problem:
    return Problem("map-not-found", f"there is no map {name}")
