"""A small stand-in for the service on real sockets, which breaks in the ways that it is told to.

It keeps scans idempotently by id, as the API promises, so that tests can see whether a client lost or doubled one.
"""

from __future__ import annotations

import json
import socket
import ssl
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from rayvox_client.frame import MEDIA_TYPE, decode_frame, encode_frame
from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.server import ServerProtocol


@dataclass(frozen=True)
class Fault:
    """What goes wrong with one HTTP request.

    Attributes:
        status, headers, body: answered instead of handling the request; a status of 0 closes without an answer.
        read_body_bytes: close after so many bytes of the request's body, before handling it.
        cut_answer: handle the request, and send only the first half of the answer.
    """

    status: int = 0
    headers: tuple[tuple[str, str], ...] = ()
    body: bytes = b""
    handle_first: bool = False
    read_body_bytes: int | None = None
    cut_answer: bool = False


@dataclass
class StreamFaults:
    """What goes wrong on WebSocket connections, each entry once.

    Attributes:
        drop_after_scans: the n-th connection is cut after it took so many scans, without acknowledging the last.
        problems: answered to the scan with this id instead of taking it, in order.
        close_codes: the n-th connection is closed with this code at its first scan.
    """

    drop_after_scans: deque[int] = field(default_factory=deque)
    problems: dict[str, deque[dict[str, object]]] = field(default_factory=dict)
    close_codes: deque[int] = field(default_factory=deque)


@dataclass(frozen=True)
class Seen:
    """A request as it arrived."""

    method: str
    target: str
    headers: dict[str, str]
    body: bytes = field(repr=False)


