"""rayvox: an exact, fast occupancy octree for robots, and the queries planners ask of it.

The kernel's Python API. The HTTP service is `rayvox_service`, its client `rayvox_client`.
"""

from rayvox._native import CancellationToken, instruction_set, set_thread_count, spare_threads, thread_count
from rayvox.clearance import Clearance
from rayvox.collide import CollisionContacts, TraversalStatistics, collide
from rayvox.collision_checker import CollisionCheck, CollisionChecker, CollisionVerdict, VoxelContacts
from rayvox.collision_mesh import CollisionMesh, MeshBvh
from rayvox.errors import (
    EngineUnavailableError,
    InvalidInputError,
    LoadLimitError,
    MapFormatError,
    MeshFormatError,
    OutOfRangeError,
    QueryCancelledError,
    RayvoxError,
    RobotFormatError,
)
from rayvox.map_snapshot import MapSnapshot
from rayvox.mesh_io import LoadLimits, TriangleMesh
from rayvox.motion_check import MotionCheck, PathCheck
from rayvox.occupancy_map import ENGINES, Engine, OccupancyMap, PreparedScan
from rayvox.pinhole_camera import PinholeCamera
from rayvox.results import ChangeSet, MapStatistics, RayHits, ScanResult, ScanStatistics
from rayvox.robot import BodyFilter, Robot, ScanPoint
from rayvox.self_collision import links_touch
from rayvox.sensor_model import SensorModel

__version__ = "0.1.0"

__all__ = [
    "ENGINES",
    "BodyFilter",
    "CancellationToken",
    "ChangeSet",
    "Clearance",
    "CollisionCheck",
    "CollisionChecker",
    "CollisionContacts",
    "CollisionMesh",
    "CollisionVerdict",
    "Engine",
    "EngineUnavailableError",
    "InvalidInputError",
    "LoadLimitError",
    "LoadLimits",
    "MapFormatError",
    "MapSnapshot",
    "MapStatistics",
    "MeshBvh",
    "MeshFormatError",
    "MotionCheck",
    "OccupancyMap",
    "OutOfRangeError",
    "PathCheck",
    "PinholeCamera",
    "PreparedScan",
    "QueryCancelledError",
    "RayHits",
    "RayvoxError",
    "Robot",
    "RobotFormatError",
    "ScanPoint",
    "ScanResult",
    "ScanStatistics",
    "SensorModel",
    "TraversalStatistics",
    "TriangleMesh",
    "VoxelContacts",
    "__version__",
    "collide",
    "instruction_set",
    "links_touch",
    "set_thread_count",
    "spare_threads",
    "thread_count",
]
