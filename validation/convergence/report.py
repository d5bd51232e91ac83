"""Figures and tables of the convergence study: ``python -m validation convergence``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from validation.convergence.study import (
    AXES,
    CONVERGED,
    COST,
    DEFAULT,
    DIRECTIONS,
    OLD_DEFAULT,
    PAPER,
    PATH,
    QUANTITIES,
    TOTALS,
    Axis,
    Setting,
    error,
    extremes,
)
from validation.frame.runs import simulate

__all__ = ["draw", "draw_cost", "real_time_factor", "table", "write"]

REPORT = Path(__file__).parents[1] / "report"
COLOURS = {"vertical": "#0072B2", "lateral": "#D55E00"}  # Okabe-Ito palette, distinct for colour-blind readers
KINDS = {"splines": "#0072B2", "sines": "#D55E00"}
MARKS = {"rms": "o", "p99": "s", "largest": "^"}
NORMS = {
    "rms": "rms over standard deviation",
    "p99": "exceeded in 1 % of the time, over peak",
    "largest": "largest over peak, wheels on the rails",
}
NUMBERS: dict[str, tuple[str, Callable[[Setting], float]]] = {
    "dt": ("time step [s]", lambda s: s.dt),
    "knots": ("refinement of the knots", lambda s: s.density),
    "sines": ("sines per metre and field [1/m]", lambda s: s.density),
    "mesh": ("elements of a slab", lambda s: float(s.mesh[0] * s.mesh[1])),
    "window": ("length of the window [m]", lambda s: s.window),
    "seat": ("length of a seat [m]", lambda s: s.seat),
}
"""Label of an axis, and its value of a setting."""
DEFAULTS = {name: number(DEFAULT) for name, (_, number) in NUMBERS.items() if name != "sines"}


def draw(folder: Path) -> list[Path]:
    """Draw one figure for each axis, ``convergence_<axis>.png``.

    Args:
        folder: Folder of the files.

    Returns:
        The files.
    """
    plt = _pyplot()
    files = []
    for name, axis in AXES.items():
        figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.2), sharey=True, layout="constrained")
        for panel, direction in zip(panels, DIRECTIONS, strict=True):
            _draw_errors(panel, name, axis, direction)
        panels[0].set_ylabel("difference [%]" if name == "seat" else "error [%]")
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


def _pyplot() -> Any:
    """Matplotlib without a display; imported late, since the tables do not need it."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def _draw_errors(panel: Any, name: str, axis: Axis, direction: str) -> None:
    """Draw the errors of one force over the values of an axis; without correction dashed if both are there."""
    label, number = NUMBERS[name]
    both = len({run.truncation for run in axis.runs}) > 1
    for truncation in ("none", "local"):
        runs = [run for run in axis.runs if run.truncation == truncation]
        dashed = both and truncation == "local"
        for norm, words in NORMS.items() if runs else ():
            panel.plot(
                [number(run) for run in runs], [getattr(error(run, axis.finest, direction), norm) for run in runs],
                "--" if dashed else "-", marker=MARKS[norm], color=COLOURS[direction], markersize=5, linewidth=1.1,
                label=None if dashed else words, markerfacecolor="white" if dashed else None,
            )  # fmt: skip
    panel.axhline(1.0, color="0.3", linewidth=0.8, linestyle=":")
    if name in DEFAULTS:
        panel.axvline(DEFAULTS[name], color="0.75", linewidth=0.8)
        panel.annotate(
            "default", (DEFAULTS[name], 0.02), xycoords=("data", "axes fraction"), xytext=(3, 0),
            textcoords="offset points", rotation=90, fontsize=7, color="0.35", va="bottom",
        )  # fmt: skip
    panel.set_xscale("log" if name in ("dt", "knots", "sines", "mesh") else "linear")
    ticks = {number(run): run for run in axis.runs}
    panel.set_xticks(sorted(ticks), [_tick(name, ticks[x], x) for x in sorted(ticks)])
    panel.minorticks_off()
    _error_axis(panel)
    panel.set_xlabel(label)
    panel.set_title(f"{direction} wheel force", fontsize=10, loc="left")


def _error_axis(panel: Any) -> None:
    """Logarithmic axis of errors in per cent, grid and frame."""
    panel.set_yscale("log")
    panel.set_yticks([0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0], ["0.01", "0.03", "0.1", "0.3", "1", "3", "10"])
    panel.set_ylim(0.007, 12.0)
    panel.grid(color="0.92")
    panel.spines[["top", "right"]].set_visible(False)


def _tick(name: str, run: Setting, value: float) -> str:
    return f"{run.mesh[0]} x {run.mesh[1]}" if name == "mesh" else f"{value:.3g}"


