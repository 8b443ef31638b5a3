"""OctoMap itself, through pyoctomap, with its leaves read out in bulk.

pyoctomap's leaf iterator takes microseconds and several Python objects per leaf; the tree's own `.ot` stream is one
5-byte record per node, depth first, from which numpy rebuilds all leaves at once.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.support.occupancy_oracle import Leaves

_RECORD = np.dtype([("log_odds", "<f4"), ("children", "u1")])


def _split_header(raw: bytes) -> tuple[dict[str, str], bytes]:
    end = raw.index(b"\ndata\n") + len(b"\ndata\n")
    words = [line.split(maxsplit=1) for line in raw[:end].decode().splitlines() if not line.startswith("#")]
    return {line[0]: line[1] for line in words if len(line) == 2}, raw[end:]


def _next_siblings(children: NDArray[np.uint8]) -> NDArray[np.int64]:
    """For each node of a depth-first stream, the node that follows its whole subtree.

    The number of subtrees still to come falls by at most one per node, so a subtree ends where that number first falls
    below its value at the subtree's root.
    """
    count = len(children)
    degree = np.unpackbits(children[:, None], axis=1).sum(axis=1, dtype=np.int64)
    pending = np.append(1, 1 + np.cumsum(degree - 1))
    order = np.argsort(pending, kind="stable")
    stride = count + 2
    ranked = pending[order] * stride + order
    index = np.arange(count)
    return order[np.searchsorted(ranked, (pending[:count] - 1) * stride + index)]


def parse_ot(raw: bytes) -> Leaves:
    """Leaves of a 16-level OctoMap `.ot` file (type OcTree)."""
    header, body = _split_header(raw)
    if header["id"] != "OcTree":
        raise ValueError(f"{header['id']} is not a plain occupancy octree")
    nodes = np.frombuffer(body, dtype=_RECORD)
    if len(nodes) != int(header["size"]):
        raise ValueError(f"the header announces {header['size']} nodes, the stream holds {len(nodes)}")
    children = np.ascontiguousarray(nodes["children"])
    after = _next_siblings(children)
    level, cells = np.zeros(1, dtype=np.int64), np.full((1, 3), -(1 << 15))
    keys, depths, values = [], [], []
    for depth in range(17):
        leaf = children[level] == 0
        keys.append(cells[leaf])
        depths.append(np.full(int(leaf.sum()), depth, dtype=np.uint8))
        values.append(nodes["log_odds"][level[leaf]])
        inner, inner_cells = level[~leaf], cells[~leaf]
        at = inner + 1
        next_level, next_cells = [], []
        for child in range(8):
            has = (children[inner] >> child) & 1 == 1
            # The lowest level has no children: its shift is never used.
            offset = np.array([child & 1, child >> 1 & 1, child >> 2]) << max(15 - depth, 0)
            next_level.append(at[has])
            next_cells.append(inner_cells[has] + offset)
            at = np.where(has, after[np.minimum(at, len(children) - 1)], at)
        level, cells = np.concatenate(next_level), np.concatenate(next_cells)
        if not len(level):
            break
    return Leaves(np.concatenate(keys), np.concatenate(depths), np.concatenate(values)).sorted()


class OctomapPeer:
    """An OctoMap tree with its default sensor model. Only tests and benchmarks import pyoctomap, and only here."""

    def __init__(self, resolution_m: float) -> None:
        import pyoctomap

        self.tree = pyoctomap.OcTree(resolution_m)

    @classmethod
    def read(cls, path: Path) -> OctomapPeer:
        """A tree from a `.bt` or `.ot` file."""
        import pyoctomap

        peer = cls(0.1)
        if path.suffix == ".bt":
            if not peer.tree.readBinary(str(path)):
                raise ValueError(f"OctoMap does not read {path}")
        else:
            peer.tree = pyoctomap.OcTree(0.1).read(str(path))
            if peer.tree is None:
                raise ValueError(f"OctoMap does not read {path}")
        return peer

    def insert_scan(
        self,
        points_m: ArrayLike,
        origin_m: ArrayLike,
        max_range_m: float | None = None,
        discretize: bool = False,
    ) -> None:
        """One scan in the map frame; pruned as OctoMap prunes, on every update."""
        points = np.ascontiguousarray(points_m, dtype=np.float64).reshape(-1, 3)
        origin = np.asarray(origin_m, dtype=np.float64)
        self.tree.insertPointCloud(points, origin, -1.0 if max_range_m is None else max_range_m, False, discretize)

    def ot_bytes(self) -> bytes:
        """The tree as an `.ot` file."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "tree.ot"
            if not self.tree.write(str(path)):
                raise OSError("OctoMap could not write its tree")
            return path.read_bytes()

    def bt_bytes(self) -> bytes:
        """The tree as a `.bt` file: thresholded to its maximum likelihood, in place."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "tree.bt"
            if not self.tree.writeBinary(str(path)):
                raise OSError("OctoMap could not write its tree")
            return path.read_bytes()

    def leaves(self) -> Leaves:
        """All leaves, sorted by key."""
        return parse_ot(self.ot_bytes())
