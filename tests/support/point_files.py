"""Point-cloud files: those that the sample data come in, read with numpy alone, and simple ones written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_PLY_TYPES = {"float": "<f4", "float32": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "uint": "<u4"}


def decompress_lzf(packed: bytes, expanded_bytes: int) -> bytes:
    """LZF, as PCL's `binary_compressed` uses it."""
    out = bytearray()
    at = 0
    while at < len(packed):
        control = packed[at]
        at += 1
        if control < 32:
            out += packed[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += packed[at]
            at += 1
        start = len(out) - ((control & 0x1F) << 8) - packed[at] - 1
        at += 1
        length += 2
        if start + length <= len(out):
            out += out[start : start + length]
        else:  # the copy overlaps itself: its bytes repeat
            period = bytes(out[start:])
            out += (period * (length // len(period) + 1))[:length]
    if len(out) != expanded_bytes:
        raise ValueError(f"LZF data expands to {len(out)} bytes, {expanded_bytes} were announced")
    return bytes(out)


def read_pcd(path: Path) -> NDArray[np.float32]:
    """x y z of a PCD file, (n,3): ascii, binary or binary_compressed."""
    raw = path.read_bytes()
    header_end = raw.index(b"\n", raw.index(b"\nDATA ") + 1) + 1
    lines = [line.split() for line in raw[:header_end].decode().splitlines() if line and line[0] != "#"]
    header = {line[0]: line[1:] for line in lines}
    counts = [int(c) for c in header.get("COUNT", ["1"] * len(header["FIELDS"]))]
    kinds = {"F": "f", "I": "i", "U": "u"}
    formats = [f"<{kinds[t]}{s}" for t, s in zip(header["TYPE"], header["SIZE"], strict=True)]
    points, body = int(header["POINTS"][0]), raw[header_end:]
    if header["DATA"][0] == "ascii":
        rows = np.loadtxt(body.decode().splitlines(), ndmin=2)
        return rows[:, [header["FIELDS"].index(f) for f in "xyz"]].astype(np.float32)
    if header["DATA"][0] == "binary":
        fields = list(zip(header["FIELDS"], formats, [(c,) for c in counts], strict=True))
        table = np.frombuffer(body, dtype=np.dtype(fields), count=points)
        return np.stack([table[f][:, 0] for f in "xyz"], axis=1).astype(np.float32)
    packed_bytes, expanded_bytes = np.frombuffer(body, dtype="<u4", count=2).tolist()
    columns = decompress_lzf(body[8 : 8 + packed_bytes], expanded_bytes)
    offsets = np.cumsum([0] + [np.dtype(f).itemsize * c * points for f, c in zip(formats, counts, strict=True)])
    wanted = [header["FIELDS"].index(f) for f in "xyz"]
    return np.stack(
        [np.frombuffer(columns, dtype=formats[i], count=points, offset=int(offsets[i])) for i in wanted], axis=1
    ).astype(np.float32)


def read_ply(path: Path) -> NDArray[np.float32]:
    """x y z of a binary little-endian PLY file's vertices, (n,3)."""
    raw = path.read_bytes()
    header_end = raw.index(b"end_header\n") + len(b"end_header\n")
    count, fields, in_vertex = 0, [], False
    for line in raw[:header_end].decode().splitlines():
        words = line.split()
        if words[0] == "format" and words[1] != "binary_little_endian":
            raise ValueError(f"{path.name}: {words[1]} PLY is not read here")
        if words[0] == "element":
            in_vertex = words[1] == "vertex"
            count = int(words[2]) if in_vertex else count
        elif words[0] == "property" and in_vertex:
            fields.append((words[2], _PLY_TYPES[words[1]]))
    table = np.frombuffer(raw, dtype=np.dtype(fields), count=count, offset=header_end)
    return np.stack([table["x"], table["y"], table["z"]], axis=1).astype(np.float32)


def read_ascii_vtk(path: Path) -> NDArray[np.float32]:
    """POINTS of a legacy ASCII VTK file, (n,3)."""
    lines = path.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("POINTS"))
    count = int(lines[start].split()[1])
    values: list[str] = []
    for line in lines[start + 1 :]:
        if len(values) >= 3 * count:
            break
        values += line.split()
    return np.array(values[: 3 * count], dtype=np.float32).reshape(-1, 3)


def ascii_pcd(points: NDArray[Any]) -> bytes:
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA ascii\n"
    )
    return (head + "".join(f"{x} {y} {z}\n" for x, y, z in points.tolist())).encode()


def ascii_ply(points: NDArray[Any]) -> bytes:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n" + "".join(f"property float {c}\n" for c in "xyz")
    return (head + "end_header\n" + "".join(f"{x} {y} {z}\n" for x, y, z in points.tolist())).encode()
