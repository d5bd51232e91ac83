"""Figure of the README: wheel forces of the paper's first wheelset over distance."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt

from tiengine import backend
from validation.runs import simulate

__all__ = ["draw"]

LEFT, RIGHT = "#0072B2", "#D55E00"  # blue and vermilion of Okabe and Ito, told apart by any eye


def draw(path: Path) -> None:
    """Vertical and lateral forces of wheelset 1, left and right, over the way done.

    Args:
        path: PNG to write.
    """
    backend.start()
    run = simulate("paper")
    way = run.position - run.position[0]
    figure, axes = plt.subplots(2, 1, figsize=(9.0, 5.4), sharex=True, layout="constrained")
    for axis, force, name in zip(axes, (run.vertical, run.lateral), ("vertical", "lateral"), strict=True):
        for side, (label, colour) in enumerate((("left", LEFT), ("right", RIGHT))):
            axis.plot(way, 1e-3 * force[:, 0, side], color=colour, label=label, linewidth=0.6, alpha=0.85)
        axis.set_ylabel(f"{name} force [kN]")
        axis.grid(color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].axhline(1e-3 * run.vertical[0, 0].mean(), color="0.3", linewidth=0.8, linestyle="--", label="static")
    legend = axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    for line in legend.get_lines():
        line.set_linewidth(2.0)
    axes[1].set_xlabel("distance [m]")
    axes[1].set_xlim(0.0, round(float(way[-1]), -1))
    axes[0].set_title("Wheelset 1 on the rails: CRH380A, CRTS III, 350 km/h", loc="left", fontsize=10)
    figure.savefig(path, dpi=160)
    plt.close(figure)
