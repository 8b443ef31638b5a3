"""URDF: what is read from it, and what is refused with which words."""

from __future__ import annotations

import io
import os
import re
import stat
import zipfile
from pathlib import Path

import numpy as np
import pytest
from rayvox.errors import LoadLimitError, MeshFormatError, RobotFormatError
from rayvox.mesh_io import LoadLimits
from rayvox.robot import Robot

from tests.support.robots import ARM_URDF, CUBE_STL, REAL_ROBOTS, arm_archive, one_link, real_robot, zipped

# Joints with a value of their own, and triangles, of the real robots: (collision, visual).
REAL = {
    "husky": (4, 11, 35_902),
    "panda": (8, 13, 134_924),
    "ur5": (6, 11, 95_694),
    "anymal_c": (12, 78, 58_332),
    "pr2": (20, 82, 27_841),
}


def arm() -> Robot:
    return Robot.from_archive(arm_archive())


def one(geometry: str, extra: str = "", **files: bytes) -> Robot:
    return Robot.from_archive(zipped({"one.urdf": one_link(geometry, extra), **files}))


def test_links_and_joints_are_those_of_the_file() -> None:
    robot = arm()
    assert robot.name == "arm"
    assert robot.joint_names == ("turn", "slide", "shoulder", "elbow", "finger_l")
    assert robot.limits.tolist() == [[-np.inf, -0.2, -2, 0.5, 0], [np.inf, 0.3, 2, 2.5, 0.04]]
    assert robot.link_names[0] == "base"
    assert {"mount", "left", "right"} < set(robot.link_names)
    shapes = {link.name: [geometry.shape for geometry in link.geometries] for link in robot.links}
    assert shapes["lift"] == ["mesh"]
    assert shapes["mount"] == []
    lo, hi = robot.links[robot.link_index("lift")].mesh.bounds_m
    np.testing.assert_allclose((lo, hi), ([0, 0, 0], [0.1, 0.2, 0.1]), atol=1e-7)


def test_parents_come_before_their_children() -> None:
    robot = arm()
    for joint in robot.joints:
        assert robot.link_index(joint.parent) < robot.link_index(joint.child)


def test_visual_geometry_is_taken_on_request_only() -> None:
    assert sum(bool(link.geometries) for link in Robot.from_archive(arm_archive(), geometry="visual").links) == 1
    with pytest.raises(RobotFormatError, match="no link has visual geometry"):
        Robot.from_archive(zipped({"a.urdf": one_link('<box size="1 1 1"/>')}), geometry="visual")


@pytest.mark.parametrize(
    ("urdf", "message"),
    [
        ("<robot/>", "no links"),
        ("<sdf/>", "not a URDF but <sdf>"),
        ("<robot><link/></robot>", "without a name"),
        ('<robot><link name="a"/><link name="a"/></robot>', "two links are called a"),
        ('<robot><link name="a"/><link name="b"/></robot>', "hang on none: a, b"),
        (one_link('<capsule radius="1" length="2"/>'), "<capsule> is none of mesh, box"),
        (one_link('<box size="1 2"/>'), "'1 2' is not 3 finite numbers"),
        (one_link('<box size="1 2 -3"/>'), "a box of size"),
        (one_link('<sphere radius="nan"/>'), "not 1 finite"),
        (one_link('<cylinder radius="1"/>'), "not 1 finite"),
        (one_link(""), "without geometry"),
        (one_link('<mesh filename="gone.stl"/>'), "'gone.stl' is not there"),
        (one_link('<mesh filename="../../etc/passwd.stl"/>'), "leads out of the upload"),
        (one_link('<mesh filename="package://../../../etc/x.stl"/>'), "leads out of the upload"),
        (one_link('<mesh filename="/etc/passwd"/>'), "only package:// and relative names"),
        (one_link('<mesh filename="file:///etc/passwd"/>'), "only package:// and relative names"),
        (one_link('<mesh filename="http://localhost/a.stl"/>'), "only package:// and relative names"),
        (one_link('<mesh filename="\\\\host\\share\\a.stl"/>'), "only package:// and relative names"),
        (one_link('<mesh filename="one.urdf"/>'), "meshes are stl"),
        (one_link('<box size="1 1 1"/>').replace("<robot", '<robot xmlns:xacro="x"><xacro:macro/'), "xacro"),
        (one_link('<box size="${w} 1 1"/>'), "xacro is not supported"),
        ('<!DOCTYPE a [<!ENTITY x "y">]><robot/>', "DOCTYPE"),
    ],
)
def test_descriptions_that_cannot_be_right_are_refused(urdf: str, message: str) -> None:
    with pytest.raises((RobotFormatError, MeshFormatError), match=re.escape(message)):
        Robot.from_archive(zipped({"one.urdf": urdf}))


