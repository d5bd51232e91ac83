"""Alignment of the line under a run: curvature, cant, gradient, cant deficiency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK, ORANGE
from tiengine.figures.style import new_figure
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.conventions import GRAVITY
from tiengine.track.alignment import CANT_BASE, Alignment

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw", "line_of", "plot_beneath"]

POINTS = 2000


@of_one_train
def draw(train: Train) -> Figure:
    """Draw the line over the chainage of the first vehicle's centre, and the cant deficiency at the train's speed.

    Args:
        train: The train.

    Raises:
        AbsentError: The line is straight and level.
    """
    line = line_of(train)
    scenario = train.scenario
    begin = scenario.rear + scenario.centre_in_window
    x = np.linspace(begin, begin + scenario.train.distance, POINTS)
    V = np.array([scenario.train.speed.at(float(here))[0] for here in x])
    deficiency = 1e3 * CANT_BASE / GRAVITY * line.lateral_acceleration(x, V, GRAVITY)
    figure = new_figure(13.0, f"{train.caption}: alignment")
    axes = figure.subplots(4, 1, sharex=True)
    panels = (
        (1e3 * line.lines[0](x), "[1/km]", "Curvature, positive to the right"),
        (1e3 * line.cant(x), "[mm]", "Cant over 1.5 m, positive where the left rail is raised"),
        (deficiency, "[mm]", "Cant deficiency, positive towards the left rail"),
        (1e3 * line.lines[2](x), "[‰]", "Gradient, positive uphill"),
    )
    for panel, (values, unit, title) in zip(axes, panels, strict=True):
        panel.plot(x, values, color=BLACK)
        panel.set(title=title, ylabel=unit)
        panel.margins(x=0.0)
    axes[-1].set_xlabel("chainage of the first vehicle's centre [m]")
    return figure


def line_of(train: Train) -> Alignment:
    """Line of a train's scenario.

    Raises:
        AbsentError: It is straight and level.
    """
    line = train.scenario.track.line
    if line is None:
        raise AbsentError(f"{train.result.name}: the line is straight and level; set track.alignment and run again")
    return line


def plot_beneath(axes: Axes, line: Alignment, begin: float, end: float) -> None:
    """Draw curvature and cant between two chainages into a panel beneath others.

    Args:
        axes: The panel.
        line: The line.
        begin: First chainage [m].
        end: Last chainage [m].
    """
    x = np.linspace(begin, end, POINTS)
    axes.plot(x, 1e3 * line.lines[0](x), color=BLACK, label="curvature")
    axes.set(title="Curvature (left scale) and cant (right scale)", ylabel="[1/km]")
    other = axes.twinx()
    other.plot(x, 1e3 * line.cant(x), color=ORANGE, linestyle="--", label="cant")
    other.grid(visible=False)
    other.set_ylabel("[mm]")
    own, others = axes.get_legend_handles_labels(), other.get_legend_handles_labels()
    axes.legend(own[0] + others[0], own[1] + others[1], loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
