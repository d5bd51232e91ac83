"""Deflection of rails and slabs around the moving train."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import Normalize

from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK, SKY
from tiengine.figures.style import LEFT, RIGHT, new_figure
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw", "largest_by_stretch"]

MOST_ROWS = 400  # of a picture
MOST_LARGE_MARKS = 12  # wheelsets; the marks of longer trains would touch each other
SLICE = 200  # snapshots in memory at a time
COLOURS = "cividis"  # monotonic lightness: readable in grey and with colour vision deficiency


@of_one_train
def draw(train: Train) -> Figure:
    """Draw the deflection of rail and slab around the train, and pictures of it over the train's chainage.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds fewer than two snapshots of the deflection.
    """
    group = train.group("deflection", "output.deflection_interval")
    if len(group["position"]) < 2:
        raise AbsentError(
            f"{train.result.name}: {len(group['position'])} snapshot(s) of the deflection; set a shorter"
            " output.deflection_interval and run again"
        )
    offset: Reals = group["offset"][:]
    wheels = train.scenario.parts.wheelset_positions
    figure = new_figure(19.0, f"{train.caption}: deflection around the train, down positive")
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
            size = 3.0 if len(wheels) <= MOST_LARGE_MARKS else 1.5
            panel.plot(wheels, np.ones(len(wheels)), "v", color=BLACK, markersize=size, clip_on=False,
                       transform=panel.get_xaxis_transform())  # fmt: skip
            panel.margins(x=0.0)
    axes[0, 1].sharey(axes[0, 0])
    axes[0, 0].invert_yaxis()
    axes[0, 0].set_ylabel("[mm]")
    axes[0, 0].legend(loc="lower left", ncols=2)
    for panel in axes[1:, 0]:
        panel.set_ylabel("chainage of the train [m]")
    return figure


def largest_by_stretch(group: Any, body: str, rows: int = MOST_ROWS) -> tuple[Reals, Reals]:
    """Reduce snapshots to the rows of a picture: the largest deflection in each stretch of the train's chainage.

    Args:
        group: ``deflection`` of a train.
        body: ``"rail"`` or ``"slab"``.
        rows: Number of rows, at most; fewer snapshots are returned as they are.

    Returns:
        Edges of the rows [m], shape (n + 1,), and deflections [m], shape (n, 2, points), NaN over joints of slabs.
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
    """Draw rows of one side [mm], shape (n, points)."""
    middle = 0.5 * (offset[1:] + offset[:-1])
    columns = np.concatenate([offset[:1], middle, offset[-1:]])
    axes.grid(visible=False)
    return axes.pcolormesh(columns, edges, values, cmap=COLOURS, norm=scale, rasterized=True)


def _profile(axes: Axes, offset: Reals, values: Reals, body: str) -> None:
    """Draw median and band of rows of one side [mm], shape (n, points)."""
    defined = ~np.isnan(values).all(axis=0)
    low, median, high = np.nanpercentile(values[:, defined], (5.0, 50.0, 95.0), axis=0)
    look = LEFT if body == "rail" else RIGHT
    axes.fill_between(offset[defined], low, high, color=SKY if body == "rail" else "0.8", alpha=0.6, linewidth=0.0)
    axes.plot(offset[defined], median, label=body, **look._asdict())
