"""Every mesh format gives the triangles that are in the file, or says what is wrong with it."""

from __future__ import annotations

import re
import struct
from typing import Any

import numpy as np
import pytest
from rayvox.errors import LoadLimitError, MeshFormatError, RayvoxError
from rayvox.mesh_io import MESH_FORMATS, LoadLimits, TriangleMesh, decode_mesh, read_mesh

from tests.support.datasets import data_path
from tests.support.mesh_files import CUBE_QUADS, CUBE_TRIANGLES, CUBE_VERTICES, cube_files, dae, glb, glb_of, obj, off

FILES = cube_files()


def area(mesh: TriangleMesh) -> float:
    a, b, c = mesh.corners().transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def volume(mesh: TriangleMesh) -> float:
    a, b, c = mesh.corners().transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6)


@pytest.mark.parametrize("name", FILES)
def test_a_cube_is_read_from_every_format(name: str) -> None:
    file_format, data = FILES[name]
    mesh = decode_mesh(data, file_format)
    size, lo = {"dae": (2.0, [1.0, 0.0, 0.0]), "glb": (1.0, [0.0, 0.0, 0.0])}.get(file_format, (1.0, [0.0, 0.0, 0.0]))
    assert len(mesh) == 12
    np.testing.assert_allclose(mesh.bounds_m[0], lo, atol=1e-6)
    np.testing.assert_allclose(mesh.bounds_m[1], np.add(lo, size), atol=1e-6)
    assert volume(mesh) == pytest.approx(size**3, rel=1e-6)
    assert mesh.parts().closed.tolist() == [True]


def test_the_unit_of_a_dae_scales_it() -> None:
    mesh = decode_mesh(dae(CUBE_VERTICES, CUBE_QUADS, meter=0.0254), "dae")
    np.testing.assert_allclose(mesh.bounds_m[1], [0.0762, 0.0508, 0.0508])


def test_negative_indices_of_an_obj_count_from_the_newest_vertex() -> None:
    mesh = decode_mesh(b"v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n", "obj")
    assert mesh.triangles.tolist() == [[1, 2, 3]]


@pytest.mark.parametrize(
    ("outline", "wanted"),
    [
        ([(0, 0), (2, 0), (2, 2), (1, 0.2), (0, 2)], 2.2),  # an M: a fan from any corner but one covers too much
        ([(0, 0), (1, 0.2), (2, 0), (1, 2)], 1.8),  # a concave quadrilateral
        ([(0, 0), (4, 0), (4, 4), (3, 4), (3, 1), (1, 1), (1, 4), (0, 4)], 10.0),  # a U
        ([(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)], 4.0),  # a corner that is none
    ],
)
@pytest.mark.parametrize("turned", range(8))
@pytest.mark.parametrize("plane", range(6))
def test_polygons_are_covered_exactly(
    outline: list[tuple[float, float]], wanted: float, turned: int, plane: int
) -> None:
    flat = np.roll(np.array([(x, y, 0.5) for x, y in outline], dtype=np.float64), turned, axis=0)
    points = np.roll(flat, plane % 3, axis=1)[:: 1 if plane < 3 else -1]
    mesh = decode_mesh(obj(points, np.arange(len(points))[None, :]), "obj")
    assert len(mesh) == len(points) - 2
    assert area(mesh) == pytest.approx(wanted)


def test_a_large_concave_polygon_is_refused_or_cut_in_time() -> None:
    angles = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    star = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) * (1 + np.arange(5000) % 2)[:, None]
    with pytest.raises(MeshFormatError, match="concave polygon of 5000"):
        decode_mesh(obj(star, np.arange(5000)[None, :]), "obj")


