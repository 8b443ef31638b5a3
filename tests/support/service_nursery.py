"""Starts the same service over and over without paying for its imports each time: a parent that forks it.

Run as a script it is that parent: one JSON object of settings per line of standard input starts a service, and the
next line is read once that service has ended.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Self


class ServiceNursery:
    """One service at a time; it is a process of its own and dies by real signals."""

    def __init__(self, data_dir: Path, **settings: object) -> None:
        self._settings = {"data_dir": str(data_dir), "port": 0, **settings}
        self._parent = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._pid = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        if self._pid:
            self.kill()
        self._parent.communicate(timeout=30)

    def start(self) -> str:
        """The URL, once the service answers there; its maps may still be on their way."""
        assert self._parent.stdin is not None
        self._parent.stdin.write(json.dumps(self._settings) + "\n")
        self._parent.stdin.flush()
        self._pid = int(self._line().removeprefix("pid "))
        return self._line().removeprefix("rayvox listens on ")

    def kill(self) -> None:
        """SIGKILL, and wait until the process is gone."""
        os.kill(self._pid, signal.SIGKILL)
        self._pid = 0
        assert self._line() == "ended"

    def _line(self) -> str:
        assert self._parent.stdout is not None
        line = self._parent.stdout.readline().strip()
        assert line, "the service's parent ended"
        return line


def main() -> None:
    from rayvox_service.server import serve
    from rayvox_service.settings import Settings

    for line in sys.stdin:
        pid = os.fork()
        if pid == 0:
            print(f"pid {os.getpid()}", flush=True)
            serve(Settings(**json.loads(line)))
            os._exit(0)
        os.waitpid(pid, 0)
        print("ended", flush=True)


if __name__ == "__main__":
    main()
