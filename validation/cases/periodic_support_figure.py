"""Figure of the report: seat force under a moving load, exact and by the engine, and its convergence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from validation.cases.constant_load import history
from validation.cases.periodic_support import (
    LADDER,
    deflection_error,
    exact_force,
    force_error,
    mean_square,
    sines,
    splines,
)  # fmt: skip

__all__ = ["draw"]


def draw(path: Path) -> None:
    """Seat force at 350 km/h, exact and by the engine, and the errors over the number of modes.

    Args:
        path: PNG to write.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.2), width_ratios=(1.5, 1.0), layout="constrained")
    x = np.linspace(-2.2, 2.2, 8801)
    left.plot(x, 1e-3 * exact_force(350, x), color="0.2", linewidth=2.2, label="exact (Floquet)")
    for modes, colour in ((72, "#D55E00"), (288, "#0072B2")):
        ours = history(350, sines(modes))
        near = np.abs(ours.x) <= 2.2
        left.plot(ours.x[near], 1e-3 * ours.force[near], color=colour, linewidth=0.9, label=f"{modes} modes in 36 m")
    pad, ours = np.linspace(-2.2, 2.2, 1101), history(350, splines(1.0))
    left.plot(pad, 1e-3 * exact_force(350, pad, 0.15) - 5.0, color="0.2", linewidth=2.2)
    near = np.abs(ours.x) <= 2.2
    left.plot(
        ours.x[near],
        1e-3 * ours.force[near] - 5.0,
        color="#009E73",
        linewidth=0.9,
        label="splines, seats of 0.15 m, less 5 kN",
    )
    left.set(xlabel="load ahead of the seat [m]", ylabel="seat force [kN]", xlim=(-2.2, 2.2))
    left.set_title("70 kN at 350 km/h on springs every 0.65 m", loc="left", fontsize=10)
    measures: tuple[tuple[str, str, str, Callable[[int], float]], ...] = (
        ("deflection under the load", "#009E73", "o", lambda n: deflection_error(350, sines(n))[0]),
        (
            "seat force, load 62 mm or more from a seat",
            "#0072B2",
            "s",
            lambda n: force_error(350, sines(n), apart=0.0625),
        ),
        ("seat force anywhere, jumps included", "#D55E00", "x", lambda n: force_error(350, sines(n), apart=0.0)),
        ("seat force, root mean square within 1 m", "#CC79A7", "^", lambda n: mean_square(350, sines(n))),
    )
    for label, colour, marker, measure in measures:
        right.loglog(LADDER, [measure(n) for n in LADDER], color=colour, marker=marker, label=label)
    right.axhline(0.5, color="0.4", linewidth=0.8, linestyle="--")
    right.set_xticks(LADDER, [str(n) for n in LADDER])
    right.minorticks_off()
    right.set_yticks((0.2, 0.5, 1.0, 2.0, 5.0), ("0.2", "0.5", "1", "2", "5"))
    right.set(xlabel="modes in 36 m", ylabel="difference over the peak [%]")
    for axis in (left, right):
        axis.grid(color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=160)
    plt.close(figure)
