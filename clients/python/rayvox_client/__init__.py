"""rayvox_client: scans into a rayvox mapping service, occupancy out; numpy at both ends."""

from rayvox_client.async_client import AsyncClient
from rayvox_client.async_query_stream import AsyncPendingAnswer, AsyncQueryStream
from rayvox_client.async_stream import AsyncScanStream
from rayvox_client.attached_object import AttachedObject
from rayvox_client.clearance import Clearance
from rayvox_client.client import Client
from rayvox_client.collisions import POSE_FREE, POSE_OCCUPIED, POSE_UNKNOWN, CollisionCheck, MotionCheck, VoxelContacts
from rayvox_client.errors import (
    ConflictError,
    ConnectionFailedError,
    InvalidFrameError,
    InvalidInputError,
    InvalidMapNameError,
    MalformedAnswerError,
    MapExistsError,
    MapNotFoundError,
    NotFoundError,
    OutOfRangeError,
    OutOfStepError,
    OverloadedError,
    RayvoxClientError,
    RefusedInputError,
    RobotExistsError,
    RobotNotFoundError,
    ScanConflictError,
    ServiceError,
    ServiceTimeoutError,
    TooLargeError,
    UnauthorizedError,
    UnavailableError,
    WaitTimeoutError,
)
from rayvox_client.intrinsics import Intrinsics
from rayvox_client.map_changes import MapChanges
from rayvox_client.map_copy import MapCopy
from rayvox_client.map_info import MapInfo, ServiceVersion
from rayvox_client.occupancy import FREE, OCCUPIED, UNKNOWN, Occupancy, RayHits
from rayvox_client.query_stream import PendingAnswer, QueryStream
from rayvox_client.receipt import ClearReceipt, RefusedScan, ScanAck, ScanReceipt
from rayvox_client.retry import RetryPolicy
from rayvox_client.robot_info import RobotInfo, RobotLink
from rayvox_client.scan import DepthScan, PosedScan, Scan
from rayvox_client.self_filter import SelfFilter
from rayvox_client.sensor_model import SensorModel
from rayvox_client.sequence import SequenceReport
from rayvox_client.stream import ScanStream

__all__ = [
    "FREE",
    "OCCUPIED",
    "POSE_FREE",
    "POSE_OCCUPIED",
    "POSE_UNKNOWN",
    "UNKNOWN",
    "AsyncClient",
    "AsyncPendingAnswer",
    "AsyncQueryStream",
    "AsyncScanStream",
    "AttachedObject",
    "ClearReceipt",
    "Clearance",
    "Client",
    "CollisionCheck",
    "ConflictError",
    "ConnectionFailedError",
    "DepthScan",
    "Intrinsics",
    "InvalidFrameError",
    "InvalidInputError",
    "InvalidMapNameError",
    "MalformedAnswerError",
    "MapChanges",
    "MapCopy",
    "MapExistsError",
    "MapInfo",
    "MapNotFoundError",
    "MotionCheck",
    "NotFoundError",
    "Occupancy",
    "OutOfRangeError",
    "OutOfStepError",
    "OverloadedError",
    "PendingAnswer",
    "PosedScan",
    "QueryStream",
    "RayHits",
    "RayvoxClientError",
    "RefusedInputError",
    "RefusedScan",
    "RetryPolicy",
    "RobotExistsError",
    "RobotInfo",
    "RobotLink",
    "RobotNotFoundError",
    "Scan",
    "ScanAck",
    "ScanConflictError",
    "ScanReceipt",
    "ScanStream",
    "SelfFilter",
    "SensorModel",
    "SequenceReport",
    "ServiceError",
    "ServiceTimeoutError",
    "ServiceVersion",
    "TooLargeError",
    "UnauthorizedError",
    "UnavailableError",
    "VoxelContacts",
    "WaitTimeoutError",
]
