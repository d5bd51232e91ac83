"""Wheel forces over the chainage, with static loads and the limits of the standards."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tiengine.figures.curve import Band, Curve, bins_for
from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK, GREY
from tiengine.figures.style import LEFT, RIGHT, Look, limit_line, new_figure
from tiengine.indices import en14363, gb5599
from tiengine.indices.filters import low_pass_settling, sliding_mean
from tiengine.indices.ride import FORCE_CUT_OFF, LEAST_RATE, UNLOADED
from tiengine.indices.train_record import AbsentError, Samples, Train
from tiengine.indices.wheel_extremes import first_samples
from tiengine.parameters.arrays import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw"]

MEAN = 2.0  # m, length of the standards' sliding means
OUTWARD = np.array([-1.0, 1.0])  # sign of the outward direction in y, left and right wheel
TITLES = {
    "Q": ("Q [kN]", "Vertical force of the wheel on the rail"),
    "Y": ("Y [kN]", "Lateral force of the wheel on the rail, right positive"),
    "axle": ("ΣY [kN]", "Lateral force of the wheelset, mean over 2 m"),
    "quotient": ("Y/Q [-]", "Y over Q, outward positive, mean over 2 m"),
}


@of_one_train
def draw(train: Train) -> Figure:
    """Draw Q, Y, sum of Y and Y/Q of a wheelset over its chainage, and the range of all wheels behind them.

    The wheelset is the leading one of a single vehicle; of several vehicles it is the worst one in each panel, and a
    second column shows the range of every wheelset by vehicle.

    Args:
        train: The train.

    Raises:
        AbsentError: The file lacks the wheel forces, or their sampling is too coarse.
    """
    samples = train.samples("wheel", "vertical_force", "lateral_force")
    if samples.interval * LEAST_RATE > 1.0 + 1e-9:
        raise AbsentError(
            f"{train.result.name}: wheel forces every {samples.interval:.4g} s are too coarse for the standards'"
            f" filters; set output.wheel_interval to {1.0 / LEAST_RATE:g} or less and run again"
        )
    figure = new_figure(17.5, f"{train.caption}: wheel forces")
    shown = _Forces(train, samples)
    vehicle = train.model.wheelset_vehicle
    widths = (3.0, 1.0) if vehicle[-1] else (1.0,)
    columns = figure.subplots(4, len(widths), sharex="col", sharey="row", squeeze=False, width_ratios=widths)
    axes = columns[:, 0]
    shown.plot(axes, vehicle)
    if vehicle[-1]:
        shown.plot_by_vehicle(columns[:, 1], vehicle)
    _limits(axes, train)
    _mark_run_in(axes, train, samples)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    axes[3].set_xlabel("chainage of the wheelset [m]")
    return figure


class _Forces:
    """Curves and ranges of all wheelsets and bands of all wheels, filled slice by slice."""

    def __init__(self, train: Train, samples: Samples) -> None:
        self._offset: Reals = samples.group["wheelset_offset"][:]
        count = len(self._offset)
        begin, end = samples.chainage_range
        limits = (begin + float(self._offset.min()), end + float(self._offset.max()))
        self._static = train.static_loads
        self.bands = [Band(*limits, bins_for(len(samples))) for _ in range(2)]
        position = samples.group["position"]
        settling = math.ceil(low_pass_settling(FORCE_CUT_OFF) / samples.interval)
        first, last = np.maximum(first_samples(train, samples), settling), max(len(samples) - 1 - settling, 0)
        none = (np.inf, -np.inf) if first.min() < last else (begin, end)
        self._counted = [(float(position[i]), float(position[last])) if i < last else none for i in map(int, first)]
        kept = count if train.model.wheelset_vehicle[-1] else 1
        sides = {"Q": 2, "Y": 2, "axle": 1, "quotient": 2}
        self.curves = {
            name: [[Curve(begin + x, end + x) for _ in range(n)] for x in map(float, self._offset[:kept])]
            for name, n in sides.items()
        }
        self.ranges = {name: np.tile([np.inf, -np.inf], (kept, 1)) for name in sides}
        for position, raw in samples.slices():
            for w, offset in enumerate(self._offset):
                for band, name in zip(self.bands, ("vertical_force", "lateral_force"), strict=True):
                    band.add(position + offset, 1e-3 * raw[name][:, w])
        for own, position, filtered in samples.low_passed(FORCE_CUT_OFF, ahead=MEAN):
            for w in range(kept):
                Q, Y = filtered["vertical_force"][:, w], filtered["lateral_force"][:, w]
                self._add(w, own, position + self._offset[w], Q, Y)

    def _add(self, w: int, count: int, x: Reals, Q: Reals, Y: Reals) -> None:
        """Add filtered forces; the first ``count`` samples belong to the slice, the means also need those beyond."""
        quotient = OUTWARD * Y / np.maximum(Q, UNLOADED * self._static[w])
        for side in range(2):
            self._append("Q", w, side, x[:count], 1e-3 * Q[:count, side])
            self._append("Y", w, side, x[:count], 1e-3 * Y[:count, side])
            if x[-1] - x[0] >= MEAN:
                self._append("quotient", w, side, *sliding_mean(x, quotient[:, side], MEAN))
        if x[-1] - x[0] >= MEAN:
            self._append("axle", w, 0, *sliding_mean(x, 1e-3 * Y.sum(axis=1), MEAN))

    def _append(self, name: str, w: int, side: int, x: Reals, values: Reals) -> None:
        self.curves[name][w][side].add(x, values)
        begin, end = self._counted[w]
        counted = values[(x >= begin + self._offset[w]) & (x <= end + self._offset[w])]
        if len(counted):
            low, high = self.ranges[name][w]
            self.ranges[name][w] = min(low, counted.min()), max(high, counted.max())

    def worst(self, name: str) -> int:
        """Wheelset with the largest magnitude after its run-in."""
        largest = np.abs(np.where(np.isfinite(self.ranges[name]), self.ranges[name], 0.0)).max(axis=1)
        return int(np.argmax(largest))

    def plot(self, axes: NDArray[np.object_], vehicle: NDArray[np.int32]) -> None:
        """Draw into the four panels."""
        for panel, band in zip(axes[:2], self.bands, strict=True):
            panel.fill_between(
                band.x, band.low, band.high, color=GREY, linewidth=0.0, label="all wheels, unfiltered", rasterized=True
            )
        which = "worst wheelset" if vehicle[-1] else "leading wheelset"
        for panel, (name, (ordinate, title)) in zip(axes, TITLES.items(), strict=True):
            w = self.worst(name)
            for curve, look, side in zip(self.curves[name][w], (LEFT, RIGHT), ("left", "right"), strict=False):
                filtered = ", 20 Hz" if name in ("Q", "Y") else ""
                _plot(panel, curve, look, which if name == "axle" else f"{which} {side}{filtered}")
            panel.set(
                ylabel=ordinate,
                title=title if vehicle[-1] == 0 else f"{title}; wheelset {w + 1}, vehicle {vehicle[w] + 1}",
            )

    def plot_by_vehicle(self, axes: NDArray[np.object_], vehicle: NDArray[np.int32]) -> None:
        """Draw the range of every wheelset after its run-in over the place of the wheelset in the train."""
        x = vehicle + 1 + 0.7 * (_rank(vehicle) - 0.5)
        for panel, (name, ranges) in zip(axes, self.ranges.items(), strict=True):
            low, high = np.where(np.isfinite(ranges), ranges, np.nan).T
            w = self.worst(name)
            for among, colour, width in ((slice(None), "0.45", 1.1), (slice(w, w + 1), BLACK, 2.2)):
                panel.vlines(x[among], low[among], high[among], color=colour, linewidth=width)
            panel.set_xlim(0.5, vehicle[-1] + 1.5)
            panel.set_title("range, by vehicle")
        axes[3].set_xlabel("vehicle")
        axes[3].xaxis.get_major_locator().set_params(integer=True)


def _rank(vehicle: NDArray[np.int32]) -> Reals:
    """Place of each wheelset in its vehicle, from 0 for the leading one to 1, shape (n_ws,)."""
    first = np.searchsorted(vehicle, vehicle)
    behind = np.arange(len(vehicle)) - first
    return behind / np.maximum(np.bincount(vehicle)[vehicle] - 1, 1)


def _plot(axes: Axes, curve: Curve, look: Look, label: str) -> None:
    alpha = 0.7 if curve.is_thinned else 1.0  # thinned curves fill their range and would hide each other
    axes.plot(*curve.line, label=label, rasterized=curve.is_thinned, alpha=alpha, **look._asdict())


def _limits(axes: NDArray[np.object_], train: Train) -> None:
    """Draw static load and limits of the leading wheelset."""
    static = 1e-3 * train.static_loads[0]
    speed = train.scenario.train.speed.fastest
    mean = float(static.mean())
    lowest = (1.0 - gb5599.unloading_limit(speed)) * mean
    limit_line(axes[0], en14363.wheel_force_limit(mean, speed), "EN 14363, largest Q", below=True)
    limit_line(axes[0], mean, "static load", left=True)
    limit_line(axes[0], lowest, f"GB/T 5599, unloading {gb5599.unloading_limit(speed):g} (means over 2 m)")
    axle = float(static.sum())
    vehicle_class = train.scenario.parts.vehicles[0].vehicle_class
    axle_limits = {
        "EN 14363": en14363.axle_force_limit(axle, vehicle_class),
        "GB/T 5599": gb5599.axle_force_limit(axle, vehicle_class),
    }
    same = gb5599.DERAILMENT_LIMITS.get(vehicle_class) == en14363.QUOTIENT_LIMIT
    quotient = "EN 14363, GB/T 5599" if same else "EN 14363"
    for sign in (1.0, -1.0):
        below = sign > 0.0
        for name, limit in axle_limits.items():
            if limit is not None:
                limit_line(axes[2], sign * limit, name, below=below == (name == "EN 14363"))
        limit_line(axes[3], sign * en14363.QUOTIENT_LIMIT, quotient, below=below)
    widest = 1.25 * max((limit for limit in axle_limits.values() if limit is not None), default=0.0)
    low, high = axes[2].get_ylim()
    axes[2].set_ylim(min(low, -widest), max(high, widest))  # room for the labels


def _mark_run_in(axes: NDArray[np.object_], train: Train, samples: Samples) -> None:
    """Shade the run-in, which the indices leave out; wheels behind the leading one reach it from smooth track."""
    begin, end = (chainage + float(samples.group["wheelset_offset"][0]) for chainage in samples.chainage_range)
    run_in = train.scenario.output.run_in
    for panel in axes:
        panel.set_xlim(begin, end)
        if 0.0 < run_in < samples.distance:
            panel.axvspan(begin, begin + run_in, color="0.94", linewidth=0.0, zorder=0, label="run-in")