JOINTS = [
    ('type="floating"><parent link="body"/><child link="c"/>', "floating joints are not supported"),
    ('type="planar"><parent link="body"/><child link="c"/>', "planar joints are not supported"),
    ('type="screw"><parent link="body"/><child link="c"/>', "'screw' is none of"),
    ('type="fixed"><parent link="body"/><child link="d"/>', "there is no link 'd'"),
    ('type="fixed"><parent link="body"/>', "no parent or no child"),
    ('type="fixed"><parent link="c"/><child link="body"/></joint><joint name="k" type="fixed"><parent link="body"/>'
     '<child link="c"/>', "a cycle"),
    ('type="revolute"><parent link="body"/><child link="c"/><axis xyz="0 0 0"/>', "no direction"),
    ('type="revolute"><parent link="body"/><child link="c"/><limit lower="1" upper="0"/>', "above the upper"),
    ('type="revolute"><parent link="body"/><child link="c"/><mimic joint="x"/>', "no moving joint"),
    ('type="revolute"><parent link="body"/><child link="c"/><mimic joint="j"/>', "mimics itself"),
    ('type="revolute"><parent link="body"/><child link="c"/><origin rpy="0 0 inf"/>', "not 3 finite"),
]  # fmt: skip


@pytest.mark.parametrize(("joint", "message"), JOINTS)
def test_joints_that_cannot_be_right_are_refused(joint: str, message: str) -> None:
    with pytest.raises(RobotFormatError, match=message):
        one('<box size="1 1 1"/>', f'<link name="c"/><joint name="j" {joint}</joint>')


def test_mimics_of_mimics_follow_the_first() -> None:
    chain = "".join(
        f'<link name="l{i}"/><joint name="j{i}" type="prismatic"><parent link="body"/><child link="l{i}"/>'
        + (f'<mimic joint="j{i - 1}" multiplier="2" offset="0.5"/>' if i else "")
        + "</joint>"
        for i in range(3)
    )
    robot = one('<box size="1 1 1"/>', chain)
    assert robot.joint_names == ("j0",)
    x = robot.link_poses([0.3])[0, :, 0, 3]
    np.testing.assert_allclose([x[robot.link_index(f"l{i}")] for i in range(3)], [0.3, 1.1, 2.7])


@pytest.mark.parametrize("layout", ["arm/", "", "src/deep/arm/"])
@pytest.mark.parametrize(
    "reference", ["package://arm/meshes/cube.stl", "../meshes/cube.stl", "model://arm/meshes/cube.stl"]
)
def test_meshes_are_found_inside_of_the_archive(layout: str, reference: str) -> None:
    urdf = one_link(f'<mesh filename="{reference}"/>')
    robot = Robot.from_archive(zipped({f"{layout}urdf/one.urdf": urdf, f"{layout}meshes/cube.stl": CUBE_STL}))
    assert robot.triangle_count == 12


