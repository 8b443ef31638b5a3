"""The client for asyncio; also the one place where the client's behaviour is written down."""

from __future__ import annotations

import os
import ssl
from pathlib import Path
from types import TracebackType
from typing import Literal, Self, TypeVar, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rayvox_client.async_query_stream import AsyncQueryStream
from rayvox_client.async_stream import AsyncScanStream
from rayvox_client.async_transport import AsyncTransport
from rayvox_client.clearance import Clearance
from rayvox_client.collisions import CollisionCheck, MotionCheck
from rayvox_client.endpoint import Endpoint
from rayvox_client.errors import (
    InvalidInputError,
    MalformedAnswerError,
    MapExistsError,
    NotFoundError,
    RayvoxClientError,
    WaitTimeoutError,
)
from rayvox_client.frame import Compression
from rayvox_client.http_connection import HttpPool
from rayvox_client.http_message import HttpRequest, HttpResponse
from rayvox_client.intrinsics import Intrinsics
from rayvox_client.map_changes import MapChanges
from rayvox_client.map_info import MapInfo, ServiceVersion
from rayvox_client.occupancy import Occupancy, RayHits
from rayvox_client.question import Question
from rayvox_client.receipt import ClearReceipt, ScanReceipt
from rayvox_client.requests import Requests
from rayvox_client.retry import RetryPolicy
from rayvox_client.robot_info import RobotInfo
from rayvox_client.robot_question import (
    CheckOptions,
    MotionOptions,
    RobotOptions,
    UnknownPolicy,
    check_question,
    clearance_question,
    motion_question,
)
from rayvox_client.robot_upload import RobotUpload
from rayvox_client.scan import DepthScan, PosedOptions, PosedScan, Scan, ScanOptions
from rayvox_client.sensor_model import SensorModel
from rayvox_client.sequence import SequenceReport, Via
from rayvox_client.sequence_upload import Scans, SequenceUpload
from rayvox_client.transport import Transport

T = TypeVar("T")
Wait = Literal["applied", "journaled"]
Geometry = Literal["collision", "visual"]
FIRST_POLL_S = 0.005
LAST_POLL_S = 0.25


