"""The paper's comparison, as a page with tables and figures: ``python -m validation paper``."""

from __future__ import annotations

import platform
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.progress import Progress

from tiengine.engine import backend
from validation.frame.runs import Forces
from validation.paper.comparison import (
    ABSORBING,
    COARSE_STEP,
    LENGTHS,
    PER_METRE,
    STEP,
    TRADITIONAL_MODES,
    Difference,
    difference,
    full,
    window,
)

__all__ = ["write"]

PAPER_MODES = 60 / 36
LEFT, RIGHT, MARK = "#0072B2", "#D55E00", "#555555"  # Okabe-Ito palette, distinct for colour-blind readers
DIRECTIONS = ("vertical", "lateral")
PAPER = {"window": (943, 42_261.0), "full": (16_427, 88_532.0)}
PAPER_DIFFERENCE = 3.8


def write(folder: Path) -> Path:
    """Run both models, compare, draw.

    Args:
        folder: Folder of the page and its figures.

    Returns:
        The page.
    """
    backend.start(1)
    folder.mkdir(parents=True, exist_ok=True)
    runs = _runs()
    reference, ours = runs["full, 90 modes per slab"], runs["window 36 m, 60 modes"]
    for direction, number in zip(DIRECTIONS, (2, 3), strict=True):
        _draw_forces(folder / f"paper_{direction}.png", reference, ours, direction, number)
    _draw_windows(folder / "paper_windows.png", reference)
    page = folder / "paper.md"
    page.write_text(_page(runs), encoding="utf-8")
    return page


def _runs() -> dict[str, Forces]:
    """All runs of the page; each is made once per session."""
    plan: dict[str, Callable[[], Forces]] = {
        "window 36 m, 60 modes, 7 slabs, 2e-4 s": lambda: window(36, PAPER_MODES, "none", COARSE_STEP, *SEVEN_SLABS),
        "full 600 m, 20 modes per slab, 2e-4 s": lambda: full(TRADITIONAL_MODES, step=COARSE_STEP, length=600.0),
        "full, 90 modes per slab": full,
        "full, 90 modes per slab, local": lambda: full(truncation="local"),
        "full 600 m, 20 modes per slab": lambda: full(TRADITIONAL_MODES, length=600.0),
        "window 36 m, 60 modes": lambda: window(36, PAPER_MODES),
        "window 36 m, 60 modes, local": lambda: window(36, PAPER_MODES, "local"),
        "window 36 m, 60 modes, 7 slabs": lambda: window(36, PAPER_MODES, "none", STEP, *SEVEN_SLABS),
        "window 36 m, 72 modes": lambda: window(36),
        "window 36 m, 72 modes, local": lambda: window(36, truncation="local"),
        "window 36 m, absorbing": lambda: window(36, PER_METRE, "none", STEP, ABSORBING),
        **{f"window {length} m": lambda length=length: window(length) for length in LENGTHS if length != 36},
    }
    found = {}
    with Progress(*Progress.get_default_columns(), console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=len(plan))
        for name, make in plan.items():
            bar.update(task, description=name)
            found[name] = make()
            bar.advance(task)
    return found


SEVEN_SLABS = ('numerics.slab_count="paper"',)


