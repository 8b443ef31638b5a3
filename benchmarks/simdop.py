"""The experiments of the SIMDop paper, on robots, at touching distance, one thread, next to Coal and FCL.

    python -m benchmarks.simdop [--quick] [--robots NAMES] [--sizes COUNTS] [--poses N] [--repeats N] [--apart PART]
                                [--data FOLDER] [--write NAME]

Times are the least of the repeats, in microseconds a query, averaged over the poses (touching_poses.py); contenders
take turns, so that a busy machine is busy for all. Data: robots (URDF with meshes), by default ../shared/data/robots.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.peers.mesh_peers import PeerUnavailableError, run_peer
from benchmarks.report import REPOSITORY, RESULTS, print_table, provenance, write_results
from benchmarks.robot_meshes import Mesh, load_robot, resized
from benchmarks.touching_poses import touching_poses

Options = dict[str, Any]

PRODUCT: Options = {}
# As in the paper: a leaf is a triangle. The scalar binary tree is the baseline of its Fig. 9.
SCALAR_BINARY: Options = {"traversal": "binary", "slabs": "float32"}
TRAVERSALS: dict[str, Options] = {
    "hybrid": PRODUCT,
    "1vs16": {"traversal": "1vs16"},
    "1vs16, a triangle a leaf": {"traversal": "1vs16", "leaf_size": 1},
    "4vs4": {"traversal": "4vs4"},
    "4vs4, a triangle a leaf": {"traversal": "4vs4", "leaf_size": 1},
    "SIMD over orientations, binary": {"traversal": "simd_binary", "slabs": "float32"},
    "scalar, binary": SCALAR_BINARY,
}
SPLITTING = {
    f"{name}, {construction}": {**TRAVERSALS[name], "construction": construction}
    for name in ("hybrid", "1vs16", "4vs4")
    for construction in ("bng", "extended_longest_axis", "longest_axis")
} | {"binary, bng": SCALAR_BINARY, "binary, sah": {**SCALAR_BINARY, "construction": "sah"}}
ORIENTATIONS = {
    f"k = {k}, {slabs}": {"traversal": "1vs16", "k": k, "slabs": slabs}
    for k in (6, 8, 14, 16, 18, 24, 26, 32)
    for slabs in ("float16", "float32")
}
BUILDS: dict[str, Options] = {
    "hybrid, bng": PRODUCT,
    "1vs16, bng": {"traversal": "1vs16", "leaf_size": 1},
    "4vs4, bng": {"traversal": "4vs4", "leaf_size": 1},
    "binary, longest_axis": {**SCALAR_BINARY, "construction": "longest_axis"},
    "binary, sah": {**SCALAR_BINARY, "construction": "sah"},
}


class Contestants:
    """Hierarchies of one mesh by name, timed in turns at the same poses."""

    def __init__(self, mesh: rayvox.CollisionMesh, options: dict[str, Options]) -> None:
        self._bvhs = {name: mesh.bvh(**chosen) for name, chosen in options.items()}

    def query_us(self, poses: NDArray[np.float64], repeats: int) -> dict[str, float]:
        """Least microseconds a query."""
        best = dict.fromkeys(self._bvhs, np.inf)
        for _ in range(repeats):
            for name, bvh in self._bvhs.items():
                start = time.perf_counter()
                verdicts = rayvox.collide(bvh, bvh, poses)
                best[name] = min(best[name], 1e6 * (time.perf_counter() - start) / len(poses))
                assert not verdicts.any(), name
        return best

    def work(self, poses: NDArray[np.float64]) -> dict[str, dict[str, float]]:
        """Mean counts a query: bounding volume pairs, axes looked at, triangle pairs."""
        counts = {}
        for name, bvh in self._bvhs.items():
            found = rayvox.collide(bvh, bvh, poses, contacts="first").statistics
            kinds = ("node_pairs", "axis_tests", "triangle_pairs", "undecided")
            counts[name] = {kind: float(getattr(found, kind).mean()) for kind in kinds}
        return counts


def build_ms(mesh: rayvox.CollisionMesh, options: dict[str, Options], repeats: int) -> dict[str, float]:
    """Least milliseconds of a build, on all threads."""
    best = dict.fromkeys(options, np.inf)
    for _ in range(repeats):
        for name, chosen in options.items():
            start = time.perf_counter()
            mesh.bvh(**chosen)
            best[name] = min(best[name], 1e3 * (time.perf_counter() - start))
    return best


def with_instruction_set(name: str, mesh: Mesh, poses: NDArray[np.float64], repeats: int) -> dict[str, float]:
    """The traversals timed in a process that is told to use an instruction set."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.npz"
        np.savez(case, vertices=mesh.vertices, triangles=mesh.triangles, poses=poses)
        command = [sys.executable, "-m", "benchmarks.simdop", "--case", str(case), "--repeats", str(repeats)]
        environment = os.environ | {"RAYVOX_SIMD": name, "RAYVOX_THREADS": "1"}
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment, cwd=REPOSITORY)
        times: dict[str, float] = json.loads(done.stdout)
        return times


