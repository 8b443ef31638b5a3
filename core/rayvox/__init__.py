"""rayvox: an exact, fast occupancy octree for robots, and the queries planners ask of it.

The kernel's Python API. The HTTP service is `rayvox_service`, its client `rayvox_client`.
"""

from rayvox._native import instruction_set, set_thread_count, thread_count
from rayvox.errors import (
    EngineUnavailableError,
    InvalidInputError,
    LoadLimitError,
    MapFormatError,
    MeshFormatError,
    OutOfRangeError,
    RayvoxError,
    RobotFormatError,
)
from rayvox.map_snapshot import MapSnapshot
from rayvox.mesh_io import LoadLimits, TriangleMesh
from rayvox.occupancy_map import OccupancyMap, PreparedScan
from rayvox.results import ChangeSet, MapStatistics, RayHits, ScanResult, ScanStatistics
from rayvox.robot import Robot
from rayvox.sensor_model import SensorModel

__version__ = "0.1.0"

__all__ = [
    "ChangeSet",
    "EngineUnavailableError",
    "InvalidInputError",
    "LoadLimitError",
    "LoadLimits",
    "MapFormatError",
    "MapSnapshot",
    "MapStatistics",
    "MeshFormatError",
    "OccupancyMap",
    "OutOfRangeError",
    "PreparedScan",
    "RayHits",
    "RayvoxError",
    "Robot",
    "RobotFormatError",
    "ScanResult",
    "ScanStatistics",
    "SensorModel",
    "TriangleMesh",
    "__version__",
    "instruction_set",
    "set_thread_count",
    "thread_count",
]