BAD: list[tuple[str, bytes, str]] = [
    ("stl", b"", "neither a binary nor an ASCII"),
    ("stl", b"solid x\nendsolid x\n", "holds no triangles"),
    ("stl", b"solid x\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid", "2 vertices"),
    ("stl", b"solid x\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", "ends within"),
    ("stl", b"solid x\nfacet\nvertex 0 0 zero\n", "line 3 is no vertex"),
    ("stl", bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(50), "4000000000 triangles does not fit"),
    ("stl", bytes(80) + struct.pack("<I", 1) + struct.pack("<12f", *[np.nan] * 12) + b"\0\0", "not finite"),
    ("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "names vertex 3, there are 3"),
    ("obj", b"v 0 0 0\nf 1 -2 1\n", "line 2"),
    ("obj", b"v 0 0 0\nf 0 1 1\n", "line 2"),
    ("obj", b"v 0 nan 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertices[0]"),
    ("obj", b"v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    ("obj", b"v 1 2\n", "line 1 is no vertex"),
    ("obj", b"surf 0 1 0 1 1 2 3\n", "line 1 is none that rayvox reads"),
    ("obj", b"\x00\x01\x02\x03", "line 1"),
    ("obj", b"v 0 0 0\nf 99999999999999999999 1 1\n", "line 2"),
    ("off", b"OFF\n4000000000 4000000000 0\n0 0 0\n", "4000000000 vertices"),
    ("off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n", "ends before"),
    ("off", b"OFF BINARY\n", "not a text OFF"),
    ("off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "list 3"),
    ("ply", b"ply\nformat ascii 1.0\n", "not a PLY header"),
    ("ply", b"ply\nformat ascii 1.0\nelement vertex 1\nelement face 0\nend_header\n", "no properties"),
    ("ply", b"ply\nformat ascii 1.0\nelement vertex x\nend_header\n", "not a PLY header"),
    ("ply", b"ply\nformat utf8 1.0\nend_header\n", "format 'utf8'"),
    (
        "ply",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
        b"property float z\nend_header\n" + bytes(64),
        "ends before",
    ),
    ("dae", b"<COLLADA/>", "holds no triangles"),
    ("dae", b"<svg/>", "not a COLLADA file"),
    ("dae", b"<COLLADA>", "not XML"),
    ("dae", b'<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><COLLADA>&b;</COLLADA>', "DOCTYPE"),
    ("dae", b'<!DOCTYPE x SYSTEM "file:///etc/passwd"><COLLADA/>', "DOCTYPE"),
    ("dae", b"<a>" * 100_000, "within each other"),
    ("dae", b"<COLLADA>" + b"<a/>" * 1_000_001 + b"</COLLADA>", "1000000 elements"),
    ("dae", b'<COLLADA><scene><instance_visual_scene url="other.dae#s"/></scene></COLLADA>', "not in the file"),
    ("glb", b"glTF" + struct.pack("<II", 2, 4_000_000_000) + bytes(100), "4000000000 bytes"),
    ("glb", glb_of([], b""), "no object"),
    ("glb", glb_of({"scenes": [{"nodes": [7]}]}, b""), "not valid glTF"),
    ("glb", glb_of({"nodes": "x" * 5}, b""), "not valid glTF"),
    ("glb", glb_of({"buffers": [{"uri": "file:///etc/passwd"}]}, b""), "not read"),
    ("glb", glb_of({"extensionsRequired": ["KHR_draco_mesh_compression"]}, b""), "KHR_draco_mesh_compression"),
    ("stp", b"", "not 'stp'"),
]


@pytest.mark.parametrize(("file_format", "data", "message"), BAD, ids=[f"{b[0]}: {b[2]}" for b in BAD])
def test_what_cannot_be_right_is_a_typed_error(file_format: str, data: bytes, message: str) -> None:
    with pytest.raises(MeshFormatError, match=re.escape(message)):
        decode_mesh(data, file_format, "upload")


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("componentType", 5130),
        ("count", 10**12),
        ("count", -1),
        ("count", "many"),
        ("byteOffset", 10**9),
        ("bufferView", 99),
        ("bufferView", -1),
        ("type", "VEC4"),
        ("sparse", {"count": 1}),
    ],
)
def test_a_glb_accessor_cannot_reach_beyond_the_file(key: str, change: Any) -> None:
    good: dict[str, Any] = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}
    accessors = [good | {key: change}, {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}]
    with pytest.raises(MeshFormatError):
        decode_mesh(glb(CUBE_VERTICES, CUBE_TRIANGLES, accessors=accessors), "glb")


def test_nodes_that_contain_themselves_end() -> None:
    nodes = [{"mesh": 0, "children": [0, 0]}]
    with pytest.raises(RayvoxError, match="within each other"):
        decode_mesh(glb(CUBE_VERTICES, CUBE_TRIANGLES, nodes=nodes), "glb")
    looped = dae(CUBE_VERTICES, CUBE_QUADS).replace(b'<instance_geometry url="#cube"/>', b'<instance_node url="#n"/>')
    with pytest.raises(RayvoxError, match="within each other"):
        decode_mesh(looped, "dae")


def test_nodes_that_multiply_meshes_are_counted() -> None:
    # Each node shows the next one twice: 2^60 cubes from a few lines.
    nodes = [{"children": [i + 1, i + 1]} for i in range(60)] + [{"mesh": 0}]
    with pytest.raises(RayvoxError, match=r"nodes|triangles"):
        decode_mesh(glb(CUBE_VERTICES, CUBE_TRIANGLES, nodes=nodes), "glb")


@pytest.mark.parametrize("name", FILES)
def test_limits_of_bytes_and_triangles_hold(name: str) -> None:
    file_format, data = FILES[name]
    assert len(decode_mesh(data, file_format, limits=LoadLimits(len(data), 24))) == 12
    with pytest.raises(LoadLimitError, match="bytes"):
        decode_mesh(data, file_format, limits=LoadLimits(max_bytes=len(data) - 1))
    with pytest.raises(LoadLimitError, match="triangles"):
        decode_mesh(data, file_format, limits=LoadLimits(max_triangles=11))
    with pytest.raises(LoadLimitError, match="took longer"):
        decode_mesh(data, file_format, limits=LoadLimits(max_time_s=0.0))


