"""Figures 4 and 5 of Min, Han, Kim 2021."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("Agg")
from matplotlib import pyplot as plt

_NO_RETURN = (0.6, 0.6, 0.6, 1.0)


def draw_hit_counts(name: str, depth_u16: NDArray[np.uint16], counts: NDArray[np.int64], folder: Path) -> Path:
    """Fig. 4: the scene (depth, near is bright) above the voxels each ray passes: blue few, red many, grey none."""
    colours = mpl.colormaps["jet"].with_extremes(bad=_NO_RETURN)
    figure, (scene, hits) = plt.subplots(2, 1, figsize=(4.4, 6.2), layout="constrained")
    scene.imshow(np.ma.masked_equal(depth_u16, 0) * 1e-3, cmap=mpl.colormaps["gray_r"].with_extremes(bad="black"))
    scene.set_title(name)
    image = hits.imshow(np.ma.masked_less(counts, 0), cmap=colours)
    figure.colorbar(image, ax=hits, label="voxels passed", shrink=0.8)
    for axes in (scene, hits):
        axes.set_axis_off()
    path = folder / f"fig4_{name.split()[-1]}.png"
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def draw_times(columns: list[dict[str, Any]], folder: Path) -> Path:
    """Fig. 5: ray shooting per view, logarithmic; BVH and hand-over stacked on ours, OctoMap in blue."""
    engines = list(columns[0]["engines"])
    width = 0.8 / (len(engines) + 1)
    at = np.arange(len(columns))
    figure, axes = plt.subplots(figsize=(10, 4.8), layout="constrained")
    axes.bar(at, [c["octomap"]["ray_shooting_ms"] for c in columns], width, label="OctoMap (C++)", color="tab:blue")
    golds = plt.colormaps["YlOrBr"](np.linspace(0.3, 0.7, len(engines)))
    for index, engine in enumerate(engines, start=1):
        stages = [c["engines"][engine]["steady"] for c in columns]
        bottom = np.zeros(len(columns))
        for stage, colour in (
            ("ray_shooting_ms", golds[index - 1]),
            ("build_bvh_ms", "tab:green"),
            ("hand_over_ms", "purple"),
        ):
            height = np.array([s[stage] for s in stages])
            label = f"{engine}: ray shooting" if stage == "ray_shooting_ms" else None
            if index == 1 and stage != "ray_shooting_ms":
                label = {"build_bvh_ms": "build BVH", "hand_over_ms": "hand-over"}[stage]
            axes.bar(at + index * width, height, width, bottom=bottom, color=colour, label=label)
            bottom += height
    axes.set_yscale("log")
    axes.set_ylim(bottom=1)
    axes.set_xticks(at + 0.4 - width / 2, [c["view"] for c in columns])
    axes.set_ylabel("ms per view (ours: steady state)")
    axes.legend(fontsize="small", ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.16))
    path = folder / "fig5_times.png"
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path
