"""One shape in every mesh format, written by hand so that no reader's mistake is repeated."""

from __future__ import annotations

import json
import struct

import numpy as np
import numpy.typing as npt

# A unit cube: corner i has the bits of i as x, y, z.
CUBE_VERTICES = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)
CUBE_QUADS = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
CUBE_TRIANGLES = np.concatenate([CUBE_QUADS[:, [0, 1, 2]], CUBE_QUADS[:, [0, 2, 3]]]).astype(np.int32)


def stl_binary(vertices: npt.NDArray[np.float64], triangles: npt.NDArray[np.int32], header: bytes = b"cube") -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[triangle].ravel(), 0) for triangle in triangles)
    return header.ljust(80, b" ") + struct.pack("<I", len(triangles)) + records


def stl_ascii(vertices: npt.NDArray[np.float64], triangles: npt.NDArray[np.int32]) -> bytes:
    lines = ["solid cube"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", " outer loop"]
        lines += [f"  vertex {x} {y} {z}" for x, y, z in vertices[triangle]]
        lines += [" endloop", "endfacet"]
    return "\n".join([*lines, "endsolid cube", ""]).encode()


def obj(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> bytes:
    lines = ["mtllib /etc/passwd", *(f"v {x} {y} {z}" for x, y, z in vertices)]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}/1" for i in face) for face in faces]
    return "\n".join(lines).encode()


def off(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> bytes:
    lines = ["OFF # a cube", f"{len(vertices)} {len(faces)} 0", *(f"{x} {y} {z}" for x, y, z in vertices)]
    lines += [f"{len(face)} " + " ".join(map(str, face)) for face in faces]
    return "\n".join(lines).encode()


def _ply_header(encoding: str, vertices: int, faces: int) -> bytes:
    return (
        f"ply\nformat {encoding} 1.0\ncomment cube\nelement vertex {vertices}\nproperty float x\nproperty double y\n"
        f"property float z\nproperty uchar red\nelement face {faces}\nproperty uchar flags\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()


def ply_ascii(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> bytes:
    lines = [f"{x} {y} {z} 255" for x, y, z in vertices]
    lines += [f"7 {len(face)} " + " ".join(map(str, face)) for face in faces]
    return _ply_header("ascii", len(vertices), len(faces)) + "\n".join(lines).encode()


def ply_binary(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64], order: str = "<") -> bytes:
    encoding = "binary_little_endian" if order == "<" else "binary_big_endian"
    body = b"".join(struct.pack(order + "fdfB", x, y, z, 255) for x, y, z in vertices)
    body += b"".join(struct.pack(f"{order}BB{len(face)}i", 7, len(face), *face) for face in faces)
    return _ply_header(encoding, len(vertices), len(faces)) + body


def dae(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64], meter: float = 1.0) -> bytes:
    """The cube in a node that doubles it, by an instance that moves it by (1, 0, 0)."""
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="u" meter="{meter}"/><up_axis>Y_UP</up_axis></asset>
 <library_geometries><geometry id="cube"><mesh>
  <source id="p"><float_array id="a" count="24">{" ".join(map(str, vertices.ravel()))}</float_array>
   <technique_common><accessor source="#a" count="8" stride="3"/></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <polylist count="{len(faces)}"><input semantic="NORMAL" source="#p" offset="1"/>
   <input semantic="VERTEX" source="#v" offset="0"/>
   <vcount>{" ".join(str(len(face)) for face in faces)}</vcount>
   <p>{" ".join(f"{i} 0" for face in faces for i in face)}</p></polylist>
 </mesh></geometry></library_geometries>
 <library_nodes><node id="n"><scale>2 2 2</scale><instance_geometry url="#cube"/></node></library_nodes>
 <library_visual_scenes><visual_scene id="s"><node><translate>1 0 0</translate><instance_node url="#n"/></node>
 </visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>""".encode()


def glb(vertices: npt.NDArray[np.float64], triangles: npt.NDArray[np.int32], **changes: object) -> bytes:
    """The cube in a node turned by a quarter about z and moved by (1, 0, 0)."""
    positions, indices = vertices.astype("<f4").tobytes(), triangles.astype("<u2").tobytes()
    binary = positions + indices
    half = 0.5**0.5
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": [0, 0, half, half], "translation": [1, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": triangles.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(positions)},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(binary)}],
        **changes,
    }
    return glb_of(document, binary)


def glb_of(document: object, binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def cube_files() -> dict[str, tuple[str, bytes]]:
    """Name to format and bytes of the unit cube."""
    v, q, t = CUBE_VERTICES, CUBE_QUADS, CUBE_TRIANGLES
    return {
        "binary STL": ("stl", stl_binary(v, t)),
        "binary STL that begins with solid": ("stl", stl_binary(v, t, b"solid cube")),
        "ASCII STL": ("stl", stl_ascii(v, t)),
        "OBJ": ("obj", obj(v, q)),
        "OFF": ("off", off(v, q)),
        "ASCII PLY": ("ply", ply_ascii(v, q)),
        "little-endian PLY": ("ply", ply_binary(v, q)),
        "big-endian PLY": ("ply", ply_binary(v, q, ">")),
        "DAE": ("dae", dae(v, q)),
        "GLB": ("glb", glb(v, t)),
    }