def test_a_solid_with_a_fin_is_closed_and_the_fin_is_not() -> None:
    vertices = np.vstack([CUBE_VERTICES, [[0.5, 0.5, 3.0]]])
    mesh = TriangleMesh(vertices, np.vstack([CUBE_TRIANGLES, [[4, 5, 8]]]).astype(np.int32))
    parts = mesh.parts()
    assert parts.closed.tolist() == [True, False]
    assert parts.part.tolist() == [0] * 12 + [1]


def test_a_cube_without_a_side_is_open_and_double_sides_count_once() -> None:
    assert TriangleMesh(CUBE_VERTICES, CUBE_TRIANGLES[1:]).parts().closed.tolist() == [False]
    doubled = TriangleMesh(CUBE_VERTICES, np.vstack([CUBE_TRIANGLES, CUBE_TRIANGLES[:, ::-1]]).astype(np.int32))
    assert doubled.parts().closed.tolist() == [True]
    assert (doubled.parts().part == -1).sum() == 12


def test_welding_keeps_the_triangles() -> None:
    mesh = decode_mesh(FILES["binary STL"][1], "stl")
    assert (len(mesh.vertices), len(mesh.welded().vertices)) == (36, 8)
    np.testing.assert_array_equal(mesh.welded().corners(), mesh.corners())


# Triangles in each awkward file; a string where the file holds none.
ROBUSTNESS: dict[str, int | str] = {
    "mesh_robustness/1002_tray_bottom.STL": 4520,
    "mesh_robustness/ADIS16480.STL": 7436,
    "mesh_robustness/angle_block.STL": 704,
    "mesh_robustness/ballA.off": 3796,
    "mesh_robustness/box.STL": 8954,
    "mesh_robustness/bunny.ply": 16301,
    "mesh_robustness/busted.STL": 3878,
    "mesh_robustness/cycloidal.ply": 43368,
    "mesh_robustness/duck.dae": 4212,
    "mesh_robustness/empty.stl": "holds no triangles",
    "mesh_robustness/featuretype.STL": 3476,
    "mesh_robustness/fuze.obj": 1000,
    "mesh_robustness/fuze_ascii.ply": 1000,
    "mesh_robustness/large_block.STL": 12,
    "mesh_robustness/multibody.stl": 32,
    "mesh_robustness/nancolor.obj": 12,
    "mesh_robustness/negative_indices.obj": 12,
    "mesh_robustness/octagonal_pocket.stl": 3262,
    "mesh_robustness/points_emptyface.ply": "holds no triangles",
    "mesh_robustness/quadknot.obj": 2880,
    "mesh_robustness/soup.stl": 100,
    "mesh_robustness/teapot.stl": 894,
    "mesh_robustness/torus.STL": 8700,
    "mesh_robustness/tube.obj": 120,
    "mesh_robustness/two_objects_mixed_case_names.stl": 24,
    "mesh_robustness/unit_cube.STL": 12,
    "mesh_robustness/unit_sphere.STL": 1280,
    "mesh_robustness/wallhole.obj": 66,
    "fcl_coal/illformated_mesh.dae": 14746,
    "fcl_coal/staircases_koroibot_hr.dae": 1276,
    "fcl_coal/env.obj": 2180,
    "fcl_coal/rob.obj": 216,
}


@pytest.mark.parametrize("name", ROBUSTNESS)
def test_awkward_files_give_their_triangles_or_a_clear_error(name: str) -> None:
    wanted = ROBUSTNESS[name]
    path = data_path(name)
    if isinstance(wanted, str):
        with pytest.raises(MeshFormatError, match=wanted):
            read_mesh(path)
    else:
        assert len(read_mesh(path)) == wanted


def test_every_awkward_file_is_in_the_list() -> None:
    folder = data_path("mesh_robustness")
    present = {f"mesh_robustness/{path.name}" for path in folder.iterdir() if path.suffix.lower()[1:] in MESH_FORMATS}
    assert present <= set(ROBUSTNESS)


def test_a_box_in_millimetres_has_its_size() -> None:
    lo, hi = read_mesh(data_path("mesh_robustness/large_block.STL")).scaled(0.001).bounds_m
    np.testing.assert_allclose(hi - lo, [4.572, 0.3048, 2.4384], rtol=1e-6)


def test_an_off_face_may_have_any_number_of_corners() -> None:
    mesh = decode_mesh(off(CUBE_VERTICES, CUBE_QUADS), "off")
    assert area(mesh) == pytest.approx(6.0)
