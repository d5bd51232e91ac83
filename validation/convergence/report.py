"""Figures and table of the convergence study: ``python -m validation convergence``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.convergence.study import AXES, CONVERGED, DIRECTIONS, PRESENT, TOTALS, Axis, Setting, error
from validation.frame.runs import simulate

__all__ = ["draw", "real_time_factor", "table", "write"]

SEAT_PITCH = 0.63  # m
REPORT = Path(__file__).parents[1] / "report"
COLOURS = {"vertical": "#0072B2", "lateral": "#D55E00"}  # Okabe-Ito palette, distinct for colour-blind readers
MARKS = {"rms": "o", "p99": "s", "largest": "^"}
NORMS = {
    "rms": "rms over standard deviation",
    "p99": "exceeded in 1 % of the time, over peak",
    "largest": "largest over peak, wheels on the rails",
}
CAVEAT = (
    "The converged run shares its window with the last three settings and its step with the strict one, so that part of"
    " their errors cancels; `validation/convergence/study.py` states how much that is."
)
NUMBERS: dict[str, tuple[str, Callable[[Setting], float], float]] = {
    "dt": ("time step [s]", lambda s: s.dt, PRESENT.dt),
    "modes": ("modes per metre and field [1/m]", lambda s: s.modes, PRESENT.modes),
    "mesh": ("elements of a slab", lambda s: float(s.mesh[0] * s.mesh[1]), float(np.prod(PRESENT.mesh))),
    "window": ("length of the window [m]", lambda s: s.window, PRESENT.window),
}
"""Label of an axis, its value of a setting, its value of the first default."""


def draw(folder: Path) -> list[Path]:
    """Draw one figure for each axis, ``convergence_<axis>.png``.

    Args:
        folder: Folder of the files.

    Returns:
        The files.
    """
    import matplotlib as mpl  # imported here, since the table does not need it

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    files = []
    for name, axis in AXES.items():
        figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.2), sharey=True, layout="constrained")
        for panel, direction in zip(panels, DIRECTIONS, strict=True):
            _draw_errors(panel, name, axis, direction)
        panels[0].set_ylabel("error [%]")
        if len({run.truncation for run in axis.runs}) > 1:
            panels[0].plot(
                [], [], "--", color="0.3", markerfacecolor="white", marker="o", label="with local correction"
            )
        figure.legend(
            *panels[0].get_legend_handles_labels(), frameon=False, fontsize=8, loc="outside lower center", ncols=4
        )
        figure.suptitle(f"{axis.title}; against {axis.finest.label}", x=0.01, ha="left", fontsize=10)
        files.append(folder / f"convergence_{name}.png")
        figure.savefig(files[-1], dpi=160)
        plt.close(figure)
    return files


def _draw_errors(panel: Any, name: str, axis: Axis, direction: str) -> None:
    """Draw the errors of one force over the values of an axis; without correction solid, with it dashed."""
    label, number, present = NUMBERS[name]
    for truncation, line in (("none", "-"), ("local", "--")):
        runs = [run for run in axis.runs if run.truncation == truncation]
        if not runs:
            continue
        x = [number(run) for run in runs]
        for norm, words in NORMS.items():
            y = [getattr(error(run, axis.finest, direction), norm) for run in runs]
            shown = words if truncation == "none" else None
            panel.plot(
                x, y, line, marker=MARKS[norm], color=COLOURS[direction], markersize=5, linewidth=1.1, label=shown,
                markerfacecolor="white" if truncation == "local" else None,
            )  # fmt: skip
    panel.axhline(1.0, color="0.3", linewidth=0.8, linestyle=":")
    marks = {present: "first default"}
    if name == "modes":
        marks |= {2.0 * j / SEAT_PITCH: f"seat passing, harmonic {j}" for j in (1, 2)}
    for place, words in marks.items():
        panel.axvline(place, color="0.75", linewidth=0.8)
        panel.annotate(
            words, (place, 0.02), xycoords=("data", "axes fraction"), xytext=(3, 0), textcoords="offset points",
            rotation=90, fontsize=7, color="0.35", va="bottom",
        )  # fmt: skip
    panel.set_xscale("log" if name in ("dt", "modes", "mesh") else "linear")
    ticks = sorted({number(run) for run in axis.runs})
    panel.set_xticks(ticks, [_tick(name, run, number) for run in _first(axis.runs, number)])
    panel.minorticks_off()
    panel.set_yscale("log")
    panel.set_yticks([0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0], ["0.01", "0.03", "0.1", "0.3", "1", "3", "10"])
    panel.set_ylim(0.007, 12.0)
    panel.set_xlabel(label)
    panel.set_title(f"{direction} wheel force", fontsize=10, loc="left")
    panel.grid(color="0.92")
    panel.spines[["top", "right"]].set_visible(False)


def _first(runs: Sequence[Setting], number: Callable[[Setting], float]) -> list[Setting]:
    """One run for each value, ascending."""
    return [run for _, run in sorted({number(run): run for run in runs}.items())]


def _tick(name: str, run: Setting, number: Callable[[Setting], float]) -> str:
    return f"{run.mesh[0]} x {run.mesh[1]}" if name == "mesh" else f"{number(run):.3g}"


def table() -> str:
    """Markdown table: errors of every axis and of whole settings, wall times over that of the first default."""
    default = real_time_factor(PRESENT, runs=3)
    lines = [
        "# Convergence",
        "",
        "Errors in % of the peak (rms: of the standard deviation), vertical / lateral; *largest* while all wheels",
        "are on the rails, *landing* with everything included; see the head of `validation/convergence/study.py`.",
        f"*time*: wall time of the steps over that of the first default ({default:.2f} s per simulated second here,",
        "the fastest of three; other programs were running, so factors of up to two are noise).",
    ]
    for axis in AXES.values():
        lines += ["", f"**{axis.title}**, against {axis.finest.label}", "", *_head("setting")]
        lines += [_line(run.label, run, axis.finest, default) for run in axis.runs]
    lines += ["", f"**Whole settings**, against {CONVERGED.label}", "", *_head("setting")]
    lines += [_line(f"{words}: {run.label}", run, CONVERGED, default) for words, run in TOTALS.items()]
    lines += ["", CAVEAT]
    lines += [
        "",
        f"The converged run takes {real_time_factor(CONVERGED) / default:.0f} times as long as the first default.",
    ]
    return "\n".join(lines) + "\n"


def real_time_factor(setting: Setting, runs: int = 1) -> float:
    """Wall time of the steps over simulated time; noisy on a shared machine.

    Args:
        setting: Setting to run.
        runs: Number of runs, of which the fastest counts; one means the run of the errors.
    """
    again = [simulate.__wrapped__("default", *setting.overrides) for _ in range(runs - 1)]
    return min(float(run.facts["real_time_factor"]) for run in (setting.run, *again))


def _head(first: str) -> tuple[str, str]:
    columns = (first, "rms", "p99", "largest", "landing", "time")
    return "| " + " | ".join(columns) + " |", "|" + " --- |" * len(columns)


def _line(name: str, run: Setting, finest: Setting, default: float) -> str:
    errors = [error(run, finest, direction) for direction in DIRECTIONS]
    cells = [" / ".join(f"{getattr(e, norm):.2f}" for e in errors) for norm in ("rms", "p99", "largest", "landing")]
    return "| " + " | ".join([name, *cells, f"{real_time_factor(run) / default:.1f}"]) + " |"


def write(folder: Path = REPORT) -> None:
    """Write the figures and ``convergence.md``.

    Args:
        folder: Folder of the files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    draw(folder)
    (folder / "convergence.md").write_text(table(), encoding="utf-8")
