"""Wheel forces over many trains: median and band of 5 to 95 % in stretches of the chainage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.curve import Band
from tiengine.figures.palette import BLUE, GREY, SKY, VERMILION
from tiengine.figures.style import in_style, new_figure
from tiengine.indices.train_record import AbsentError, Samples, Train
from tiengine.parameters.arrays import Reals
from tiengine.result_files.reader import COMPLETE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tiengine.result import Result

__all__ = ["draw", "draw_bands", "stretch_extremes", "stretches"]

STRETCH = 2.0  # m, length of a stretch
MOST_STRETCHES = 300  # longer runs have longer stretches
LEAST_TRAINS = 3


@in_style
def draw(result: Result, train: int | None = None) -> Figure:
    """Draw extremes of Q and |Y| of the leading wheelset in stretches of the chainage, over all trains.

    In trains of several vehicles these are extremes of all wheelsets: those that pass a stretch during the run.

    Trains that did not complete their run are left out.

    Args:
        result: An open file.
        train: Not used: the figure shows all trains.

    Raises:
        AbsentError: Fewer than three trains completed their run, or the file holds no wheel forces.
    """
    complete = [i for i in range(result.trains) if result.status(i) == COMPLETE]
    if len(complete) < LEAST_TRAINS:
        raise AbsentError(
            f"{result.name}: {len(complete)} complete train(s); bands over trains need {LEAST_TRAINS}: set"
            " ensemble.size and run again"
        )
    trains = [Train(result, i) for i in complete]
    runs = [each.samples("wheel", "vertical_force", "lateral_force") for each in trains]
    several = len(trains[0].scenario.parts.vehicles) > 1
    lead = float(runs[0].group["wheelset_offset"][0])
    begin, end = (pick(run.chainage_range[i] for run in runs) + lead for i, pick in ((0, min), (1, max)))
    bins = stretches(begin, end)
    extremes = np.stack([stretch_extremes(run, begin, end, bins, several=several) for run in runs])
    whose = "all wheelsets" if several else "leading wheelset"
    return draw_bands(extremes, begin, end, complete, f"{result.name.rpartition('/')[2]}: {whose}")


def stretches(begin: float, end: float) -> int:
    """Number of stretches between two chainages [m]."""
    return int(np.clip(np.ceil((end - begin) / STRETCH), 1, MOST_STRETCHES))


@in_style
def draw_bands(extremes: Reals, begin: float, end: float, trains: Sequence[int], title: str) -> Figure:
    """Draw the extremes of many trains.

    Args:
        extremes: Largest Q, smallest Q, largest |Y| [kN] of every train, shape (trains, 3, bins).
        begin: Chainage of the first stretch [m].
        end: Chainage of the end of the last one [m].
        trains: Numbers of the trains.
        title: Small text above the figure.
    """
    bins = extremes.shape[2]
    x: Reals = begin + (end - begin) / bins * (np.arange(bins, dtype=np.float64) + 0.5)
    figure = new_figure(15.0, f"{title} of {len(trains)} trains, stretches of {(end - begin) / bins:.3g} m")
    axes = figure.subplots(3, 1, sharex=True)
    titles = ("Largest Q in the stretch", "Smallest Q in the stretch", "Largest |Y| in the stretch")
    for i, (panel, heading) in enumerate(zip(axes, titles, strict=True)):
        farthest = trains[_plot(panel, x, extremes[:, i])]
        panel.set(title=f"{heading}; farthest from the median: train {farthest}", ylabel="[kN]")
        panel.margins(x=0.0)
    axes[2].set_xlabel("chainage of the wheelset [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def stretch_extremes(run: Samples, begin: float, end: float, bins: int, *, several: bool) -> Reals:
    """Largest Q, smallest Q and largest |Y| [kN], shape (3, bins); NaN in stretches that the train did not reach.

    Args:
        run: Vertical and lateral forces of the wheels of one train.
        begin: Chainage of the first stretch [m].
        end: Chainage of the end of the last one [m].
        bins: Number of stretches.
        several: Whether all wheelsets count, not the leading one alone.
    """
    offsets = run.group["wheelset_offset"][:]
    Q, Y = Band(begin, end, bins), Band(begin, end, bins)
    for position, channels in run.slices():
        for w, offset in enumerate(offsets if several else offsets[:1]):
            x = position + offset
            ahead = x >= begin  # wheels behind come from the smooth track under the train at the start
            Q.add(x[ahead], 1e-3 * channels["vertical_force"][ahead, w])
            Y.add(x[ahead], 1e-3 * np.abs(channels["lateral_force"][ahead, w]))
    return np.stack([Q.high, Q.low, Y.high])


def _plot(axes: Axes, x: Reals, values: Reals) -> int:
    """Draw values of shape (trains, bins); return the index of the train farthest from the median."""
    reached = ~np.isnan(values).all(axis=0)
    x, values = x[reached], values[:, reached]
    low, middle, high = np.nanpercentile(values, (5.0, 50.0, 95.0), axis=0)
    axes.fill_between(
        x,
        np.nanmin(values, axis=0),
        np.nanmax(values, axis=0),
        color=GREY,
        alpha=0.6,
        linewidth=0.0,
        label="all trains",
    )
    axes.fill_between(x, low, high, color=SKY, alpha=0.6, linewidth=0.0, label="5 to 95 %")
    axes.plot(x, middle, color=BLUE, label="median")
    worst = int(np.nanargmax(np.nanmax(np.abs(values - middle), axis=1)))
    axes.plot(x, values[worst], color=VERMILION, linewidth=0.7, linestyle="--", label="farthest from the median")
    return worst
