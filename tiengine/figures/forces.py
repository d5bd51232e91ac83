"""Wheel forces over the chainage, with static loads and the limits of the standards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tiengine.figures.curve import Band, Curve, bins_for
from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import GREY
from tiengine.figures.style import LEFT, RIGHT, Look, limit_line, new_figure
from tiengine.indices import en14363, gb5599
from tiengine.indices.filters import sliding_mean
from tiengine.indices.ride import FORCE_CUT_OFF, LEAST_RATE, UNLOADED
from tiengine.indices.train_record import AbsentError, Samples, Train
from tiengine.parameters.arrays import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw"]

MEAN = 2.0  # m, length of the standards' sliding means
OUTWARD = np.array([-1.0, 1.0])  # sign of the outward direction in y, left and right wheel


@of_one_train
def draw(train: Train) -> Figure:
    """Draw Q, Y, sum of Y and Y/Q of the leading wheelset over its chainage, and the range of all wheels behind them.

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
    axes = figure.subplots(4, 1, sharex=True)
    shown = _Forces(train, samples)
    shown.plot(axes)
    _limits(axes, train)
    _mark_run_in(axes, train, samples)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    axes[0].set(ylabel="Q [kN]", title="Vertical force of the wheel on the rail")
    axes[1].set(ylabel="Y [kN]", title="Lateral force of the wheel on the rail, right positive")
    axes[2].set(ylabel="ΣY [kN]", title="Lateral force of the wheelset, mean over 2 m")
    axes[3].set(ylabel="Y/Q [-]", title="Y over Q, outward positive, mean over 2 m")
    axes[3].set_xlabel("chainage of the wheelset [m]")
    return figure


class _Forces:
    """Curves of the leading wheelset and bands of all wheels, filled slice by slice."""

    def __init__(self, train: Train, samples: Samples) -> None:
        self._offset = samples.group["wheelset_offset"][:]
        begin, end = samples.chainage_range
        self._limits = (begin + float(self._offset.min()), end + float(self._offset.max()))
        self._static = train.static_loads
        self.bands = [Band(*self._limits, bins_for(len(samples))) for _ in range(2)]
        lead = (begin + float(self._offset[0]), end + float(self._offset[0]))
        self.curves = {name: [Curve(*lead), Curve(*lead)] for name in ("Q", "Y", "quotient")}
        self.axle = Curve(*lead)
        for position, raw in samples.slices():
            self._add_raw(position, raw["vertical_force"], raw["lateral_force"])
        for count, position, filtered in samples.low_passed(FORCE_CUT_OFF, ahead=MEAN):
            self._add_filtered(count, position, filtered["vertical_force"], filtered["lateral_force"])

    def _add_raw(self, position: Reals, Q: Reals, Y: Reals) -> None:
        for w, offset in enumerate(self._offset):
            for band, force in zip(self.bands, (Q, Y), strict=True):
                band.add(position + offset, 1e-3 * force[:, w])

    def _add_filtered(self, count: int, position: Reals, Q: Reals, Y: Reals) -> None:
        """Add filtered forces; the first ``count`` samples belong to the slice, the means also need those beyond."""
        x, Q, Y = position + self._offset[0], Q[:, 0], Y[:, 0]
        quotient = OUTWARD * Y / np.maximum(Q, UNLOADED * self._static[0])
        for side in range(2):
            self.curves["Q"][side].add(x[:count], 1e-3 * Q[:count, side])
            self.curves["Y"][side].add(x[:count], 1e-3 * Y[:count, side])
            if x[-1] - x[0] >= MEAN:
                self.curves["quotient"][side].add(*sliding_mean(x, quotient[:, side], MEAN))
        if x[-1] - x[0] >= MEAN:
            self.axle.add(*sliding_mean(x, 1e-3 * Y.sum(axis=1), MEAN))

    def plot(self, axes: NDArray[np.object_]) -> None:
        """Draw into the four panels."""
        for panel, band in zip(axes[:2], self.bands, strict=True):
            panel.fill_between(
                band.x, band.low, band.high, color=GREY, linewidth=0.0, label="all wheels, unfiltered", rasterized=True
            )
        for panel, name in zip((axes[0], axes[1], axes[3]), self.curves, strict=True):
            for curve, look, side in zip(self.curves[name], (LEFT, RIGHT), ("left", "right"), strict=True):
                _plot(panel, curve, look, f"leading wheelset {side}{', 20 Hz' if name != 'quotient' else ''}")
        _plot(axes[2], self.axle, LEFT, "leading wheelset")


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
    """Shade the run-in, which the indices leave out."""
    begin = samples.chainage_range[0] + float(samples.group["wheelset_offset"][0])
    run_in = train.scenario.output.run_in
    for panel in axes:
        panel.margins(x=0.0)
        if 0.0 < run_in < samples.distance:
            panel.axvspan(begin, begin + run_in, color="0.94", linewidth=0.0, zorder=0, label="run-in")