def test_one_description_is_needed_or_its_name() -> None:
    files: dict[str, str | bytes] = {f"{n}.urdf": one_link(f'<box size="{n} 1 1"/>') for n in (1, 2)}
    with pytest.raises(RobotFormatError, match=re.escape("found 1.urdf, 2.urdf")):
        Robot.from_archive(zipped(files))
    assert Robot.from_archive(zipped(files), description="2.urdf").links[0].mesh.bounds_m[1][0] == 1.0
    with pytest.raises(RobotFormatError, match="xacro is not supported"):
        Robot.from_archive(zipped({"robot.urdf.xacro": "<robot/>"}))
    with pytest.raises(RobotFormatError, match="not a zip file"):
        Robot.from_archive(b"PK but no zip")


def test_a_zip_bomb_is_not_unpacked() -> None:
    bomb = zipped({"one.urdf": one_link('<mesh filename="b.stl"/>'), "b.stl": bytes(64 << 20)})
    assert len(bomb) < 1 << 20
    with pytest.raises(LoadLimitError, match="67108864 bytes"):
        Robot.from_archive(bomb, limits=LoadLimits(max_bytes=32 << 20))


def test_an_archive_of_too_many_entries_is_refused_before_they_are_listed() -> None:
    with pytest.raises(RobotFormatError, match="10000 entries"):
        Robot.from_archive(zipped({f"{i}": b"" for i in range(10_001)}))


def test_an_entry_that_claims_too_little_is_an_error() -> None:
    archive = bytearray(zipped({"one.urdf": one_link('<mesh filename="b.stl"/>'), "b.stl": CUBE_STL}))
    at = archive.rfind(b"PK\x01\x02")
    archive[at + 24 : at + 28] = (84).to_bytes(4, "little")
    with pytest.raises(RobotFormatError, match="cannot be unpacked"):
        Robot.from_archive(bytes(archive))


def test_a_mesh_that_many_links_share_counts_for_each() -> None:
    shared = "".join(
        f'<link name="l{i}"><collision><geometry><mesh filename="b.stl"/></geometry></collision></link>'
        for i in range(100)
    )
    with pytest.raises(LoadLimitError, match="triangles"):
        Robot.from_archive(
            zipped({"one.urdf": f"<robot>{shared}</robot>", "b.stl": CUBE_STL}), limits=LoadLimits(max_triangles=500)
        )


def test_symbolic_links_in_archives_are_not_followed() -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("one.urdf", one_link('<mesh filename="b.stl"/>'))
        link = zipfile.ZipInfo("b.stl")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(RobotFormatError, match="symbolic links"):
        Robot.from_archive(buffer.getvalue())


def test_a_folder_is_not_left(tmp_path: Path) -> None:
    outside, inside = tmp_path / "outside.stl", tmp_path / "robot"
    inside.mkdir()
    outside.write_bytes(CUBE_STL)
    os.symlink(outside, inside / "link.stl")
    for reference in ("link.stl", "../outside.stl"):
        (inside / "one.urdf").write_text(one_link(f'<mesh filename="{reference}"/>'))
        with pytest.raises(RobotFormatError, match=r"leads out|is not there"):
            Robot.from_urdf(inside / "one.urdf")
    assert Robot.from_urdf(inside / "one.urdf", root=tmp_path).triangle_count == 12


def test_a_ros_package_is_the_root_of_its_descriptions(tmp_path: Path) -> None:
    for name, data in (("urdf/arm.urdf", ARM_URDF.encode()), ("meshes/cube.stl", CUBE_STL), ("package.xml", b"")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(data)
    assert len(Robot.from_urdf(tmp_path / "urdf/arm.urdf").links) == 8


@pytest.mark.parametrize("name", REAL_ROBOTS)
def test_real_robots_are_read(name: str) -> None:
    joints, links, visual_triangles = REAL[name]
    robot = Robot.from_urdf(real_robot(name))
    assert (len(robot.joint_names), len(robot.links)) == (joints, links)
    visual = Robot.from_urdf(real_robot(name), geometry="visual")
    assert visual.triangle_count == visual_triangles
    assert robot.triangle_count < visual.triangle_count
