"""Frames written out from docs/frame.md by hand, with no codec: they bind the service's and the client's.

`python tests/golden/golden_frames.py` writes the .bin files next to this one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class GoldenFrame:
    """`payloads` are (offset, bytes); header offsets in `header` were counted by hand."""

    header: str
    payloads: tuple[tuple[int, bytes], ...]

    def to_bytes(self) -> bytes:
        body = bytearray(self.header.encode())
        for offset, payload in self.payloads:
            body += bytes(offset - 24 - len(body)) + payload
        if not self.payloads:
            body += bytes(-(24 + len(body)) % 64)
        prefix = b"RVX1" + struct.pack("<IQ", len(self.header.encode()), 24 + len(body))
        return prefix + struct.pack("<II", slow_crc32c(bytes(body)), 0) + bytes(body)


def slow_crc32c(data: bytes) -> int:
    """Castagnoli's polynomial, bit by bit, reflected."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


SCAN_ID = "00112233-4455-6677-8899-aabbccddeeff"
POSE = "[1.0,0.0,0.0,0.5,0.0,1.0,0.0,-1.25,0.0,0.0,1.0,2.0,0.0,0.0,0.0,1.0]"
NAN = float("nan")

FRAMES = {
    "scan": GoldenFrame(
        '{"kind":"scan","scan_id":"' + SCAN_ID + '","T_map_sensor":' + POSE + ","
        '"origin":[0.0,0.0,0.25],"max_range_m":30.0,"discretize":false,"stamp_s":12.5,"payloads":['
        '{"name":"points","dtype":"<f4","shape":[3,3],"offset":448,"nbytes":36,"encoding":"raw"},'
        '{"name":"no_return","dtype":"<f8","shape":[1,3],"offset":512,"nbytes":24,"encoding":"raw"}]}',
        (
            (448, struct.pack("<9f", 1.0, 2.0, 3.0, -1.5, 0.25, 4.0, 7.0, -8.0, 0.125)),
            (512, struct.pack("<3d", 0.0, 20.0, 0.0)),
        ),
    ),
    "scan_millimetres": GoldenFrame(
        '{"kind":"scan","scan_id":"' + SCAN_ID + '","T_map_sensor":' + POSE + ',"scale_m":0.001,"payloads":['
        '{"name":"points","dtype":"<i2","shape":[2,3],"offset":320,"nbytes":12,"encoding":"raw"}]}',
        ((320, struct.pack("<6h", 1000, -2000, 3000, -32768, 32767, 1)),),
    ),
    "scan_depth": GoldenFrame(
        '{"kind":"scan","scan_id":"' + SCAN_ID + '","T_map_sensor":' + POSE + ","
        '"intrinsics":{"fx":500.0,"fy":510.0,"cx":1.0,"cy":0.5,"depth_scale_m":0.001},"payloads":['
        '{"name":"depth","dtype":"<u2","shape":[2,3],"offset":384,"nbytes":12,"encoding":"raw"}]}',
        ((384, struct.pack("<6H", 0, 1000, 2000, 65535, 1, 500)),),
    ),
    "scan_self_filter": GoldenFrame(
        '{"kind":"scan","scan_id":"' + SCAN_ID + '","T_map_sensor":' + POSE + ","
        '"origin":[0.0,0.0,0.0],"max_range_m":null,"discretize":false,"stamp_s":null,"self_filter":{"robot":"arm",'
        '"configuration":[0.5,-1.25],"T_link_sensor":' + POSE + ',"sensor_link":"hand","padding_m":0.25},"payloads":['
        '{"name":"points","dtype":"<f4","shape":[1,3],"offset":576,"nbytes":12,"encoding":"raw"}]}',
        ((576, struct.pack("<3f", 1.0, 2.0, 3.0)),),
    ),
    "clear_box": GoldenFrame('{"kind":"clear_box","lo":[-1.0,-2.0,0.0],"hi":[1.0,2.5,3.0],"payloads":[]}', ()),
    "points": GoldenFrame(
        '{"kind":"points","depth":14,"payloads":['
        '{"name":"points","dtype":"<f8","shape":[2,3],"offset":192,"nbytes":48,"encoding":"raw"}]}',
        ((192, struct.pack("<6d", 1.0, 2.0, 3.0, 1e6, -1e6, 0.5)),),
    ),
    "occupancy": GoldenFrame(
        '{"kind":"occupancy","revision":7,"payloads":['
        '{"name":"states","dtype":"|u1","shape":[3],"offset":256,"nbytes":3,"encoding":"raw"},'
        '{"name":"log_odds","dtype":"<f4","shape":[3],"offset":320,"nbytes":12,"encoding":"raw"}]}',
        ((256, bytes([0, 1, 2])), (320, struct.pack("<3f", NAN, -0.40625, 3.5))),
    ),
    "boxes": GoldenFrame(
        '{"kind":"boxes","payloads":['
        '{"name":"lo","dtype":"<f8","shape":[1,3],"offset":256,"nbytes":24,"encoding":"raw"},'
        '{"name":"hi","dtype":"<f8","shape":[1,3],"offset":320,"nbytes":24,"encoding":"raw"}]}',
        ((256, struct.pack("<3d", -1.0, -1.0, 0.0)), (320, struct.pack("<3d", 1.0, 1.0, 2.0))),
    ),
    "rays": GoldenFrame(
        '{"kind":"rays","max_range_m":12.5,"unknown":"occupied","payloads":['
        '{"name":"origins","dtype":"<f4","shape":[1,3],"offset":320,"nbytes":12,"encoding":"raw"},'
        '{"name":"directions","dtype":"<f4","shape":[1,3],"offset":384,"nbytes":12,"encoding":"raw"}]}',
        ((320, struct.pack("<3f", 0.0, 0.0, 1.0)), (384, struct.pack("<3f", 1.0, 0.0, 0.0))),
    ),
    "hits": GoldenFrame(
        '{"kind":"hits","revision":9,"payloads":['
        '{"name":"hit","dtype":"|u1","shape":[2],"offset":320,"nbytes":2,"encoding":"raw"},'
        '{"name":"t_m","dtype":"<f8","shape":[2],"offset":384,"nbytes":16,"encoding":"raw"},'
        '{"name":"voxel","dtype":"<i8","shape":[2,3],"offset":448,"nbytes":48,"encoding":"raw"}]}',
        (
            (320, bytes([1, 0])),
            (384, struct.pack("<2d", 4.25, NAN)),
            (448, struct.pack("<6q", 10, -20, 30, 0, 0, 0)),
        ),
    ),
    "collisions": GoldenFrame(
        '{"kind":"collisions","robot":"arm","unknown":"occupied","padding_m":0.25,"occupancy_threshold":0.75,'
        '"self_collision":true,"contacts":"first","payloads":['
        '{"name":"configurations","dtype":"<f8","shape":[1,2],"offset":384,"nbytes":16,"encoding":"raw"},'
        '{"name":"T_map_base","dtype":"<f8","shape":[1,4,4],"offset":448,"nbytes":128,"encoding":"raw"}]}',
        (
            (384, struct.pack("<2d", 0.5, -1.25)),
            (448, struct.pack("<16d", 1, 0, 0, 0.5, 0, 1, 0, -1.25, 0, 0, 1, 2, 0, 0, 0, 1)),
        ),
    ),
    "verdicts": GoldenFrame(
        '{"kind":"verdicts","revision":11,"payloads":['
        '{"name":"verdicts","dtype":"|u1","shape":[3],"offset":768,"nbytes":3,"encoding":"raw"},'
        '{"name":"self_colliding","dtype":"|u1","shape":[3],"offset":832,"nbytes":3,"encoding":"raw"},'
        '{"name":"contact_pose","dtype":"<i4","shape":[2],"offset":896,"nbytes":8,"encoding":"raw"},'
        '{"name":"contact_link","dtype":"<i4","shape":[2],"offset":960,"nbytes":8,"encoding":"raw"},'
        '{"name":"contact_centre_m","dtype":"<f8","shape":[2,3],"offset":1024,"nbytes":48,"encoding":"raw"},'
        '{"name":"contact_size_m","dtype":"<f8","shape":[2],"offset":1088,"nbytes":16,"encoding":"raw"},'
        '{"name":"contact_log_odds","dtype":"<f4","shape":[2],"offset":1152,"nbytes":8,"encoding":"raw"}]}',
        (
            (768, bytes([0, 1, 2])),
            (832, bytes([0, 0, 1])),
            (896, struct.pack("<2i", 1, 2)),
            (960, struct.pack("<2i", 3, 0)),
            (1024, struct.pack("<6d", 0.05, 0.15, -0.25, 1.0, 2.0, 3.0)),
            (1088, struct.pack("<2d", 0.1, 0.4)),
            (1152, struct.pack("<2f", 0.84375, NAN)),
        ),
    ),
    "clearances": GoldenFrame(
        '{"kind":"verdicts","revision":12,"payloads":['
        '{"name":"verdicts","dtype":"|u1","shape":[2],"offset":896,"nbytes":2,"encoding":"raw"},'
        '{"name":"clearance_m","dtype":"<f8","shape":[2],"offset":960,"nbytes":16,"encoding":"raw"},'
        '{"name":"clearance_is_lower_bound","dtype":"|u1","shape":[2],"offset":1024,"nbytes":2,"encoding":"raw"},'
        '{"name":"clearance_direction","dtype":"<f8","shape":[2,3],"offset":1088,"nbytes":48,"encoding":"raw"},'
        '{"name":"clearance_link","dtype":"<i4","shape":[2],"offset":1152,"nbytes":8,"encoding":"raw"},'
        '{"name":"clearance_point_m","dtype":"<f8","shape":[2,3],"offset":1216,"nbytes":48,"encoding":"raw"},'
        '{"name":"clearance_voxel_centre_m","dtype":"<f8","shape":[2,3],"offset":1280,"nbytes":48,"encoding":"raw"},'
        '{"name":"clearance_voxel_size_m","dtype":"<f8","shape":[2],"offset":1344,"nbytes":16,"encoding":"raw"}]}',
        (
            (896, bytes([0, 0])),
            (960, struct.pack("<2d", 0.25, 0.5)),
            (1024, bytes([0, 1])),
            (1088, struct.pack("<6d", 0.0, 0.6, -0.8, NAN, NAN, NAN)),
            (1152, struct.pack("<2i", 3, -1)),
            (1216, struct.pack("<6d", 1.0, 2.0, 3.0, NAN, NAN, NAN)),
            (1280, struct.pack("<6d", 1.05, 2.15, 2.75, NAN, NAN, NAN)),
            (1344, struct.pack("<2d", 0.1, NAN)),
        ),
    ),
    "motions": GoldenFrame(
        '{"kind":"motions","robot":"arm","tolerance_m":0.125,"unknown":"free","attached":[{"name":"load","link":"hand",'
        '"T_link_object":' + POSE + ',"padding_m":0.0,"touch_links":["left"],"box":[0.5,0.25,1.0]}],"payloads":['
        '{"name":"q_from","dtype":"<f8","shape":[1,2],"offset":576,"nbytes":16,"encoding":"raw"},'
        '{"name":"q_to","dtype":"<f8","shape":[2,2],"offset":640,"nbytes":32,"encoding":"raw"},'
        '{"name":"T_map_base","dtype":"<f8","shape":[1,4,4],"offset":704,"nbytes":128,"encoding":"raw"}]}',
        (
            (576, struct.pack("<2d", 0.5, -1.25)),
            (640, struct.pack("<4d", 1.0, 2.0, -3.0, 0.25)),
            (704, struct.pack("<16d", 1, 0, 0, 0.5, 0, 1, 0, -1.25, 0, 0, 1, 2, 0, 0, 0, 1)),
        ),
    ),
    "motion_verdicts": GoldenFrame(
        '{"kind":"motion_verdicts","revision":12,"tolerance_m":0.125,"payloads":['
        '{"name":"verdicts","dtype":"|u1","shape":[2],"offset":320,"nbytes":2,"encoding":"raw"},'
        '{"name":"free_until","dtype":"<f8","shape":[2],"offset":384,"nbytes":16,"encoding":"raw"}]}',
        ((320, bytes([0, 1])), (384, struct.pack("<2d", 1.0, 0.375))),
    ),
    "changes": GoldenFrame(
        '{"kind":"changes","since":3,"revision":5,"full":false,"resolution_m":0.05,"depth":16,"payloads":['
        '{"name":"region_keys","dtype":"<i4","shape":[1,3],"offset":576,"nbytes":12,"encoding":"raw"},'
        '{"name":"region_depth","dtype":"|u1","shape":[1],"offset":640,"nbytes":1,"encoding":"raw"},'
        '{"name":"keys","dtype":"<i4","shape":[2,3],"offset":704,"nbytes":24,"encoding":"raw"},'
        '{"name":"leaf_depth","dtype":"|u1","shape":[2],"offset":768,"nbytes":2,"encoding":"raw"},'
        '{"name":"log_odds","dtype":"<f4","shape":[2],"offset":832,"nbytes":8,"encoding":"raw"}]}',
        (
            (576, struct.pack("<3i", 8, -16, 0)),
            (640, bytes([13])),
            (704, struct.pack("<6i", 8, -16, 0, 9, -16, 0)),
            (768, bytes([16, 15])),
            (832, struct.pack("<2f", 0.84375, -0.40625)),
        ),
    ),
}


def main() -> None:
    for name, frame in FRAMES.items():
        (FOLDER / f"{name}.bin").write_bytes(frame.to_bytes())


if __name__ == "__main__":
    main()