class AsyncClient:
    """Client of a rayvox service for asyncio: the methods of `Client`, to be awaited. Use on one event loop.

    async with AsyncClient("http://127.0.0.1:8080") as client:
        await client.insert_scan("lab", points, T_map_sensor)
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        api_key: str | None = None,
        timeout_s: float = 30.0,
        retries: int | RetryPolicy = 5,
        *,
        ssl_context: ssl.SSLContext | None = None,
        transport: Transport | None = None,
    ) -> None:
        """See `Client`; `transport` replaces the sockets of asyncio."""
        if not timeout_s > 0:
            raise InvalidInputError(f"timeout_s = {timeout_s!r} is not above zero")
        self._endpoint = Endpoint.parse(url, api_key)
        self._timeout_s = timeout_s
        self._policy = RetryPolicy(retries) if isinstance(retries, int) else retries
        self._transport = transport or AsyncTransport(self._endpoint, timeout_s, ssl_context)
        self._pool = HttpPool(self._transport, self._endpoint)
        self._requests = Requests(self._endpoint)

    async def _answer(self, request: HttpRequest) -> HttpResponse:
        attempts = self._policy.start()
        while True:
            try:
                return (await self._pool.exchange(request)).raise_for_problem()
            except RayvoxClientError as error:
                delay_s = attempts.delay_after(error)
            await self._transport.sleep(delay_s)

    async def health(self) -> str:
        """See `Client.health`."""
        return (await self._answer(self._requests.get("health"))).json().text("status")

    async def version(self) -> ServiceVersion:
        """See `Client.version`."""
        return ServiceVersion.from_fields((await self._answer(self._requests.get("version"))).json())

    async def create_map(
        self,
        name: str,
        resolution_m: float | None = None,
        depth: int | None = None,
        sensor_model: SensorModel | None = None,
        exist_ok: bool = False,
    ) -> MapInfo:
        """See `Client.create_map`."""
        request = self._requests.create_map(name, resolution_m, depth, sensor_model)
        try:
            return MapInfo.from_fields((await self._answer(request)).json())
        except MapExistsError as error:
            if not (exist_ok or error.after_lost_answer):
                raise
            existing = await self.map_info(name)
            wanted = (
                existing.resolution_m if resolution_m is None else float(resolution_m),
                existing.depth if depth is None else depth,
                sensor_model or SensorModel(),
            )
            if (existing.resolution_m, existing.depth, existing.sensor_model) != wanted:
                raise MapExistsError(error.status, error.slug, f"{existing!r} exists, with other settings") from error
            return existing

    async def list_maps(self) -> list[MapInfo]:
        """See `Client.list_maps`."""
        answer = (await self._answer(self._requests.get("maps"))).json()
        return [MapInfo.from_fields(fields) for fields in answer.list_of("maps")]

    async def map_info(self, name: str, statistics: bool = False) -> MapInfo:
        """See `Client.map_info`."""
        return MapInfo.from_fields((await self._answer(self._requests.map_info(name, statistics))).json())

    async def delete_map(self, name: str) -> None:
        """See `Client.delete_map`."""
        try:
            await self._answer(self._requests.delete_map(name))
        except NotFoundError as error:
            if not error.after_lost_answer:
                raise

    async def insert_scan(
        self,
        map: str,
        points: ArrayLike,
        T_map_sensor: ArrayLike | None = None,
        *,
        wait: Wait = "applied",
        compression: Compression = None,
        **options: Unpack[ScanOptions],
    ) -> ScanReceipt:
        """See `Client.insert_scan`."""
        return await self.insert(map, Scan(points, T_map_sensor, **options), wait=wait, compression=compression)

    async def insert_depth_image(
        self,
        map: str,
        depth_u16: ArrayLike,
        intrinsics: Intrinsics,
        T_map_sensor: ArrayLike | None = None,
        *,
        wait: Wait = "applied",
        compression: Compression = None,
        **options: Unpack[PosedOptions],
    ) -> ScanReceipt:
        """See `Client.insert_depth_image`."""
        scan = DepthScan(depth_u16, intrinsics, T_map_sensor, **options)
        return await self.insert(map, scan, wait=wait, compression=compression)

    async def insert(
        self, map: str, scan: PosedScan, *, wait: Wait = "applied", compression: Compression = None
    ) -> ScanReceipt:
        """See `Client.insert`."""
        answer = await self._answer(self._requests.put_scan(map, scan, wait, compression))
        return ScanReceipt.from_fields(answer.json())

    async def upload_sequence(
        self,
        map: str,
        scans: Scans,
        *,
        progress: bool = True,
        via: Via = "stream",
        wait: Wait = "journaled",
        compression: Compression = None,
        skip_refused: bool = False,
    ) -> SequenceReport:
        """See `Client.upload_sequence`; `scans` may also be an async iterable."""
        if via not in ("stream", "http"):
            raise InvalidInputError(f"via = {via!r} is neither 'stream' nor 'http'")
        upload = SequenceUpload(self, map, scans, progress, compression, skip_refused)
        try:
            await (upload.by_stream() if via == "stream" else upload.by_http())
            if wait == "applied":
                await self.wait_applied(map)
        finally:
            upload.close()
        return upload.report()

    async def wait_applied(self, map: str, sequence: int | None = None, timeout_s: float | None = None) -> MapInfo:
        """See `Client.wait_applied`."""
        waited_s, poll_s, target = 0.0, FIRST_POLL_S, -1
        while True:
            info = await self.map_info(map)
            # Scans are applied in the order of their sequence: once this many are, so is the one waited for.
            if target < 0 and (sequence is None or info.last_sequence >= sequence):
                target = info.scans_acknowledged
            if 0 <= target <= info.scans_applied:
                return info
            if timeout_s is not None and waited_s >= timeout_s:
                raise WaitTimeoutError(f"{info!r} did not get so far within {timeout_s} s")
            await self._transport.sleep(poll_s)
            waited_s, poll_s = waited_s + poll_s, min(2 * poll_s, LAST_POLL_S)

    async def occupancy(
        self, map: str, points: ArrayLike, depth: int | None = None, *, min_revision: int | None = None
    ) -> Occupancy:
        """See `Client.occupancy`."""
        request, count = self._requests.points(map, points, depth, min_revision)
        return Occupancy.from_frame((await self._answer(request)).frame(), count)

    async def boxes(self, map: str, lo: ArrayLike, hi: ArrayLike, *, min_revision: int | None = None) -> Occupancy:
        """See `Client.boxes`."""
        request, count = self._requests.boxes(map, lo, hi, min_revision)
        return Occupancy.from_frame((await self._answer(request)).frame(), count)

    async def cast_rays(
        self,
        map: str,
        origins: ArrayLike,
        directions: ArrayLike,
        max_range_m: float,
        unknown: UnknownPolicy = "free",
        *,
        min_revision: int | None = None,
    ) -> RayHits:
        """See `Client.cast_rays`."""
        request, count = self._requests.rays(map, origins, directions, max_range_m, unknown, min_revision)
        return RayHits.from_frame((await self._answer(request)).frame(), count)

    async def depth_image(
        self,
        map: str,
        shape: tuple[int, int],
        intrinsics: Intrinsics,
        T_map_camera: ArrayLike,
        max_range_m: float | None = None,
        unknown: UnknownPolicy = "free",
    ) -> NDArray[np.float32]:
        """See `Client.depth_image`."""
        request = self._requests.depth_image(map, shape, intrinsics, T_map_camera, max_range_m, unknown)
        frame = (await self._answer(request)).frame()
        frame.expect("depth_image")
        depth_m = frame.array("depth_m", "<f4", columns=int(shape[1]))
        if len(depth_m) != shape[0]:
            raise MalformedAnswerError(f"a depth image of {len(depth_m)} rows answers a question for {shape[0]}")
        return depth_m

    async def check(
        self,
        map: str,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[CheckOptions],
    ) -> CollisionCheck:
        """See `Client.check`."""
        return await self._ask(map, check_question(robot, configurations, T_map_base, options))

    async def check_motion(
        self,
        map: str,
        robot: str | RobotInfo,
        q_from: ArrayLike | None,
        q_to: ArrayLike | None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[MotionOptions],
    ) -> MotionCheck:
        """See `Client.check_motion`."""
        return await self._ask(map, motion_question(robot, q_from, q_to, T_map_base, options))

    async def _ask(self, map: str, question: Question[T]) -> T:
        return question.read((await self._answer(self._requests.question(map, question))).frame())

    def open_queries(self, map: str) -> AsyncQueryStream:
        """See `Client.open_queries`; an async context manager."""
        return AsyncQueryStream(self._transport, self._endpoint, self._policy, self._timeout_s, map)

    async def clearance(
        self,
        map: str,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        *,
        max_clearance_m: float,
        **options: Unpack[RobotOptions],
    ) -> Clearance:
        """See `Client.clearance`."""
        return await self._ask(map, clearance_question(robot, configurations, T_map_base, max_clearance_m, options))

    async def changes(self, map: str, since: int) -> MapChanges:
        """See `Client.changes`."""
        return MapChanges.from_frame((await self._answer(self._requests.changes(map, since))).frame())

    async def clear_box(self, map: str, lo: ArrayLike, hi: ArrayLike) -> ClearReceipt:
        """See `Client.clear_box`."""
        return ClearReceipt.from_fields((await self._answer(self._requests.clear_box(map, lo, hi))).json())

    async def download_map(self, map: str, path: str | os.PathLike[str]) -> Path:
        """See `Client.download_map`."""
        target = Path(path)
        answer = await self._answer(self._requests.export(map, target.suffix.lstrip(".").lower()))
        part = target.with_name(target.name + ".part")
        part.write_bytes(answer.body)
        part.replace(target)
        return target

    async def upload_robot(
        self,
        path: str | os.PathLike[str],
        name: str | None = None,
        *,
        scale: float = 1.0,
        geometry: Geometry = "collision",
    ) -> RobotInfo:
        """See `Client.upload_robot`."""
        upload = RobotUpload.read(path)
        request = self._requests.put_robot(upload, name or upload.name, scale, geometry)
        return RobotInfo.from_fields((await self._answer(request)).json())

    async def list_robots(self) -> list[RobotInfo]:
        """See `Client.list_robots`."""
        answer = (await self._answer(self._requests.get("robots"))).json()
        return [RobotInfo.from_fields(fields) for fields in answer.list_of("robots")]

    async def robot_info(self, name: str) -> RobotInfo:
        """See `Client.robot_info`."""
        return RobotInfo.from_fields((await self._answer(self._requests.robot_info(name))).json())

    async def delete_robot(self, name: str) -> None:
        """See `Client.delete_robot`."""
        try:
            await self._answer(self._requests.delete_robot(name))
        except NotFoundError as error:
            if not error.after_lost_answer:
                raise

    def stream(
        self, map: str, subscribe: bool = False, since: int | None = None, *, compression: Compression = None
    ) -> AsyncScanStream:
        """See `Client.stream`; an async context manager."""
        return AsyncScanStream(
            self._transport, self._endpoint, self._policy, self._timeout_s, map, subscribe, since, compression
        )

    def subscribe(self, map: str, since: int = 0) -> AsyncScanStream:
        """See `Client.subscribe`; iterate with `async for`."""
        return self.stream(map, subscribe=True, since=since)

    async def close(self) -> None:
        """Close the idle connections; streams are closed by themselves."""
        self._pool.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._endpoint.url!r})"
