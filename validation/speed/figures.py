"""Figures of the report, drawn from the kept findings."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

__all__ = ["draw"]

PUBLISHED = tomllib.loads((Path(__file__).parent / "published.toml").read_text(encoding="utf-8"))
OURS, FULL, OTHERS, BEST = (
    "#0072B2",
    "#56B4E9",
    "#999999",
    "#D55E00",
)  # Okabe-Ito palette, distinct for colour-blind readers
STAGE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442", "#000000")

MARKS = ("o", "s", "^")
"""Marks of one car, many cars, eight cars."""
LEFT = 0.01  # start of the bars
TICKS = [tick * 10**decade for decade in (0, 1, 2, 3) for tick in (1, 1.5, 2, 3, 5, 7)]

Cases = Mapping[str, Any]


def draw(cases: Cases, folder: Path) -> list[str]:
    """Draw the figures of all cases that were measured.

    Args:
        cases: Findings by case.
        folder: Folder of the figures.

    Returns:
        Names of the files.
    """
    drawn = []
    for name, (case, make) in {
        "speed_factors.png": ("trains", _factors),
        "speed_scaling.png": ("scaling", _scaling),
        "speed_roofline.png": ("roofline", _roofline),
    }.items():
        if case in cases:
            figure = make(cases)
            figure.savefig(folder / name, dpi=160)
            plt.close(figure)
            drawn.append(name)
    return drawn


def _factors(cases: Cases) -> Any:
    """Draw real-time factors of tiengine and of published programs on a logarithmic axis."""
    bars = list(_bars(cases))
    figure, axis = plt.subplots(figsize=(9.5, 0.55 * len(bars) + 1.3), layout="constrained")
    for i, (label, source, low, high, colour) in enumerate(bars):
        place = len(bars) - i
        axis.barh(
            place, high - (low if low < high else 0.01), left=low if low < high else 0.01, height=0.6, color=colour
        )
        number = f"{low:g}–{high:g}" if low < high else f"{float(f'{high:.3g}'):g}" if high < 1000.0 else f"{high:.0f}"
        axis.text(
            high * 1.08, place, number, va="center", fontsize=9,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )  # fmt: skip
        axis.text(-0.01, place + 0.12, label, va="center", ha="right", fontsize=9, transform=axis.get_yaxis_transform())
        axis.text(
            -0.01, place - 0.22, source, va="center", ha="right", fontsize=7, color="0.4",
            transform=axis.get_yaxis_transform(),
        )  # fmt: skip
    axis.axvline(1.0, color="0.2", linewidth=1.0)
    axis.text(1.0, len(bars) + 0.55, "real time", ha="center", fontsize=8, color="0.2")
    axis.set(xscale="log", xlim=(LEFT, 3e4), ylim=(0.4, len(bars) + 0.9), yticks=[])
    axis.set_xlabel("wall time over simulated time (real-time factor); shorter is faster")
    axis.grid(axis="x", color="0.9")
    axis.set_axisbelow(True)
    axis.spines[["top", "right", "left"]].set_visible(False)
    return figure


def _bars(cases: Cases) -> Any:
    """Label, source, smallest and largest factor, colour."""
    machine = cases["trains"]["circumstances"]["machine"]
    here = f"measured here, {machine['cpu']}, {machine['cores']} cores"
    values = cases["trains"]["values"]
    yield "tiengine, eight cars", here, values["rtf_train8"], values["rtf_train8"], OURS
    yield "tiengine, sixteen cars", here, values["rtf_train16"], values["rtf_train16"], OURS
    for case, key, words, source, colour in (
        ("batch", "rtf_per_train8", "tiengine, per train of 16 with eight cars", f"{here}, two workers", OURS),
        ("one_car", "rtf_default", "tiengine, one car", here, OURS),
        ("batch", "rtf_per_train", "tiengine, per train of 64 with one car", f"{here}, two workers", OURS),
        ("one_car", "rtf_paper", "tiengine, one car, the paper's sines", here, OURS),
        ("full_length", "rtf", "our full-length model, one car, accurate as the default", f"{here}, 600 m", FULL),
    ):
        if case in cases:
            rtf = cases[case]["values"][key]
            yield words, source, rtf, rtf, colour
    peer, peers, paper = (PUBLISHED[name] for name in ("peer", "peers", "paper"))
    yield peer["label"], peer["source"], peer["rtf"], peer["rtf"], OTHERS
    yield peers["label"], peers["source"], peers["rtf_from"], peers["rtf_to"], OTHERS
    yield paper["label"], paper["source"], paper["rtf"], paper["rtf"], OTHERS


def _scaling(cases: Cases) -> Any:
    """Draw the cost of a step over everything that was varied."""
    data = cases["scaling"]["data"]
    figure, axes = plt.subplots(2, 2, figsize=(9.0, 6.6), layout="constrained")
    for axis, found in zip(axes.flat, data.values(), strict=True):
        x, us = np.array(found["x"]), np.array(found["us"])
        axis.loglog(x, us, "o", color=OURS, markersize=6)
        p = found["exponent"]
        fit = np.exp(np.mean(np.log(us) - p * np.log(x))) * x**p
        axis.loglog(x, fit, color=BEST, linewidth=1.1, label=f"fit: exponent {p:.2f}")
        axis.plot([], [], " ", label=f"upper half: {found['exponent_upper']:.2f}")
        axis.set_xticks(x, [f"{each:.3g}" for each in x])
        axis.minorticks_off()
        low, high = us.min() / 1.5, us.max() * 1.5
        ticks = [tick for tick in TICKS if low < tick < high]
        axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set(xlabel=found["words"], ylabel=f"µs per {found['unit']}", ylim=(low, high))
        axis.grid(color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(frameon=False, fontsize=8, loc="upper right" if p < 0 else "upper left")
    return figure


def _roofline(cases: Cases) -> Any:
    """Draw the rates of the stages over their intensity, with the machine's roofline."""
    data = cases["roofline"]["data"]
    roofs = data["one"]["roofs"]
    figure, axis = plt.subplots(figsize=(8.5, 5.2), layout="constrained")
    x = np.logspace(-1.5, 1.5, 200)
    for key, words, line in (
        ("triad_l2_gb_per_s", "second-level cache", "-"),
        ("triad_dram_gb_per_s", "main memory", "--"),
    ):
        bandwidth = roofs[key]
        axis.loglog(
            x, np.minimum(bandwidth * x, roofs["dgemm_gflops"]), line, color="0.25", linewidth=1.2,
            label=f"roof: {words}, {bandwidth:.0f} GB/s; dgemm {roofs['dgemm_gflops']:.0f} GFLOP/s",
        )  # fmt: skip
    _points(axis, data)
    axis.set(
        xlabel="counted operations over bytes touched [flop/B]",
        ylabel="rate of a stage [GFLOP/s]",
        xlim=(x[0], x[-1]),
        ylim=(0.2, 1.6 * roofs["dgemm_gflops"]),
    )
    axis.grid(color="0.9", which="both", linewidth=0.5)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False, fontsize=7.5, loc="lower right")
    return figure


def _points(axis: Any, data: Mapping[str, Any]) -> None:
    """Draw one colour per stage, one mark per group of trains."""
    stages: Sequence[str] = [stage["name"] for stage in data["one"]["stages"]]
    for (name, group), mark in zip(data.items(), MARKS, strict=True):
        for stage in group["stages"]:
            if not stage["us"] > 0.0:
                continue  # too short for the clock
            colour = STAGE_COLOURS[stages.index(stage["name"])]
            axis.loglog(
                stage["flops"] / stage["traffic"], 1e-3 * stage["flops"] / stage["us"], mark, color=colour,
                markersize=8, markerfacecolor="white" if group["trains"] == 1 else colour, markeredgewidth=1.6,
                label=stage["name"] if name == "many" else None,
            )  # fmt: skip
        fill = "white" if group["trains"] == 1 else "0.4"
        axis.plot([], [], mark, color="0.4", markerfacecolor=fill, label=f"{group['trains']} x {group['words']}")
