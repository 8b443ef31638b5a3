"""The real service in a process of its own, on a free port of 127.0.0.1."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx
import numpy as np
import numpy.typing as npt
from rayvox_service.frame import MEDIA_TYPE, UNLIMITED, Frame, decode_frame, encode_frame

FRAME_HEADERS = {"Content-Type": MEDIA_TYPE}
MAIN = "from rayvox_service.server import serve\nfrom rayvox_service.settings import Settings\nserve(Settings())"


class ServiceProcess:
    """`settings` are passed as RAYVOX_* variables; `max_file_bytes` makes the disk refuse larger files."""

    def __init__(self, data_dir: Path, max_file_bytes: int | None = None, **settings: object) -> None:
        variables = {f"RAYVOX_{name.upper()}": str(value) for name, value in settings.items()}
        inherited = {name: value for name, value in os.environ.items() if not name.startswith("RAYVOX_")}
        self.process = subprocess.Popen(
            [sys.executable, "-c", MAIN],
            env=inherited | {"RAYVOX_PORT": "0", "RAYVOX_DATA_DIR": str(data_dir)} | variables,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE if settings.get("quiet") else None,
            text=True,
            preexec_fn=None if max_file_bytes is None else lambda: _limit_files(max_file_bytes),
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line.startswith("rayvox listens on http"), f"the service did not start: {line!r}"
        self.url = line.split()[-1]
        self.http = httpx.Client(base_url=self.url, timeout=30)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self.stop()

    def await_ready(self) -> Self:
        deadline = time.monotonic() + 30
        while self.http.get("/v1/ready").status_code != 200:
            assert time.monotonic() < deadline, "the service did not become ready"
            time.sleep(0.01)
        return self

    def kill(self) -> None:
        self._end(signal.SIGKILL)

    def stop(self) -> None:
        if self.process.poll() is None:
            self._end(signal.SIGTERM)

    def _end(self, number: signal.Signals) -> None:
        self.http.close()
        self.process.send_signal(number)
        self.process.wait(30)
        assert self.process.stdout is not None
        self.process.stdout.close()


def _limit_files(nbytes: int) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (nbytes, nbytes))


def some_points(seed: int = 0, count: int = 200) -> npt.NDArray[np.float32]:
    """End points within 5 m around the sensor."""
    return np.random.default_rng(seed).uniform(-5, 5, (count, 3)).astype(np.float32)


def scan_frame(
    points: npt.NDArray[Any], scan_id: uuid.UUID | None = None, *, zstd: bool = False, **fields: object
) -> tuple[uuid.UUID, bytes]:
    scan_id = scan_id or uuid.uuid4()
    return scan_id, encode_frame("scan", {"scan_id": str(scan_id), **fields}, {"points": points}, zstd=zstd)


def put_scan(
    http: httpx.Client, name: str, scan_id: uuid.UUID | str, data: bytes, wait: str = "applied", **headers: str
) -> httpx.Response:
    url = f"/v1/maps/{name}/scans/{scan_id}?wait={wait}"
    return http.put(url, content=data, headers={**FRAME_HEADERS, **headers})


def create_map(http: httpx.Client, name: str, resolution_m: float = 0.25) -> dict[str, Any]:
    response = http.post("/v1/maps", json={"name": name, "resolution_m": resolution_m})
    assert response.status_code == 201, response.text
    info: dict[str, Any] = response.json()
    return info


def served_leaves(http: httpx.Client, name: str) -> dict[tuple[int, ...], float]:
    """All leaves of a served map: (key x, y, z, depth) to log-odds."""
    response = http.get(f"/v1/maps/{name}/changes?since=0")
    assert response.status_code == 200, response.text
    frame = decode_frame(response.content, UNLIMITED)
    return leaf_dict(frame.array("keys"), frame.array("leaf_depth"), frame.array("log_odds"))


def leaf_dict(
    keys: npt.NDArray[Any], depth: npt.NDArray[Any], log_odds: npt.NDArray[Any]
) -> dict[tuple[int, ...], float]:
    rows: Sequence[Sequence[int]] = np.column_stack([keys, depth]).tolist()
    return dict(zip((tuple(row) for row in rows), log_odds.tolist(), strict=True))


def as_frame(response: httpx.Response) -> Frame:
    assert response.status_code == 200, response.text
    return decode_frame(response.content, UNLIMITED)


def assert_problem(response: httpx.Response, status: int, slug: str) -> Mapping[str, Any]:
    """The answer is that RFC 9457 problem, complete."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = response.json()
    assert problem["type"] == f"urn:rayvox:problem:{slug}"
    assert problem["status"] == status
    assert problem["instance"] == response.url.path
    assert problem["title"]
    assert problem["detail"]
    return problem