class LoopbackService:
    """One map store on a free port of 127.0.0.1, behind TLS where a context for it is given; a context manager."""

    def __init__(self, max_in_flight: int = 4, tls: ssl.SSLContext | None = None) -> None:
        self.max_in_flight = max_in_flight
        self.scans: dict[str, dict[str, bytes]] = {}
        self.settings: dict[str, dict[str, object]] = {}
        self.faults: deque[Fault] = deque()
        self.stream_faults = StreamFaults()
        self.changes: deque[bytes] = deque()
        self.seen: list[Seen] = []
        self.connections = 0
        self.most_in_flight = 0
        self.hold_acks = False
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._open: list[socket.socket] = []
        self._tls = tls
        self.url = f"{'http' if tls is None else 'https'}://127.0.0.1:{self._listener.getsockname()[1]}"

    def __enter__(self) -> Self:
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.close()
        for connection in self._open:
            connection.close()

    def add_map(self, name: str, resolution_m: float = 0.05) -> None:
        self.settings[name] = {"resolution_m": resolution_m, "depth": 16, "sensor_model": SENSOR_MODEL}
        self.scans[name] = {}

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self.connections += 1
            self._open.append(connection)
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        try:
            if self._tls is not None:
                connection = self._tls.wrap_socket(connection, server_side=True)
            with connection, connection.makefile("rb") as reader:
                while self._serve_one(connection, reader.readline, reader.read):
                    pass
        except (OSError, ValueError):
            return

    def _serve_one(
        self, connection: socket.socket, readline: Callable[[], bytes], read: Callable[[int], bytes]
    ) -> bool:
        head = [readline()]
        while head[-1] not in (b"", b"\r\n"):
            head.append(readline())
        if head[-1] == b"":
            return False
        method, target, _ = head[0].decode().split(" ")
        headers = {k.lower(): v.strip() for k, v in (line.decode().split(":", 1) for line in head[1:-1])}
        if headers.get("upgrade", "").lower() == "websocket":
            self.seen.append(Seen(method, target, headers, b""))
            StreamConnection(self, connection, target, b"".join(head)).run()
            return False
        fault = self.faults.popleft() if self.faults else None
        length = int(headers.get("content-length", "0"))
        if fault is not None and fault.read_body_bytes is not None:
            read(fault.read_body_bytes)
            return False
        request = Seen(method, target, headers, read(length))
        self.seen.append(request)
        return self._answer(connection, request, fault)

    def _answer(self, connection: socket.socket, request: Seen, fault: Fault | None) -> bool:
        if fault is None or fault.handle_first or fault.cut_answer:
            status, media_type, body = self.handle(request)
            extra: tuple[tuple[str, str], ...] = ()
        if fault is not None and not fault.cut_answer:
            if fault.status == 0:
                return False
            status, media_type, body, extra = fault.status, PROBLEM, fault.body, fault.headers
        lines = [f"HTTP/1.1 {status} X", f"Content-Type: {media_type}", f"Content-Length: {len(body)}"]
        lines += [f"{name}: {value}" for name, value in extra]
        answer = ("\r\n".join(lines) + "\r\n\r\n").encode() + body
        if fault is not None and fault.cut_answer:
            connection.sendall(answer[: len(answer) - len(body) // 2 - 1])
            return False
        connection.sendall(answer)
        return True

    def handle(self, request: Seen) -> tuple[int, str, bytes]:
        """Status, media type and body of the answer to a request without a fault."""
        path = request.target.split("?")[0].removeprefix("/v1/").split("/")
        if path == ["health"]:
            return 200, JSON, b'{"status":"ok"}'
        if path == ["maps"] and request.method == "POST":
            return self._create(json.loads(request.body))
        if path == ["maps"]:
            return 200, JSON, json.dumps({"maps": [self.info(name) for name in self.settings]}).encode()
        name = path[1]
        if name not in self.settings:
            return 404, PROBLEM, problem("map-not-found", 404, f"there is no map {name!r}")
        if len(path) == 2 and request.method == "DELETE":
            del self.settings[name]
            return 204, JSON, b""
        if len(path) == 2:
            return 200, JSON, json.dumps(self.info(name)).encode()
        if path[2] == "scans":
            return self._put_scan(name, request.body)
        if path[2] == "points":
            count = len(decode_frame(request.body).array("points", "<f8", columns=3))
            answers: dict[str, NDArray[Any]] = {
                "states": np.full(count, 2, np.uint8),
                "log_odds": np.full(count, 0.85, np.float32),
            }
            return 200, MEDIA_TYPE, encode_frame("occupancy", {"revision": 7}, answers)
        if path[2] == "export":
            return 200, "application/octet-stream", b"octree" * 1000
        return 404, PROBLEM, problem("not-found", 404, "nothing here")

    def _create(self, wanted: dict[str, object]) -> tuple[int, str, bytes]:
        name = str(wanted.pop("name"))
        if name in self.settings:
            return 409, PROBLEM, problem("map-exists", 409, f"{name!r} exists")
        self.settings[name] = {"depth": 16, "sensor_model": SENSOR_MODEL, **wanted}
        self.scans[name] = {}
        return 201, JSON, json.dumps(self.info(name)).encode()

    def _put_scan(self, name: str, body: bytes) -> tuple[int, str, bytes]:
        scan_id = decode_frame(body).fields.text("scan_id")
        duplicate = self.keep(name, scan_id, body)
        if self.scans[name][scan_id] != body:
            return 409, PROBLEM, problem("scan-conflict", 409, f"{scan_id} was used for other bytes")
        answer = {"scan_id": scan_id, "sequence": self.sequence(name, scan_id), "status": "journaled"}
        return 200 if duplicate else 201, JSON, json.dumps(answer | {"revision": None, "duplicate": duplicate}).encode()

    def keep(self, name: str, scan_id: str, body: bytes) -> bool:
        """Keep a scan; True if it was there."""
        duplicate = scan_id in self.scans[name]
        self.scans[name].setdefault(scan_id, body)
        return duplicate

    def sequence(self, name: str, scan_id: str) -> int:
        return list(self.scans[name]).index(scan_id) + 1

    def info(self, name: str) -> dict[str, object]:
        count = len(self.scans[name])
        counters = dict.fromkeys(("revision", "scans_acknowledged", "scans_applied", "last_sequence"), count)
        return {"name": name, **self.settings[name], **counters, "queue_bytes": 0, "memory_bytes": 4096}


class StreamConnection:
    """The service's side of one WebSocket."""

    def __init__(self, service: LoopbackService, connection: socket.socket, target: str, head: bytes) -> None:
        self._service = service
        self._connection = connection
        self._name = target.split("?")[0].split("/")[3]
        self._subscribed = "subscribe=true" in target
        self._protocol = ServerProtocol(max_size=None)
        self._protocol.receive_data(head)
        faults = service.stream_faults
        self._drop_after = faults.drop_after_scans.popleft() if faults.drop_after_scans else None
        self._close_code = faults.close_codes.popleft() if faults.close_codes else None
        self._taken = 0
        self._held: list[str] = []

    def run(self) -> None:
        (request,) = self._protocol.events_received()
        assert isinstance(request, Request)
        if self._name not in self._service.settings:
            response = self._protocol.reject(404, problem("map-not-found", 404, "no such map").decode())
            self._protocol.send_response(response)
            self._flush()
            return
        self._protocol.send_response(self._protocol.accept(request))
        state = {"max_in_flight": self._service.max_in_flight, "revision": 0, "last_sequence": 0}
        self._send({"type": "opened", **state})
        while self._subscribed and self._service.changes:
            self._protocol.send_binary(self._service.changes.popleft())
        self._flush()
        message = b""
        while data := self._connection.recv(1 << 16):
            self._protocol.receive_data(data)
            for event in self._protocol.events_received():
                assert isinstance(event, Frame)
                message += event.data
                if event.opcode in (Opcode.BINARY, Opcode.CONT) and event.fin:
                    if not self._take(message):
                        return
                    message = b""
            self._flush()
            if self._protocol.close_expected():
                return

    def _take(self, frame: bytes) -> bool:
        """Handle one scan; False when the connection is to be cut without an answer."""
        faults = self._service.stream_faults
        scan_id = decode_frame(frame).fields.text("scan_id")
        if self._close_code is not None:
            self._protocol.send_close(self._close_code, "told to")
            self._flush()
            return False
        if faults.problems.get(scan_id):
            self._send({"type": "error", "scan_id": scan_id, "problem": faults.problems[scan_id].popleft()})
            return True
        duplicate = self._service.keep(self._name, scan_id, frame)
        self._taken += 1
        if self._drop_after == self._taken:
            return False
        self._held.append(scan_id)
        self._service.most_in_flight = max(self._service.most_in_flight, len(self._held))
        if self._service.hold_acks and len(self._held) < self._service.max_in_flight:
            return True
        for held in self._held:
            sequence = self._service.sequence(self._name, held)
            self._send({"type": "ack", "scan_id": held, "sequence": sequence, "duplicate": duplicate})
        self._held.clear()
        return True

    def _send(self, message: dict[str, object]) -> None:
        self._protocol.send_text(json.dumps(message).encode())
        self._flush()

    def _flush(self) -> None:
        for data in self._protocol.data_to_send():
            if data:
                self._connection.sendall(data)


JSON = "application/json"
PROBLEM = "application/problem+json"
SENSOR_MODEL = {"p_hit": 0.7, "p_miss": 0.4, "p_clamp_min": 0.1192, "p_clamp_max": 0.971, "p_occupied": 0.5}


def problem(slug: str, status: int, detail: str) -> bytes:
    """A problem document (RFC 9457)."""
    document = {"type": f"urn:rayvox:problem:{slug}", "title": slug, "status": status, "detail": detail}
    return json.dumps(document).encode()
