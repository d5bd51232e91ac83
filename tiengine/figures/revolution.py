"""Force of wheels out of round over their rotation angle, with their out-of-roundness (polar)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK
from tiengine.figures.style import LEFT, new_figure
from tiengine.indices.revolutions import Revolutions, revolutions, shaped_wheels

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

    from tiengine.indices.train_record import Train

__all__ = ["draw"]

MOST = 2  # wheels in a figure
RING, SWING = 0.55, 0.2  # radius of the nominal circle and swing of the deviation, of the largest force


@of_one_train
def draw(train: Train) -> Figure:
    """Draw mean, smallest and largest normal force over the angle of the first wheels out of round.

    Args:
        train: The train.

    Raises:
        AbsentError: All wheels are round, or the file lacks their force.
    """
    tables, wheels = shaped_wheels(train)
    shown = [revolutions(train, w, side, tables) for w, side in wheels[:MOST]]
    figure = new_figure(11.0, f"{train.caption}: normal force over the angle of the wheel, run-in left out")
    grid = figure.add_gridspec(1, len(shown))
    for i, wheel in enumerate(shown):
        _polar(figure.add_subplot(grid[0, i], projection="polar"), wheel)  # type: ignore[arg-type]
    return figure


def _polar(axes: PolarAxes, wheel: Revolutions) -> None:
    """One wheel: forces in kN outward, its tread as a line around a circle, much enlarged."""
    top = float(np.nanmax(wheel.largest)) / 1e3
    closed = np.append(wheel.angle, wheel.angle[0] + 2.0 * np.pi)
    low, high, mean = (np.append(v, v[0]) / 1e3 for v in (wheel.smallest, wheel.largest, wheel.mean))
    axes.fill_between(closed, low, high, color="0.8", label="smallest to largest")
    axes.plot(closed, mean, color=LEFT.color, linewidth=1.0, label="mean")
    size = float(np.ptp(wheel.deviation)) or 1.0
    tread = RING * top + SWING * top * (wheel.deviation - wheel.deviation.mean()) / size
    axes.plot(closed, np.append(tread, tread[0]), color=BLACK, linewidth=0.9, label=f"tread, {1e3 * size:.3g} mm")
    axes.set_title(wheel.name)
    axes.set_rlabel_position(100.0)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.1, -0.15))
