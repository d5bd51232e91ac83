"""Time histories of the gauges: motion or force at a place of rail, slab or fastening as the train passes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from tiengine.figures.curve import Curve
from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLUE, VERMILION
from tiengine.figures.style import Look, new_figure, plain
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw"]

MOST = 8  # gauges in a figure
LATERAL, VERTICAL = Look(VERMILION, "--"), Look(BLUE, "-")
MOTIONS = {"displacement": (1e3, "[mm]"), "velocity": (1e3, "[mm/s]"), "acceleration": (1.0, "[m/s²]")}
FORCES = {"vertical_force": (1e-3, "[kN]", VERTICAL), "lateral_force": (1e-3, "[kN]", LATERAL)}


@of_one_train
def draw(train: Train) -> Figure:
    """Draw one row per gauge: motion of rail or slab, forces of a fastening, opening of a gap; passing wheelsets grey.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no gauges, or the train reached none of them.
    """
    all_gauges = train.group("gauges", "[[gauges]]")
    gauges = {name: group for name, group in all_gauges.items() if len(group["time"]) > 1}
    if not gauges:
        raise AbsentError(f"{train.result.name}: the train reached none of its gauges: {', '.join(all_gauges)}")
    shown = list(gauges.items())[:MOST]
    passing = "passing vehicles" if train.model.wheelset_vehicle[-1] else "passing wheelsets"
    selection = f", {MOST} of {len(gauges)} gauges" if len(gauges) > MOST else ""
    figure = new_figure(1.5 + 4.2 * len(shown), f"{train.caption}: gauges{selection}; {passing} in grey")
    rows = figure.subfigures(len(shown), 1, squeeze=False)[:, 0]
    for row, (name, group) in zip(rows, shown, strict=True):
        row.suptitle(plain(_title(name, group)), x=0.01, ha="left", fontsize=8.0)
        axes = np.atleast_1d(row.subplots(1, 3 if "displacement" in group else 1 if "opening" in group else 2))
        _history(axes, group)
        for panel in axes:
            _mark_passings(panel, group, train)
            panel.margins(x=0.0)
            panel.set_xlabel("time [s]")
    figure.legend(
        handles=[Line2D([], [], label="vertical, down", **VERTICAL._asdict()),
                 Line2D([], [], label="lateral, right", **LATERAL._asdict())],
        loc="upper right", ncols=2,
    )  # fmt: skip
    return figure


def _title(name: str, group: Any) -> str:
    attributes = group.attrs
    where = f", {attributes['side']} side" if "side" in attributes else f", y = {attributes.get('y', 0.0):g} m"
    return f"{name}: {attributes['on']} at {attributes['chainage']:g} m{where}"


def _history(axes: NDArray[np.object_], group: Any) -> None:
    if "displacement" in group:
        for panel, (name, (scale, unit)) in zip(axes, MOTIONS.items(), strict=True):
            for column, look in ((1, VERTICAL), (0, LATERAL)):
                _plot(panel, group, scale * group[name][:, column].astype(np.float64), look)
            panel.set(title=name, ylabel=unit)
        return
    if "opening" in group:
        _plot(axes[0], group, 1e3 * group["opening"][:].astype(np.float64), VERTICAL)
        axes[0].set(title="opening between slab and bed", ylabel="[mm]")
        return
    for panel, (name, (scale, unit, look)) in zip(axes, FORCES.items(), strict=True):
        _plot(panel, group, scale * group[name][:].astype(np.float64), look)
        panel.set(title=f"{name.replace('_', ' ')} of the rail on the fastening", ylabel=unit)


def _plot(axes: Axes, group: Any, values: Reals, look: Look) -> None:
    time = group["time"][:]
    curve = Curve(float(time[0]), float(time[-1]))
    curve.add(time, values)
    axes.plot(*curve.line, rasterized=curve.is_thinned, **look._asdict())


def _mark_passings(axes: Axes, group: Any, train: Train) -> None:
    """Mark when wheelsets are over the gauge; of several vehicles, the time from the first to the last wheelset."""
    position: Reals = group["position"][:]
    centre: Reals = float(group.attrs["chainage"]) - train.scenario.parts.wheelset_positions
    vehicle = train.model.wheelset_vehicle
    passed = (centre > position[0]) & (centre < position[-1])
    times = np.interp(centre, position, group["time"][:])
    if not vehicle[-1]:
        for passing in times[passed]:
            axes.axvline(passing, color="0.75", linewidth=0.6, zorder=0)
        return
    for number in np.unique(vehicle[passed]):
        own = times[vehicle == number]
        axes.axvspan(own.min(), own.max(), color="0.92", linewidth=0.0, zorder=0)
