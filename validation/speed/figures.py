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

LEFT = 0.01  # start of the bars
TICKS = [tick * 10**decade for decade in (1, 2, 3) for tick in (1, 1.5, 2, 3, 5, 7)]

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
        "speed_factors.png": ("one_train", _factors),
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
    machine = cases["one_train"]["circumstances"]["machine"]
    here = f"measured here, {machine['cpu']}, {machine['cores']} cores"
    paper, peer, peers = (PUBLISHED[name] for name in ("paper", "peer", "peers"))
    yield paper["label"], paper["source"], paper["rtf"], paper["rtf"], OTHERS
    yield peers["label"], peers["source"], peers["rtf_from"], peers["rtf_to"], OTHERS
    yield peer["label"], peer["source"], peer["rtf"], peer["rtf"], OTHERS
    if "full_length" in cases:
        values = cases["full_length"]["values"]
        for modes in (90, 20):
            rtf = values[f"rtf_{modes}"]
            yield f"our full-length model, 600 m, {modes} modes per slab", here, rtf, rtf, FULL
    one = cases["one_train"]["values"]
    yield "tiengine, default numerics, one train", here, one["rtf_default"], one["rtf_default"], OURS
    yield "tiengine, the paper's case, one train", here, one["rtf"], one["rtf"], OURS
    if "batch" in cases:
        rtf = cases["batch"]["values"]["rtf_per_train"]
        yield "tiengine, the paper's case, per train of 64", f"{here}, two workers", rtf, rtf, OURS


def _scaling(cases: Cases) -> Any:
    """Draw the cost of a step over everything that was varied."""
    data = cases["scaling"]["data"]
    panels = {name: axis for name, axis in data.items() if name != "outputs"}
    outputs = data["outputs"]
    panels["interval"] = outputs["interval"] | {"words": "steps between samples of everything", "unit": "step"}
    panels["channels"] = outputs["channels"] | {"words": "channels of a wheel, every step", "unit": "step"}
    figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.6), layout="constrained")
    for axis, found in zip(axes.flat, panels.values(), strict=True):
        x, us = np.array(found["x"]), np.array(found["us"])
        axis.loglog(x, us, "o", color=OURS, markersize=6)
        p = found["exponent"]
        fit = np.exp(np.mean(np.log(us) - p * np.log(x))) * x**p
        axis.loglog(x, fit, color=BEST, linewidth=1.1, label=f"fit: exponent {p:.2f}")
        if "exponent_upper" in found:
            axis.plot([], [], " ", label=f"upper half: {found['exponent_upper']:.2f}")
        axis.set_xticks(x, [f"{each:g}" for each in x])
        axis.minorticks_off()
        low, high = us.min() / 1.5, us.max() * 1.5
        ticks = [tick for tick in TICKS if low < tick < high]
        axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set(xlabel=found["words"], ylabel=f"µs per {found['unit']}", ylim=(low, high))
        if "shares_last" in found:
            shares = list(found["shares_last"].items())[:2]
            text = "at the last point:\n" + "\n".join(f"{stage} {share:.0%}" for stage, share in shares)
            corner = (0.04, 0.04) if p < 0 else (0.96, 0.04)
            axis.text(
                *corner, text, transform=axis.transAxes, fontsize=7.5, color="0.35",
                ha="left" if p < 0 else "right", va="bottom",
            )  # fmt: skip
        axis.grid(color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(frameon=False, fontsize=8, loc="upper right" if p < 0 else "upper left")
    return figure


def _roofline(cases: Cases) -> Any:
    """Draw the rates of the products of each stage over their intensity, with the machine's roofline."""
    data = cases["roofline"]["data"]
    roofs = data["one"]["roofs"]
    figure, axis = plt.subplots(figsize=(8.5, 5.2), layout="constrained")
    x = np.logspace(-1.2, 1.8, 200)
    for key, words, line in (
        ("gemv_gb_per_s", "matrix in the second-level cache", "-"),
        ("triad_dram_gb_per_s", "main memory", "--"),
    ):
        bandwidth = roofs[key]
        axis.loglog(
            x, np.minimum(bandwidth * x, roofs["dgemm_gflops"]), line, color="0.25", linewidth=1.2,
            label=f"roof: {words}, {bandwidth:.0f} GB/s; dgemm {roofs['dgemm_gflops']:.0f} GFLOP/s",
        )  # fmt: skip
    _points(axis, data)
    axis.set(
        xlabel="operations over bytes of operands and result [flop/B]",
        ylabel="rate of the matrix products [GFLOP/s]",
        xlim=(x[0], x[-1]),
        ylim=(0.5, 1.6 * roofs["dgemm_gflops"]),
    )
    axis.grid(color="0.9", which="both", linewidth=0.5)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False, fontsize=7.5, loc="lower right")
    return figure


def _points(axis: Any, data: Mapping[str, Any]) -> None:
    """Draw one colour per stage, hollow for one train, filled for many."""
    stages: Sequence[str] = [rate["stage"] for rate in data["one"]["rates"]]
    for name, mark in (("one", "o"), ("many", "s")):
        trains = data[name]["trains"]
        for rate in data[name]["rates"]:
            colour = STAGE_COLOURS[stages.index(rate["stage"]) % len(STAGE_COLOURS)]
            axis.loglog(
                rate["flops_per_step"] / rate["bytes_per_step"], rate["gflops"], mark, color=colour, markersize=8,
                markerfacecolor="white" if name == "one" else colour, markeredgewidth=1.6,
                label=rate["stage"] if name == "many" else None,
            )  # fmt: skip
        fill = "white" if name == "one" else "0.4"
        axis.plot(
            [], [], mark, color="0.4", markerfacecolor=fill, label=f"{trains} train{'s together' if trains > 1 else ''}"
        )