def draw_cost(path: Path) -> None:
    """Draw the error of splines and of sines over the wall time of their steps.

    Args:
        path: PNG to write.
    """
    plt = _pyplot()
    figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.0), sharey=True, layout="constrained")
    unit = real_time_factor(DEFAULT, runs=3)
    for panel, direction in zip(panels, DIRECTIONS, strict=True):
        for kind, runs in COST.items():
            time = [real_time_factor(run) / unit for run in runs]
            for norm in ("p99", "largest"):
                errors = [getattr(error(run, AXES["knots"].finest, direction), norm) for run in runs]
                panel.loglog(time, errors, marker=MARKS[norm], color=KINDS[kind], label=f"{kind}, {NORMS[norm]}")
            for run, x in zip(runs, time, strict=True):
                y = error(run, AXES["knots"].finest, direction).p99
                panel.annotate(f"{run.density:.3g}", (x, y), xytext=(4, -9), textcoords="offset points", fontsize=7)
        _error_axis(panel)
        panel.set_xlabel("wall time of the steps over the default's")
        panel.set_title(f"{direction} wheel force", fontsize=10, loc="left")
    panels[0].set_ylabel("error of trial functions and step [%]")
    panels[1].legend(frameon=False, fontsize=8)
    figure.suptitle(
        "Numbers: refinement of the knots, sines per metre; 2e-4 s, seats of 0.15 m", x=0.01, ha="left", fontsize=10
    )
    figure.savefig(path, dpi=160)
    plt.close(figure)


def table() -> str:
    """Markdown page: errors of every axis and of whole settings; how forces have moved from the old default."""
    default = real_time_factor(DEFAULT, runs=3)
    lines = [
        "# Convergence",
        "",
        "Errors in % of the peak (rms: of the standard deviation), vertical / lateral; *largest* while all wheels",
        "are on the rails, *landing* with everything included; see the head of `validation/convergence/study.py`.",
        f"*time*: wall time of the steps over that of the default ({default:.2f} s per simulated second here,",
        "the fastest of three; if other programs were running, factors of two and more are noise).",
    ]
    for name, axis in AXES.items():
        lines += ["", f"**{axis.title}**, against {axis.finest.label}", ""]
        if name == "seat":
            lines += ["A property of the track, not of the numerics: how much it matters.", ""]
        lines += [*_head(), *(_line(run.label, run, axis.finest, default) for run in axis.runs)]
    lines += ["", f"**Whole settings**, against {CONVERGED.label}", "", *_head()]
    lines += [_line(f"{words}: {run.label}", run, CONVERGED, default) for words, run in TOTALS.items()]
    lines += ["", "**Error against cost**", "", "![error against cost](convergence_cost.png)", "", *_moved()]
    return "\n".join(lines) + "\n"


def _moved() -> list[str]:
    """How N, Q and Y have moved from the old default to the new one, change by change, and those of the paper's."""
    header = "| | " + " | ".join(f"{name}: standard deviation, largest [kN]" for name in QUANTITIES.values())
    lines = [
        "**How forces have moved**",
        "",
        "From the old default to the new one, one change a line; then the distance between neighbours, in % of the",
        "peak (largest with the wheels on the rails / exceeded in 1 % of the time).",
        "",
        f"{header} | N to the line above | Q | Y |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    above: Setting | None = None
    for words, run in {**PATH, "60 sines in 36 m, points, no correction (`paper`)": PAPER}.items():
        if run is PAPER:
            above = DEFAULT
        values = (" , ".join(f"{1e-3 * x:.2f}" for x in extremes(run, quantity)) for quantity in QUANTITIES)
        moved = ["" if above is None else _moved_by(run, above, quantity) for quantity in QUANTITIES]
        lines.append(f"| {words} | " + " | ".join([*values, *moved]) + " |")
        above = run
    total = " | ".join(_moved_by(DEFAULT, OLD_DEFAULT, quantity) for quantity in QUANTITIES)
    lines += [f"| old default to new, in all | | | | {total} |"]
    return [
        *lines,
        "",
        "A point damper that passes under a point wheel makes its force jump by c V P / (kappa G A), 1.4 kN, at every",
        "seat; over 0.15 m the jump is spread, which no trial functions could follow before.",
        "`paper` keeps the paper's rails: 60 sines in 36 m, point seats, no correction; it is unchanged, and its last",
        "line tells how far these rails are from the default's on the same track.",
    ]


def _moved_by(run: Setting, from_run: Setting, quantity: str) -> str:
    found = error(run, from_run, quantity)
    return f"{found.largest:.2f} / {found.p99:.2f}"


def real_time_factor(setting: Setting, runs: int = 1) -> float:
    """Wall time of the steps over simulated time; noisy on a shared machine.

    Args:
        setting: Setting to run.
        runs: Number of runs, of which the fastest counts; one means the run of the errors.
    """
    again = [simulate.__wrapped__("default", *setting.overrides) for _ in range(runs - 1)]
    return min(float(run.facts["real_time_factor"]) for run in (setting.run, *again))


def _head() -> tuple[str, str]:
    columns = ("setting", "rms", "p99", "largest", "landing", "time")
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
    (folder / "convergence.md").write_text(table(), encoding="utf-8")
    draw(folder)
    draw_cost(folder / "convergence_cost.png")
