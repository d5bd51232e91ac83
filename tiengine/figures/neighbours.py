"""A defect and its neighbours, enlarged: load of each seat or slab, also relative to a sound one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tiengine.figures.palette import BLACK, ORANGE, PURPLE
from tiengine.figures.style import LEFT, RIGHT
from tiengine.indices.extremes import Extremes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_seats", "draw_slabs", "worst_defect"]

NEXT = 2  # neighbours on either side that are labelled with their ratio


def worst_defect(extremes: Extremes, name: str) -> NDArray[np.intp]:
    """Find the defect whose neighbours carry the largest load.

    Args:
        extremes: Seats or slabs, with one defect at least.
        name: The channel of the load.

    Returns:
        Rows of the defect, shape (n,).
    """
    return max(extremes.defects, key=lambda row: float(extremes[name][extremes.around(row)].max()))


def draw_seats(axes: Axes, seats: Extremes) -> None:
    """Draw the largest force of every seat around the worst group of failed ones, and its ratio to the sound median."""
    name = "largest_vertical_force"
    row = worst_defect(seats, name)
    near, median = seats.around(row), seats.sound_median(name)
    for side, look, marker, label in ((0, LEFT, "o", "left"), (1, RIGHT, "s", "right")):
        face = look.color if side == 0 else "white"
        axes.plot(
            seats.index[near], 1e-3 * seats[name][near, side], marker=marker, markersize=4, markerfacecolor=face,
            linewidth=0.7, label=label, **look._asdict(),
        )  # fmt: skip
    _span(axes, seats.index[row], ORANGE, "")
    _sound_lines(axes, seats, name)
    _annotate(axes, seats, row, name)
    _ratio_axis(axes, median * 1e-3)
    first, last = seats.index[row[[0, -1]]]
    which = f"seat {first}" if first == last else f"seats {first} to {last}"
    axes.set(xlabel="seat", ylabel="largest force [kN]", title=f"Load on the neighbours of {which}{_selection(seats)}")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]), top=1.1 * axes.get_ylim()[1])


def draw_slabs(axes: Axes, slabs: Extremes) -> None:
    """Draw the largest pressure under every slab around the worst void."""
    name = "largest_pressure"
    row = worst_defect(slabs, name)
    near, median = slabs.around(row), slabs.sound_median(name)
    values = 1e-3 * slabs[name][near]
    axes.bar(slabs.index[near], values, width=0.7, facecolor="0.75", edgecolor=BLACK, linewidth=0.6)
    _span(axes, slabs.index[row], PURPLE, "////")
    _sound_lines(axes, slabs, name)
    _annotate(axes, slabs, row, name)
    _ratio_axis(axes, median * 1e-3)
    which = f"slab {slabs.index[row[0]]}" + (f" to {slabs.index[row[-1]]}" if len(row) > 1 else "")
    axes.set(xlabel="slab", ylabel="largest pressure [kPa]", title=f"Mortar around {which}{_selection(slabs)}")
    axes.set_ylim(top=1.1 * axes.get_ylim()[1])
    axes.grid(visible=False, axis="x")


def _selection(extremes: Extremes) -> str:
    """Number of defects that this one was selected from, in words; empty if it is the only one."""
    count = len(extremes.defects)
    return f", worst of {count} defects" if count > 1 else ""


def _span(axes: Axes, index: NDArray[np.int64], colour: str, hatch: str) -> None:
    axes.axvspan(
        float(index[0]) - 0.5, float(index[-1]) + 0.5, color=colour, alpha=0.4, hatch=hatch, linewidth=0.0, zorder=0
    )


def _sound_lines(axes: Axes, extremes: Extremes, name: str) -> None:
    """Draw the median of sound seats or slabs, and their band of 5 to 95 %, which the irregularity alone causes."""
    low, high = extremes.sound_band(name)
    axes.axhspan(1e-3 * low, 1e-3 * high, color="0.9", linewidth=0.0, zorder=-1, label="sound, 5 to 95 %")
    axes.axhline(1e-3 * extremes.sound_median(name), color=BLACK, linewidth=0.7, linestyle=":", label="sound, median")


def _annotate(axes: Axes, extremes: Extremes, row: NDArray[np.intp], name: str) -> None:
    """Label the nearest neighbours above the band of sound ones with their ratio to the sound median."""
    high, median = extremes.sound_band(name)[1], extremes.sound_median(name)
    nearest = range(max(row[0] - NEXT, 0), min(row[-1] + NEXT + 1, len(extremes.index)))
    for i in nearest:
        value = float(np.max(extremes[name][i]))
        if value > high:
            axes.annotate(
                f"{value / median:.2f}", (float(extremes.index[i]), 1e-3 * value), (0, 4), textcoords="offset points",
                ha="center", fontsize=7.0, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.8},
            )  # fmt: skip


def _ratio_axis(axes: Axes, median: float) -> None:
    """Add a second scale at the right: the ratio to the median [unit of the axis]."""
    if median > 0.0:
        right = axes.secondary_yaxis("right", functions=(_scale(1.0 / median), _scale(median)))
        right.set_ylabel("ratio to sound median")


def _scale(factor: float) -> Callable[[Any], Any]:
    """Multiplication by a factor, as a function for matplotlib."""
    return lambda values: factor * np.asarray(values)