def _draw_forces(path: Path, reference: Forces, ours: Forces, direction: str, number: int) -> None:
    """Draw the paper's Fig. 2 or 3: forces of wheelset 1, left and right, both models, and their difference."""
    n = min(len(reference.time), len(ours.time))
    distance = reference.position[:n] - reference.position[0]
    figure, axes = plt.subplots(4, 1, figsize=(9.0, 9.0), sharex=True, layout="constrained")
    for side, (name, colour) in enumerate((("left", LEFT), ("right", RIGHT))):
        a, b = (1e-3 * getattr(run, direction)[:n, 0, side] for run in (reference, ours))
        axes[2 * side].plot(distance, a, color=MARK, linewidth=1.2, label="full length")
        axes[2 * side].plot(distance, b, color=colour, linewidth=0.5, label="moving window")
        axes[2 * side].set_ylabel(f"{name} wheel [kN]")
        axes[2 * side].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
        metre = np.flatnonzero(np.diff(np.floor(distance), prepend=-1.0))
        largest = np.maximum.reduceat(1e3 * np.abs(a - b), metre)
        axes[2 * side + 1].semilogy(distance[metre], largest, color=colour, linewidth=0.9)
        axes[2 * side + 1].set_ylabel("|difference| [N]\nlargest in 1 m")
    axes[1].sharey(axes[3])
    axes[3].autoscale()
    for axis in axes:
        axis.grid(color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("distance [m]")
    axes[-1].set_xlim(0.0, round(float(distance[-1]), -1))
    figure.suptitle(
        f"Fig. {number}: {direction} force of wheelset 1, 60 modes in 36 m against {reference.facts['modes']} in"
        f" {reference.facts['rail_length']:g} m",
        x=0.01, ha="left", fontsize=10,
    )  # fmt: skip
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _draw_windows(path: Path, reference: Forces) -> None:
    """Draw the difference over the window's length, two modes per metre."""
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.6), sharey=True, layout="constrained")
    for axis, direction, colour in zip(axes, DIRECTIONS, (LEFT, RIGHT), strict=True):
        found = [difference(reference, window(length), direction) for length in LENGTHS]
        axis.semilogy(LENGTHS, [d.largest for d in found], "o-", color=colour, label="largest over peak")
        axis.semilogy(
            LENGTHS, [d.rms for d in found], "s--", color=colour, mfc="white", label="rms over standard deviation"
        )
        axis.set_title(f"{direction} wheel forces", loc="left", fontsize=10)
        axis.set_xlabel("window [m]")
        axis.set_xticks(LENGTHS)
        axis.grid(color="0.9", which="both")
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(frameon=False)
    axes[0].set_ylabel("difference from full length [%]")
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _page(runs: dict[str, Forces]) -> str:
    return "\n".join(
        [
            "# The paper's case: moving window against full length",
            "",
            "One vehicle (CRH380A), 600 m of slab track (CRTS III) at 350 km/h, German low disturbance, seed 1; both"
            " models run over the same track, from chainage 30 m on. `python -m validation paper` wrote this page"
            f" (Python {platform.python_version()}).",
            "",
            "*Relative difference*: largest absolute difference over all wheels and all times of the 600 m, over the"
            " largest force of the full-length model; in brackets the root mean square difference over the standard"
            f" deviation of the force. Time step {STEP:g} s unless stated: at {COARSE_STEP:g} s the impact of a"
            " landing wheel has an error of some per cent of the peak in either program, independent of the window.",
            "",
            *_against_paper(runs),
            *_modes(runs),
            *_windows(runs),
            *_slabs(runs),
            "![vertical](paper_vertical.png)",
            "",
            "![lateral](paper_lateral.png)",
            "",
        ]
    )


