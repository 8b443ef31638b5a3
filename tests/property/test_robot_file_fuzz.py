"""Whatever the bytes: a model or a typed error, soon, and in little memory."""

from __future__ import annotations

import resource
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rayvox.errors import RayvoxError
from rayvox.mesh_io import MESH_FORMATS, LoadLimits, decode_mesh
from rayvox.robot import Robot

from tests.support.mesh_files import cube_files
from tests.support.robots import ARM_URDF, CUBE_STL, arm_archive, zipped

FILES = cube_files()
LIMITS = LoadLimits(max_bytes=16 << 20, max_triangles=100_000, max_time_s=5.0)
SLOWEST_S = 10.0  # of an input of some kilobytes; a guard against hangs, not a measurement
LARGEST_GROWTH_KB = 512 << 10
FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def decode(data: bytes, file_format: str) -> None:
    began = time.monotonic()
    try:
        mesh = decode_mesh(data, file_format, limits=LIMITS)
    except RayvoxError:
        pass
    else:
        assert len(mesh) > 0
        assert np.isfinite(mesh.vertices).all()
        assert 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices)
    assert time.monotonic() - began < SLOWEST_S


def load_archive(data: bytes) -> None:
    began = time.monotonic()
    try:
        robot = Robot.from_archive(data, limits=LIMITS)
    except RayvoxError:
        pass
    else:
        assert np.isfinite(robot.link_poses(robot.configuration())).all()
    assert time.monotonic() - began < SLOWEST_S


@st.composite
def damaged(draw: st.DrawFn, data: bytes) -> bytes:
    """Bytes overwritten, cut out or repeated, and the end cut off."""
    octets = bytearray(data)
    for _ in range(draw(st.integers(1, 6))):
        at = draw(st.integers(0, max(0, len(octets) - 1)))
        match draw(st.sampled_from(["flip", "set", "cut", "repeat", "truncate"])):
            case "flip" if octets:
                octets[at] ^= 1 << draw(st.integers(0, 7))
            case "set":
                octets[at : at + 4] = draw(st.sampled_from([b"\xff\xff\xff\xff", bytes(4), b"9999", b"-1 -", b"nan "]))
            case "cut":
                del octets[at : at + draw(st.integers(1, 100))]
            case "repeat":
                octets[at:at] = octets[at : at + draw(st.integers(1, 200))] * draw(st.integers(1, 5))
            case "truncate":
                del octets[at:]
    return bytes(octets)


@pytest.mark.parametrize("name", FILES)
def test_damaged_meshes_never_hang_or_crash(name: str) -> None:
    file_format, data = FILES[name]

    @FUZZ
    @given(damaged(data))
    def check(broken: bytes) -> None:
        decode(broken, file_format)

    check()


@pytest.mark.parametrize("name", FILES)
def test_every_truncation_is_an_error_or_a_mesh(name: str) -> None:
    file_format, data = FILES[name]
    for end in range(0, len(data), 7):
        decode(data[:end], file_format)


@pytest.mark.parametrize("file_format", MESH_FORMATS)
def test_noise_and_other_formats_are_refused(file_format: str) -> None:
    rng = np.random.default_rng(5)
    for size in (0, 1, 20, 84, 85, 5000):
        decode(rng.bytes(size), file_format)
    for other, data in FILES.values():
        if other != file_format:
            with pytest.raises(RayvoxError):
                decode_mesh(data, file_format, limits=LIMITS)


@FUZZ
@given(damaged(ARM_URDF.encode()))
def test_damaged_descriptions_never_hang_or_crash(urdf: bytes) -> None:
    load_archive(zipped({"arm/urdf/arm.urdf": urdf, "arm/meshes/cube.stl": CUBE_STL}))


@FUZZ
@given(damaged(arm_archive()))
def test_damaged_archives_never_hang_or_crash(archive: bytes) -> None:
    load_archive(archive)


def test_hostile_uploads_stay_within_little_memory() -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    bomb = zipped({"r.urdf": ARM_URDF, "meshes/cube.stl": bytes(200 << 20)})
    deep = zipped({"r.urdf": "<robot>" * 200_000})
    many = zipped({"r.urdf": "<robot>" + '<link name="a"/>' * 500_000 + "</robot>"})
    for archive in (bomb, deep, many):
        load_archive(archive)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < LARGEST_GROWTH_KB
