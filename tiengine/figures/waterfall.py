"""Deflection of rails and slabs around the train while it moves on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import Normalize

from tiengine.figures.palette import BLACK, SKY
from tiengine.figures.style import LEFT, RIGHT, in_style, new_figure
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tiengine.result import Result

__all__ = ["draw", "largest_by_stretch"]

ROWS = 400  # a picture's, at most
SLICE = 200  # snapshots in memory at a time
COLOURS = "cividis"  # one ramp of lightness: reads in grey and for all eyes


@in_style
def draw(result: Result, train: int = 0) -> Figure:
    """Profiles of rail and slab around the train, and pictures of them over the train's way.

    Args:
        result: An open file.
        train: Number of the train.

    Raises:
        InputError: No such train, or no snapshots of the deflection in the file.
    """
    source = Train(result, train)
    group = source.group("deflection", "output.deflection_interval")
    if len(group["position"]) < 2:
        raise AbsentError(
            f"{result.name}: {len(group['position'])} snapshot(s) of the deflection; set a shorter"
            " output.deflection_interval and run again"
        )
    offset: Reals = group["offset"][:]
    wheels = source.scenario.parts.wheelset_positions
    figure = new_figure(19.0, f"{source.caption}: deflection around the train, down positive")
    axes = figure.subplots(3, 2, sharex=True, height_ratios=(0.75, 1.0, 1.0))
    for body, row in (("rail", 1), ("slab", 2)):
        edges, values = largest_by_stretch(group, body)
        scale = Normalize(*np.nanpercentile(1e3 * values, (0.5, 99.9)))
        for side in range(2):
            picture = _picture(axes[row, side], offset, edges, 1e3 * values[:, side], scale)
            axes[row, side].set_title(f"{body.capitalize()} under the {SIDES[side]} wheels")
            _profile(axes[0, side], offset, 1e3 * values[:, side], body)
        figure.colorbar(picture, ax=axes[row, :], label=f"{body} [mm]", pad=0.01, aspect=30)
    for side in range(2):
        axes[0, side].set(title=f"{SIDES[side].capitalize()}: median, band of 5 to 95 %")
        axes[2, side].set_xlabel("ahead of the first vehicle's centre [m]")
        for panel in axes[:, side]:
            panel.plot(wheels, np.ones(len(wheels)), "v", color=BLACK, markersize=3, clip_on=False,
                       transform=panel.get_xaxis_transform())  # fmt: skip
            panel.margins(x=0.0)
    axes[0, 1].sharey(axes[0, 0])
    axes[0, 0].invert_yaxis()
    axes[0, 0].set_ylabel("[mm]")
    axes[0, 0].legend(loc="lower left", ncols=2)
    for panel in axes[1:, 0]:
        panel.set_ylabel("chainage of the train [m]")
    return figure


def largest_by_stretch(group: Any, body: str, rows: int = ROWS) -> tuple[Reals, Reals]:
    """Snapshots, or where they are more than a picture has rows, the largest of each stretch of the way.

    Args:
        group: ``deflection`` of a train.
        body: ``"rail"`` or ``"slab"``.
        rows: Of the picture, at most.

    Returns:
        Edges of the rows [m], shape (n + 1,), and deflection [m], shape (n, 2, points), NaN over joints.
    """
    position: Reals = group["position"][:]
    count = len(position)
    starts = np.unique(np.linspace(0, count, min(count, rows) + 1).astype(np.intp))
    largest = np.full((len(starts) - 1, *group[body].shape[1:]), np.nan)
    for begin in range(0, count, SLICE):
        for i, snapshot in enumerate(group[body][begin : begin + SLICE].astype(np.float64), start=begin):
            row = int(np.searchsorted(starts, i, side="right")) - 1
            largest[row] = np.fmax(largest[row], snapshot)
    before = position[starts[1:-1]] - 0.5 * (position[starts[1:-1]] - position[starts[1:-1] - 1])
    return np.concatenate([position[:1], before, position[-1:]]), largest


def _picture(axes: Axes, offset: Reals, edges: Reals, values: Reals, scale: Normalize) -> Any:
    """Rows of one side, shape (n, points)."""
    middle = 0.5 * (offset[1:] + offset[:-1])
    columns = np.concatenate([offset[:1], middle, offset[-1:]])
    axes.grid(visible=False)
    return axes.pcolormesh(columns, edges, values, cmap=COLOURS, norm=scale, rasterized=True)


def _profile(axes: Axes, offset: Reals, values: Reals, body: str) -> None:
    seen = ~np.isnan(values).all(axis=0)
    low, median, high = np.nanpercentile(values[:, seen], (5.0, 50.0, 95.0), axis=0)
    look = LEFT if body == "rail" else RIGHT
    axes.fill_between(offset[seen], low, high, color=SKY if body == "rail" else "0.8", alpha=0.6, linewidth=0.0)
    axes.plot(offset[seen], median, label=body, **look._asdict())