def _against_paper(runs: dict[str, Forces]) -> list[str]:
    """Table of DOFs, run times and differences, with the paper's."""
    ours, coarse = runs["window 36 m, 60 modes, 7 slabs"], runs["window 36 m, 60 modes, 7 slabs, 2e-4 s"]
    traditional = runs["full 600 m, 20 modes per slab"]
    slow = runs["full 600 m, 20 modes per slab, 2e-4 s"]
    found = {d: difference(traditional, ours, d) for d in DIRECTIONS}
    leading = {d: difference(traditional, ours, d, wheelset=0) for d in DIRECTIONS}
    speed_up = slow.facts["real_time_factor"] / coarse.facts["real_time_factor"]
    return [
        "## The paper's settings: 36 m, 60 modes, 7 slabs; 600 m of rail, 1200 modes, 20 modes per slab",
        "",
        "| | paper | tiengine |",
        "| --- | --- | --- |",
        f"| degrees of freedom, window | {PAPER['window'][0]} | {ours.facts['dofs']} |",
        f"| degrees of freedom, full length | {PAPER['full'][0]} | {traditional.facts['dofs']} |",
        f"| run time, window | {PAPER['window'][1]:.0f} s for 6.17 s | {_times(coarse)} |",
        f"| run time, full length | {PAPER['full'][1]:.0f} s | {_times(slow)} |",
        f"| full length over window, per simulated second | {PAPER['full'][1] / PAPER['window'][1]:.1f} |"
        f" {speed_up:.1f} |",
        f"| relative difference, vertical, all wheels | | {_text(found['vertical'])} |",
        f"| relative difference, lateral, all wheels | | {_text(found['lateral'])} |",
        f"| relative difference, wheelset 1 | {PAPER_DIFFERENCE} % | {_text(leading['vertical'])} vertical,"
        f" {_text(leading['lateral'])} lateral |",
        "",
        f"Run times are of the time loop, step {COARSE_STEP:g} s, two passes, one core of this machine; those of the"
        f" paper are"
        " of MATLAB's ode15s on a Xeon W-2115. Its counts are 35 + 2 x 5 x 60 + 7 x 44 and"
        " 35 + 2 x 5 x 1200 + 122 x 36; 44 degrees of freedom per slab and 122 slabs do not follow from its text (18"
        " plate elements have 90, and slabs of 5.67 m are 106 on 600 m). The rail is a whole number of seats long,"
        f" {traditional.facts['rail_length']:.2f} m; wheels keep 10 m from its ends,"
        f" which leaves a distance of {traditional.position[-1] - traditional.position[0]:.0f} m.",
        "",
    ]


def _modes(runs: dict[str, Forces]) -> list[str]:
    """60 and 72 modes, with and without the truncation correction, against 2 modes per metre in full length."""
    rows = []
    for modes in (60, 72):
        for correction in ("", ", local"):
            reference = runs[f"full, 90 modes per slab{correction}"]
            found = [difference(reference, runs[f"window 36 m, {modes} modes{correction}"], d) for d in DIRECTIONS]
            rows.append(f"| {modes} | {'local' if correction else 'none'} | {_text(found[0])} | {_text(found[1])} |")
    return [
        "## 60 and 72 modes in 36 m against 2 modes per metre of 661.5 m",
        "",
        "72 modes are as many per metre as in the full length; slabs have the same 90 modes in both. With the"
        " truncation correction both models add the static compliance of their omitted modes under the wheels.",
        "",
        "| modes in 36 m | correction, both | vertical | lateral |",
        "| --- | --- | --- | --- |",
        *rows,
        "",
    ]


def _windows(runs: dict[str, Forces]) -> list[str]:
    """Difference over the length of the window."""
    reference = runs["full, 90 modes per slab"]
    found = {f"{length} m": window(length) for length in LENGTHS}
    found["36 m, absorbing zones of 6 m"] = runs["window 36 m, absorbing"]
    rows = [
        f"| {name} | " + " | ".join(_text(difference(reference, run, d)) for d in DIRECTIONS) + " |"
        for name, run in found.items()
    ]
    return [
        "## Length of the window, 2 modes per metre",
        "",
        "| window | vertical | lateral |",
        "| --- | --- | --- |",
        *rows,
        "",
        "With 36 m the largest vertical difference is an echo: the impact of the landing leading wheel returns"
        " from the window's pinned end 8 m ahead 7.9 ms later, the time for 16 m at the shear wave speed"
        " (2030 m/s). `numerics.absorbing_zone` absorbs it.",
        "",
        "![window length](paper_windows.png)",
        "",
    ]


def _slabs(runs: dict[str, Forces]) -> list[str]:
    reference, traditional = runs["full, 90 modes per slab"], runs["full 600 m, 20 modes per slab"]
    found = [_text(difference(reference, traditional, d)) for d in DIRECTIONS]
    return [
        "## Slabs by 20 modes instead of their mesh",
        "",
        f"The full-length model against itself: {found[0]} vertical, {found[1]} lateral. 20 modes cannot represent the"
        " local deflection at a seat, so that the traditional slab is slightly too stiff there.",
        "",
    ]


def _text(found: Difference) -> str:
    return f"{found.largest:.2g} % ({found.rms:.2g} %)"


def _times(run: Forces) -> str:
    return f"{run.facts['wall_time_loop']:.1f} s for {run.facts['simulated_time']:.2f} s"
