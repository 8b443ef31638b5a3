"""Small robots as text, archives of them, and the real ones beside the repository."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

from tests.support.datasets import data_path
from tests.support.mesh_files import CUBE_TRIANGLES, CUBE_VERTICES, stl_binary

REAL_ROBOTS = ("husky", "panda", "ur5", "anymal_c", "pr2")

# A lift on a turntable with an arm of two hinges and a gripper whose second finger mirrors the first.
ARM_URDF = """<robot name="arm">
  <link name="base"><collision><origin xyz="0 0 0.05"/><geometry><box size="0.4 0.4 0.1"/></geometry></collision></link>
  <link name="column"><collision><geometry><cylinder radius="0.05" length="0.6"/></geometry></collision></link>
  <link name="lift"><collision><geometry><mesh filename="package://arm/meshes/cube.stl" scale="0.1 0.2 0.1"/></geometry>
    </collision></link>
  <link name="mount"/>
  <link name="upper"><collision><origin xyz="0.2 0 0" rpy="0 1.5708 0"/>
    <geometry><cylinder radius="0.03" length="0.4"/></geometry></collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.06"/></geometry></collision>
    <visual><geometry><box size="0.2 0.1 0.1"/></geometry></visual></link>
  <link name="left"><collision><geometry><box size="0.02 0.01 0.05"/></geometry></collision></link>
  <link name="right"><collision><geometry><box size="0.02 0.01 0.05"/></geometry></collision></link>
  <joint name="finger_r" type="prismatic"><parent link="hand"/><child link="right"/><origin xyz="0.08 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-0.04" upper="0"/><mimic joint="finger_l" multiplier="-1" offset="-0.01"/></joint>
  <joint name="turn" type="continuous"><parent link="base"/><child link="column"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 0 2"/></joint>
  <joint name="slide" type="prismatic"><parent link="column"/><child link="lift"/><origin xyz="0.1 0 0" rpy="0 0 0.5"/>
    <axis xyz="0 0 1"/><limit lower="-0.2" upper="0.3" effort="1" velocity="1"/></joint>
  <joint name="bracket" type="fixed"><parent link="lift"/><child link="mount"/>
    <origin xyz="0.1 0 0" rpy="0.3 -0.2 0.1"/></joint>
  <joint name="shoulder" type="revolute"><parent link="mount"/><child link="upper"/><origin rpy="1.5708 0 0"/>
    <axis xyz="0 0.6 0.8"/><limit lower="-2" upper="2"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="hand"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 0 1"/><limit lower="0.5" upper="2.5"/></joint>
  <joint name="finger_l" type="prismatic"><parent link="hand"/><child link="left"/><origin xyz="0.08 0 0"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.04"/></joint>
</robot>"""
CUBE_STL = stl_binary(CUBE_VERTICES, CUBE_TRIANGLES)


def zipped(files: dict[str, str | bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()


def arm_archive() -> bytes:
    return zipped({"arm/urdf/arm.urdf": ARM_URDF, "arm/meshes/cube.stl": CUBE_STL})


def one_link(geometry: str, extra: str = "") -> str:
    """A URDF of one link with this collision geometry."""
    return f"""<robot name="one"><link name="body"><collision><geometry>{geometry}</geometry></collision></link>{extra}
    </robot>"""


def real_robot(name: str) -> Path:
    """The URDF of a real robot; skips the calling test where it is absent."""
    return data_path(f"robots/{name}/robot.urdf")
