"""All robots of one data directory: `robots/<name>/` holds the bytes of one upload and how they are read.

A directory whose name begins with a dot is on its way in or out, so that a robot exists as a whole or not at all.
"""

from __future__ import annotations

import hashlib
import logging
import math
import os
import shutil
import threading
import uuid
from dataclasses import replace
from typing import Any

from rayvox import LoadLimits
from rayvox.errors import RayvoxError

from rayvox_service.durable_files import sync_directory
from rayvox_service.frame import Bytes
from rayvox_service.names import check_name
from rayvox_service.problems import Problem
from rayvox_service.robot_config import RobotConfig, read_robot, write_robot
from rayvox_service.settings import Settings
from rayvox_service.stored_robot import StoredRobot

log = logging.getLogger(__name__)


class RobotStore:
    """Thread-safe. `open_all` restores the robots that are on disk; until it ends only those restored so far answer.

    The data directory must be this process's alone (MapStore sees to it).
    """

    def __init__(self, settings: Settings) -> None:
        """Raises OSError."""
        self._root = settings.data_dir / "robots"
        self._root.mkdir(parents=True, exist_ok=True)
        self._limits = LoadLimits(
            settings.max_robot_expanded_bytes, settings.max_robot_triangles, settings.max_robot_parse_s
        )
        self._lock = threading.Lock()
        self._parsing = threading.Lock()
        self._robots: dict[str, StoredRobot] = {}
        self._failures: dict[str, str] = {}
        self._opening = {path.name for path in self._root.iterdir() if not path.name.startswith(".")}
        self._closed = False

    @property
    def ready(self) -> bool:
        return not self._opening

    def open_all(self) -> None:
        """Restore every robot; one that cannot be restored answers `unavailable` and leaves the others alone."""
        for leftover in self._root.glob(".*"):
            shutil.rmtree(leftover, ignore_errors=True)
        # What was read in time once is read again, however slow the machine is today.
        patient = replace(self._limits, max_time_s=math.inf)
        for name in sorted(self._opening):
            if self._closed:
                return
            try:
                config, data = read_robot(self._root / name)
                _require_same_bytes(config, data)
                self._robots[name] = StoredRobot(config, config.load(data, patient))
            except (RayvoxError, OSError, ValueError) as error:
                log.error("robot %s cannot be opened: %s", name, error)
                self._failures[name] = str(error)
            self._opening.discard(name)

    def stop_opening(self) -> None:
        """Let a running `open_all` end after the robot it is at."""
        self._closed = True

    def get(self, name: str) -> StoredRobot:
        """Raises Problem robot-not-found, invalid-robot-name, or unavailable while it opens or when it could not."""
        stored = self._robots.get(name)
        if stored is not None:
            return stored
        check_name("robot", name)
        if name in self._opening:
            raise Problem("unavailable", f"robot {name} is being restored")
        if name in self._failures:
            raise Problem("unavailable", f"robot {name} could not be restored: {self._failures[name]}")
        raise Problem("robot-not-found", f"there is no robot {name}")

    def summaries(self) -> list[dict[str, Any]]:
        robots = [stored.summary() for _, stored in sorted(self._robots.items())]
        failures = [{"name": n, "state": "failed", "failure": text} for n, text in sorted(self._failures.items())]
        return robots + failures

    def put(self, config: RobotConfig, data: Bytes) -> tuple[StoredRobot, bool]:
        """The robot, on disk, and whether it is new; the same upload again changes nothing.

        Raises Problem robot-exists, invalid-robot-name, unavailable; MeshFormatError, RobotFormatError, LoadLimitError,
        InvalidInputError, OSError.
        """
        check_name("robot", config.name)
        if (existing := self._existing(config)) is not None:
            return existing, False
        # One upload at a time: each may use all of its limits.
        with self._parsing:
            stored = StoredRobot(config, config.load(data, self._limits))
        staged = self._root / f".{uuid.uuid4().hex}"
        staged.mkdir()
        try:
            write_robot(staged, config, data)
            with self._lock:
                if (existing := self._existing(config)) is not None:
                    return existing, False
                staged.rename(self._root / config.name)
                try:
                    sync_directory(self._root)
                except OSError:
                    shutil.rmtree(self._root / config.name, ignore_errors=True)
                    raise
                self._robots[config.name] = stored
        finally:
            shutil.rmtree(staged, ignore_errors=True)
        return stored, True

    def delete(self, name: str) -> None:
        """Raises Problem robot-not-found; a robot that could not be restored can be deleted too."""
        with self._lock:
            if name not in self._failures:
                self.get(name)
            trashed = self._root / f".{uuid.uuid4().hex}"
            os.rename(self._root / name, trashed)
            self._robots.pop(name, None)
            self._failures.pop(name, None)
            sync_directory(self._root)
        shutil.rmtree(trashed, ignore_errors=True)

    def _existing(self, config: RobotConfig) -> StoredRobot | None:
        """A robot of this name from the same upload, None where there is none. Raises Problem."""
        if config.name in self._opening or config.name in self._failures:
            self.get(config.name)
        existing = self._robots.get(config.name)
        if existing is not None and existing.config != config:
            raise Problem("robot-exists", f"robot {config.name} exists, from another upload; delete it first")
        return existing


def sha256_of(data: Bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _require_same_bytes(config: RobotConfig, data: bytes) -> None:
    if sha256_of(data) != config.sha256:
        raise ValueError("its upload is not the one that was stored: the checksum differs")