def run_case(path: str, repeats: int) -> None:
    """What with_instruction_set's process does."""
    case = np.load(path)
    mesh = rayvox.CollisionMesh(case["vertices"], case["triangles"])
    print(json.dumps(Contestants(mesh, TRAVERSALS).query_us(case["poses"], repeats)))


def peers(mesh: Mesh, poses: NDArray[np.float64], repeats: int) -> dict[str, Any]:
    """Coal's and FCL's times, builds and wrong verdicts (all poses are apart)."""
    found: dict[str, Any] = {}
    for peer in ("coal", "fcl"):
        try:
            measured, verdicts = run_peer(peer, mesh, poses, repeats)  # type: ignore[arg-type]
        except PeerUnavailableError as error:
            print(error, file=sys.stderr)
            continue
        found[peer] = {"query_us": min(measured["query_us"]), "wrong": int(verdicts.sum())}
        found[peer] |= {key: 1e3 * measured[f"{key[:-3]}_s"] for key in ("build_obb_ms", "build_obbrss_ms")}
    return found


def measure(robot: Mesh, size: int, pose_count: int, repeats: int, apart: float, thorough: bool) -> dict[str, Any]:
    """All experiments on one robot at one size; the secondary ones only if `thorough`."""
    mesh = resized(robot, size)
    collision_mesh = rayvox.CollisionMesh(mesh.vertices, mesh.triangles)
    cores = rayvox.thread_count()
    poses = touching_poses(mesh, collision_mesh.bvh(), pose_count, apart)
    result: dict[str, Any] = {"robot": robot.name, "triangles": len(mesh.triangles), "poses": len(poses)}
    result["build_ms"] = build_ms(collision_mesh, BUILDS, 3)
    rayvox.set_thread_count(1)
    traversals = Contestants(collision_mesh, TRAVERSALS)
    result["query_us"] = traversals.query_us(poses, repeats)
    result["peers"] = peers(mesh, poses, max(3, repeats // 4))
    again = traversals.query_us(poses, repeats)
    result["query_us"] = {name: min(value, again[name]) for name, value in result["query_us"].items()}
    result["work"] = traversals.work(poses)
    if thorough:
        sets = {n: with_instruction_set(n, mesh, poses, repeats // 2) for n in ("avx512", "avx2", "portable")}
        result["instruction_sets_us"] = sets
        result["splitting_us"] = Contestants(collision_mesh, SPLITTING).query_us(poses, repeats // 2)
        result["orientations_us"] = Contestants(collision_mesh, ORIENTATIONS).query_us(poses, repeats // 2)
    far = np.tile(np.eye(4), (10_000, 1, 1))
    far[:, 0, 3] = 100.0
    result["far_us"] = Contestants(collision_mesh, {"hybrid": PRODUCT}).query_us(far, 5)["hybrid"]
    rayvox.set_thread_count(cores)
    return result


def print_results(results: list[dict[str, Any]]) -> None:
    """Tables in the order of the paper's figures."""
    rows = []
    for r in results:
        ours, others = r["query_us"], r["peers"]
        ratios = [others[p]["query_us"] / ours["hybrid"] if p in others else "" for p in ("coal", "fcl")]
        wide = min(ours["1vs16"], ours["4vs4"], ours["hybrid"])
        times = [others[p]["query_us"] if p in others else "" for p in ("coal", "fcl")]
        columns = [ours["hybrid"], *times, *ratios, ours["1vs16"], ours["4vs4"], ours["scalar, binary"]]
        rows.append([r["robot"], r["triangles"], *columns, ours["scalar, binary"] / wide])
    header = [
        "robot",
        "triangles",
        "hybrid us",
        "Coal",
        "FCL",
        "Coal / hybrid",
        "FCL / hybrid",
        "1vs16",
        "4vs4",
        "binary",
    ]
    print_table([*header, "binary / best"], rows)
    for peer in ("coal", "fcl"):
        ratios = [r["peers"][peer]["query_us"] / r["query_us"]["hybrid"] for r in results if peer in r["peers"]]
        if ratios:
            print(f"geometric mean, {peer} / hybrid: {np.exp(np.mean(np.log(ratios))):.1f}")
    for kind in ("build_ms", "splitting_us", "orientations_us"):
        for r in results:
            if kind in r:
                print(f"\n{kind}, {r['robot']} {r['triangles']}")
                print_table(["variant", kind], [[name, value] for name, value in r[kind].items()])
    for r in results:
        if "instruction_sets_us" in r:
            sets = r["instruction_sets_us"]
            print(f"\ninstruction sets, {r['robot']} {r['triangles']}")
            print_table(["traversal", *sets], [[name, *(sets[s][name] for s in sets)] for name in TRAVERSALS])


def plot(results: list[dict[str, Any]], path: Path) -> None:
    """Query time against polygon count (the paper's Figs. 8 and 9), one panel a robot."""
    from matplotlib.figure import Figure

    robots = sorted({r["robot"] for r in results})
    figure = Figure(figsize=(4 * len(robots), 3.5), layout="constrained")
    for axes, robot in zip(np.atleast_1d(figure.subplots(1, len(robots))), robots, strict=True):
        own = sorted((r for r in results if r["robot"] == robot), key=lambda r: r["triangles"])
        for name in ("hybrid", "1vs16", "4vs4", "scalar, binary"):
            axes.loglog([r["triangles"] for r in own], [r["query_us"][name] for r in own], "o-", label=name)
        for peer in ("coal", "fcl"):
            known = [r for r in own if peer in r["peers"]]
            times = [r["peers"][peer]["query_us"] for r in known]
            axes.loglog([r["triangles"] for r in known], times, "s--", label=peer)
        axes.set(title=robot, xlabel="triangles", ylabel="us a query, touching")
    axes.legend(fontsize="small")
    figure.savefig(path)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="The SIMDop paper's experiments.")
    parser.add_argument("--quick", action="store_true", help="two robots, two sizes, 60 poses")
    parser.add_argument("--robots", default="panda,ur5,husky,anymal_c,pr2")
    parser.add_argument("--sizes", default="1000,10000,50000,200000")
    parser.add_argument("--poses", type=int, default=200)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--apart", type=float, default=0.0, help="distance, as a part of the radius, instead of zero")
    parser.add_argument("--data", type=Path, default=REPOSITORY.parent / "shared" / "data" / "robots")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json and NAME.svg")
    parser.add_argument("--case", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.case:
        run_case(arguments.case, arguments.repeats)
        return
    if arguments.quick:
        arguments.robots, arguments.sizes, arguments.poses = "panda,ur5", "1000,10000", 60
    header = provenance()
    sizes = [int(size) for size in arguments.sizes.split(",")]
    results = []
    for name in arguments.robots.split(","):
        robot = load_robot(arguments.data / name)
        for size in sizes:
            thorough = name == arguments.robots.split(",")[0] and arguments.apart == 0
            results.append(measure(robot, size, arguments.poses, arguments.repeats, arguments.apart, thorough))
            print(name, size, json.dumps(results[-1]["query_us"]), json.dumps(results[-1]["peers"]), file=sys.stderr)
    print_results(results)
    if arguments.write:
        print(write_results(arguments.write, header, results))
        plot(results, RESULTS / f"{arguments.write}.svg")


if __name__ == "__main__":
    main()
