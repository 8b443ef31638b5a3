"""The client with calls that block."""

from __future__ import annotations

import os
import ssl
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rayvox_client.async_client import AsyncClient, Geometry, Wait
from rayvox_client.blocking_transport import BlockingTransport
from rayvox_client.clearance import Clearance
from rayvox_client.collisions import CollisionCheck, MotionCheck
from rayvox_client.endpoint import Endpoint
from rayvox_client.frame import Compression
from rayvox_client.intrinsics import Intrinsics
from rayvox_client.map_changes import MapChanges
from rayvox_client.map_info import MapInfo, ServiceVersion
from rayvox_client.occupancy import Occupancy, RayHits
from rayvox_client.query_stream import QueryStream
from rayvox_client.receipt import ClearReceipt, ScanReceipt
from rayvox_client.retry import RetryPolicy
from rayvox_client.robot_info import RobotInfo
from rayvox_client.robot_question import CheckOptions, MotionOptions, RobotOptions, UnknownPolicy
from rayvox_client.scan import PosedOptions, PosedScan, ScanOptions
from rayvox_client.sensor_model import SensorModel
from rayvox_client.sequence import SequenceReport, Via
from rayvox_client.stream import ScanStream
from rayvox_client.transport import run_blocking


class Client:
    """Client of a rayvox service. Threads may share it; streams belong to one thread each.

        client = Client("http://127.0.0.1:8080")
        client.create_map("lab", resolution_m=0.05, exist_ok=True)
        client.insert_scan("lab", points, T_map_sensor)
        client.occupancy("lab", [[1.0, 0.0, 0.5]]).states

    Args:
        url: `http://host:port` or `https://host:port`, with a path prefix if the service is behind a proxy.
        api_key: sent as a bearer token.
        timeout_s: longest wait for a connection, for a request to go out, or for the next bytes of an answer.
        retries: attempts after a failed connection, 429 or 503; or a whole `RetryPolicy`.
        ssl_context: for https; the system's trust store by default.

    Every method raises `ConnectionFailedError` or `OverloadedError` when the retries are used up, `UnauthorizedError`
    without a valid key, and `MapNotFoundError` for a map that does not exist. Points, boxes and rays are in the map
    frame, metres, float32 or float64.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        api_key: str | None = None,
        timeout_s: float = 30.0,
        retries: int | RetryPolicy = 5,
        *,
        ssl_context: ssl.SSLContext | None = None,
    ) -> None:
        transport = BlockingTransport(Endpoint.parse(url, api_key), timeout_s, ssl_context)
        self._client = AsyncClient(url, api_key, timeout_s, retries, transport=transport)

    def health(self) -> str:
        """ "ok" when the service answers."""
        return run_blocking(self._client.health())

    def version(self) -> ServiceVersion:
        """Versions of service, kernel and API."""
        return run_blocking(self._client.version())

    def create_map(
        self,
        name: str,
        resolution_m: float | None = None,
        depth: int | None = None,
        sensor_model: SensorModel | None = None,
        exist_ok: bool = False,
    ) -> MapInfo:
        """Create a map.

        Args:
            name: 1 to 64 letters, digits, `_`, `-` or `.`, starting with a letter or digit.
            resolution_m: edge of a finest-level cell, metres; None for the service's own default.
            depth: levels, up to 21; None for the service's own default.
            sensor_model: OctoMap's by default.
            exist_ok: take an existing map with the same settings.

        Raises:
            MapExistsError: it exists (with `exist_ok`: with other settings).
            InvalidInputError: name, resolution, depth or model cannot be used.
        """
        return run_blocking(self._client.create_map(name, resolution_m, depth, sensor_model, exist_ok))

    def list_maps(self) -> list[MapInfo]:
        """All maps."""
        return run_blocking(self._client.list_maps())

    def map_info(self, name: str, statistics: bool = False) -> MapInfo:
        """One map; with `statistics` also its leaf counts, volumes and bounds, which take longer."""
        return run_blocking(self._client.map_info(name, statistics))

    def delete_map(self, name: str) -> None:
        """Delete a map and everything the service has on disk for it."""
        run_blocking(self._client.delete_map(name))

    def insert_scan(
        self,
        map: str,
        points: ArrayLike,
        T_map_sensor: ArrayLike | None = None,
        *,
        wait: Wait = "applied",
        compression: Compression = None,
        **options: Unpack[ScanOptions],
    ) -> ScanReceipt:
        """Insert one scan; it is on the service's disk when this returns.

        Args:
            points: (n,3) float32 or float64, sensor frame, metres, all finite.
            T_map_sensor: (4,4) rigid transform from the sensor to the map frame; None for identity.
            wait: return when the map shows the scan ("applied"), or as soon as it is on disk ("journaled").
            compression: "zstd" for slow networks.
            **options: `origin` of the beams in the sensor frame; `max_range_m`; `no_return`, (k,3) direction times
                range of beams that met nothing; `discretize`; `scan_id`; `stamp_s`; `scale_m` for int16 points;
                `self_filter`, a `SelfFilter` that leaves the robot itself out of the map.

        Raises:
            InvalidInputError: wrong shape, not finite, not rigid, empty, or beyond the map's range.
            ScanConflictError: the map holds another scan under this scan_id.
            TooLargeError: more points or bytes than the service takes.
            ServiceTimeoutError: on disk, but not applied in the time that the service waits.
        """
        return run_blocking(
            self._client.insert_scan(map, points, T_map_sensor, wait=wait, compression=compression, **options)
        )

    def insert_depth_image(
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
        """Insert one depth image.

        Args:
            depth_u16: (rows, columns) uint16, 0 meaning no measurement.
            intrinsics: focal lengths and centre in pixels, metres per unit.
            T_map_sensor: (4,4) rigid transform from the camera's optical frame (z forward, x right, y down).
            Others, and errors: as `insert_scan`.
        """
        return run_blocking(
            self._client.insert_depth_image(
                map, depth_u16, intrinsics, T_map_sensor, wait=wait, compression=compression, **options
            )
        )

    def insert(
        self, map: str, scan: PosedScan, *, wait: Wait = "applied", compression: Compression = None
    ) -> ScanReceipt:
        """Insert a `Scan` or `DepthScan`; otherwise as `insert_scan`."""
        return run_blocking(self._client.insert(map, scan, wait=wait, compression=compression))

    def upload_sequence(
        self,
        map: str,
        scans: Iterable[PosedScan],
        *,
        progress: bool = True,
        via: Via = "stream",
        wait: Wait = "journaled",
        compression: Compression = None,
        skip_refused: bool = False,
    ) -> SequenceReport:
        """Upload scans in order, with a progress bar (scans, points per second).

        Args:
            scans: `Scan` and `DepthScan`, read one at a time.
            via: "stream" keeps several in flight; "http" sends one after the other.
            wait: "applied" returns only when the map shows them all.
            skip_refused: go on after a scan that the service refuses, and list it in the report. Otherwise the
                upload stops there and raises that scan's typed error.
        """
        return run_blocking(
            self._client.upload_sequence(
                map,
                scans,
                progress=progress,
                via=via,
                wait=wait,
                compression=compression,
                skip_refused=skip_refused,
            )
        )

    def wait_applied(self, map: str, sequence: int | None = None, timeout_s: float | None = None) -> MapInfo:
        """Wait until the map shows the scan of this journal `sequence`, or all that are acknowledged now.

        Raises:
            WaitTimeoutError: not within `timeout_s`; None waits for ever.
        """
        return run_blocking(self._client.wait_applied(map, sequence, timeout_s))

    def occupancy(
        self, map: str, points: ArrayLike, depth: int | None = None, *, min_revision: int | None = None
    ) -> Occupancy:
        """States and log-odds at (n,3) points.

        Args:
            depth: ask coarser octree nodes, 0 the root; None for the finest.
            min_revision: wait until the map has got so far.

        Raises:
            InvalidInputError: wrong shape or not finite.
            ServiceTimeoutError: `min_revision` did not come in the time that the service waits.
        """
        return run_blocking(self._client.occupancy(map, points, depth, min_revision=min_revision))

    def boxes(self, map: str, lo: ArrayLike, hi: ArrayLike, *, min_revision: int | None = None) -> Occupancy:
        """States of axis-aligned boxes with corners (n,3) `lo` <= `hi`.

        2 where any occupied voxel touches the box, else 0 where any part is unknown, else 1. `log_odds` is None.
        """
        return run_blocking(self._client.boxes(map, lo, hi, min_revision=min_revision))

    def cast_rays(
        self,
        map: str,
        origins: ArrayLike,
        directions: ArrayLike,
        max_range_m: float,
        unknown: UnknownPolicy = "free",
        *,
        min_revision: int | None = None,
    ) -> RayHits:
        """What rays meet first within `max_range_m`.

        Args:
            origins: (n,3), or (1,3) for all rays. directions: (n,3) of any length but 0.
            unknown: whether rays pass unknown space ("free") or end there ("occupied").
        """
        return run_blocking(
            self._client.cast_rays(map, origins, directions, max_range_m, unknown, min_revision=min_revision)
        )

    def depth_image(
        self,
        map: str,
        shape: tuple[int, int],
        intrinsics: Intrinsics,
        T_map_camera: ArrayLike,
        max_range_m: float | None = None,
        unknown: UnknownPolicy = "free",
    ) -> NDArray[np.float32]:
        """What a depth camera would measure in the map: `shape` (rows, columns) float32, metres along its axis.

        Args:
            T_map_camera: (4,4) rigid transform from the camera's optical frame (z forward, x right, y down).
            intrinsics: its `depth_scale_m` is not used: depths are metres, 0 where no occupied voxel is met.
            unknown: whether rays pass unknown space ("free") or end there, without a depth ("occupied").
        """
        return run_blocking(self._client.depth_image(map, shape, intrinsics, T_map_camera, max_range_m, unknown))

    def check(
        self,
        map: str,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[CheckOptions],
    ) -> CollisionCheck:
        """Whether a robot collides with the map, at configurations and base poses.

        Args:
            robot: its name, or what `upload_robot` returned.
            configurations: (n,j) joint values in the order of `RobotInfo.joint_names`, radians and metres; None for a
                robot without joints.
            T_map_base: (n,4,4) rigid poses of the robot's base; None for identity. One of either goes with any number
                of the other.
            unknown: whether unknown space is passed ("free", the default), or met as verdict 2 ("occupied").
            padding_m: grows every link; or a mapping, the links it names.
            occupancy_threshold: probability from which on a voxel is occupied; None for the map's own.
            accuracy_m: lets the service take simpler meshes: no collision is missed, but a pose may count as colliding
                that comes within so many metres of a voxel; None for the meshes as they are.
            self_collision: also say where links touch each other that must not.
            allow, forbid: pairs of link names that may touch each other too, and that may not after all.
            attached: `AttachedObject`s that the robot holds.
            contacts: "first" voxel met per pose, or "all" (of a few poses).
            min_revision: wait until the map has got so far.

        Raises:
            RobotNotFoundError: there is no such robot.
            InvalidInputError: wrong shape, not finite or not rigid.
            TooLargeError: more poses than the service takes.
            ServiceTimeoutError: `min_revision` did not come in the time that the service waits.
        """
        return run_blocking(self._client.check(map, robot, configurations, T_map_base, **options))

    def check_motion(
        self,
        map: str,
        robot: str | RobotInfo,
        q_from: ArrayLike | None,
        q_to: ArrayLike | None,
        T_map_base: ArrayLike | None = None,
        **options: Unpack[MotionOptions],
    ) -> MotionCheck:
        """Whether motions collide with the map anywhere, on which all joints and the base move at constant speed.

        No collision lies between samples. A path is checked as `check_motion(map, robot, path[:-1], path[1:])`.

        Args:
            q_from, q_to: (n,j) joint values; None for a robot without joints.
            T_map_base: (n,4,4) rigid poses of the robot's base at the start; None for identity. One of each goes with
                any number of the others.
            T_map_base_to: (n,4,4) its poses at the end, to which it goes straight, turning about one axis; it rests if
                this is not given.
            tolerance_m: a motion that passes an obstacle closer than this may be reported as colliding; 5 mm if not
                given.
            Others, and errors: as `check`, without those about contacts and self-collision.
        """
        return run_blocking(self._client.check_motion(map, robot, q_from, q_to, T_map_base, **options))

    def open_queries(self, map: str) -> QueryStream:
        """A connection for many questions to one map, to be used as a context manager; see `QueryStream`."""
        return QueryStream(self._client.open_queries(map))

    def clearance(
        self,
        map: str,
        robot: str | RobotInfo,
        configurations: ArrayLike | None = None,
        T_map_base: ArrayLike | None = None,
        *,
        max_clearance_m: float,
        **options: Unpack[RobotOptions],
    ) -> Clearance:
        """How far a robot is from the nearest occupied voxel, and in which direction that lies.

        Args:
            max_clearance_m: nothing is looked for beyond it; a pose with nothing nearer gets it as a lower bound.
            unknown: whether unknown space counts as occupied.
            padding_m: grows every link, and makes every distance at least as much shorter.

        The other arguments are those of `check`. Raises: as `check`.
        """
        clearance = self._client.clearance(
            map, robot, configurations, T_map_base, max_clearance_m=max_clearance_m, **options
        )
        return run_blocking(clearance)

    def changes(self, map: str, since: int) -> MapChanges:
        """What changed after revision `since`; 0 for everything."""
        return run_blocking(self._client.changes(map, since))

    def clear_box(self, map: str, lo: ArrayLike, hi: ArrayLike) -> ClearReceipt:
        """Make everything within the box from `lo` to `hi` (3 numbers each, metres) unknown.

        A retry after a lost answer clears again, and with it what others inserted there in between.
        """
        return run_blocking(self._client.clear_box(map, lo, hi))

    def download_map(self, map: str, path: str | os.PathLike[str]) -> Path:
        """Export to `path`, as its suffix says: .bt or .ot (OctoMap), .ply (occupied leaves). An existing file is
        replaced only when all has arrived."""
        return run_blocking(self._client.download_map(map, path))

    def upload_robot(
        self,
        path: str | os.PathLike[str],
        name: str | None = None,
        *,
        scale: float = 1.0,
        geometry: Geometry = "collision",
    ) -> RobotInfo:
        """Upload a robot; it is on the service's disk when this returns. The same upload again changes nothing.

        Args:
            path: a rigid mesh (.stl, .obj, .ply, .off, .dae, .glb), a .zip with a URDF and its meshes, a .urdf file
                (its folder is sent along), or a folder that holds one URDF.
            name: 1 to 64 letters, digits, `_`, `-` or `.`; the file's or folder's own by default.
            scale: metres per unit of a mesh file.
            geometry: what of a URDF collides.

        Raises:
            RobotExistsError: another robot of this name exists.
            InvalidInputError: a file that is corrupt, or uses what the service does not support.
            TooLargeError: more bytes or triangles than the service takes, or too slow to read.
        """
        return run_blocking(self._client.upload_robot(path, name, scale=scale, geometry=geometry))

    def list_robots(self) -> list[RobotInfo]:
        """All robots, without their limits and links."""
        return run_blocking(self._client.list_robots())

    def robot_info(self, name: str) -> RobotInfo:
        """One robot. Raises RobotNotFoundError."""
        return run_blocking(self._client.robot_info(name))

    def delete_robot(self, name: str) -> None:
        """Delete a robot. Raises RobotNotFoundError."""
        run_blocking(self._client.delete_robot(name))

    def stream(
        self, map: str, subscribe: bool = False, since: int | None = None, *, compression: Compression = None
    ) -> ScanStream:
        """A stream of scans into the map, to be used as a context manager; see `ScanStream`.

        Args:
            subscribe: receive the map's changes on it too, beginning with what changed
                after revision `since`; None begins with the whole map.
        """
        return ScanStream(self._client.stream(map, subscribe, since, compression=compression))

    def subscribe(self, map: str, since: int = 0) -> ScanStream:
        """The map's changes as they come, endlessly, from revision `since` on; reconnects by itself.

        copy = MapCopy()
        for change in client.subscribe("lab"):
            change.apply_to(copy)
        """
        return self.stream(map, subscribe=True, since=since)

    def close(self) -> None:
        """Close the idle connections; streams are closed by themselves."""
        run_blocking(self._client.close())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return repr(self._client).replace("Async", "", 1)
