"""Scans and poses from files. open3d and Pillow are imported only when a file needs them."""

from .depth_image import DepthIntrinsics, depth_to_points, read_depth_png
from .open3d_cloud import decode_cloud, read_cloud
from .points_file import PointsFile
from .pose_file import PoseFile, read_poses
from .raw_points import read_bin, read_npy
from .recording import POSE_FILE_NAME, Recording
from .scan_file import SCAN_SUFFIXES, read_points
from .scan_folder import PosedFile, list_scan_files, match_poses

__all__ = [
    "POSE_FILE_NAME",
    "SCAN_SUFFIXES",
    "DepthIntrinsics",
    "PointsFile",
    "PoseFile",
    "PosedFile",
    "Recording",
    "decode_cloud",
    "depth_to_points",
    "list_scan_files",
    "match_poses",
    "read_bin",
    "read_cloud",
    "read_depth_png",
    "read_npy",
    "read_points",
    "read_poses",
]
