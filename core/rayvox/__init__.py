"""rayvox: an exact, fast occupancy octree for robots, and the queries planners ask of it.

The kernel's Python API. The HTTP service is `rayvox_service`, its client `rayvox_client`.
"""

from rayvox._native import instruction_set, set_thread_count, thread_count
from rayvox.errors import (
    EngineUnavailableError,
    InvalidInputError,
    MapFormatError,
    OutOfRangeError,
    RayvoxError,
)
from rayvox.map_snapshot import MapSnapshot
from rayvox.occupancy_map import ENGINES, Engine, OccupancyMap, PreparedScan
from rayvox.pinhole_camera import PinholeCamera
from rayvox.results import ChangeSet, MapStatistics, RayHits, ScanResult, ScanStatistics
from rayvox.sensor_model import SensorModel

__version__ = "0.1.0"

__all__ = [
    "ENGINES",
    "ChangeSet",
    "Engine",
    "EngineUnavailableError",
    "InvalidInputError",
    "MapFormatError",
    "MapSnapshot",
    "MapStatistics",
    "OccupancyMap",
    "OutOfRangeError",
    "PinholeCamera",
    "PreparedScan",
    "RayHits",
    "RayvoxError",
    "ScanResult",
    "ScanStatistics",
    "SensorModel",
    "__version__",
    "instruction_set",
    "set_thread_count",
    "thread_count",
]
