"""Accelerations of the leading vehicle's floor over the chainage."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiengine.figures.curve import Curve
from tiengine.figures.one_train import of_one_train
from tiengine.figures.style import LEFT, RIGHT, limit_line, new_figure
from tiengine.indices.en14363 import ACCELERATION_LIMIT, BAND
from tiengine.indices.filters import band_pass
from tiengine.indices.ride import Ride
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


@of_one_train
def draw(train: Train) -> Figure:
    """Draw lateral and vertical acceleration over both bogies, left of the centre line, 0.4 to 10 Hz, after the run-in.

    The floor points are those of the indices (:mod:`tiengine.indices.ride`). Unlike other figures this one reads whole
    series into memory.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no accelerations or no wheel forces, or the run is too short.
    """
    try:
        ride = Ride(train.result, train.number, train.scenario)
        points = [point for point in ride.floor(0) if point.over_bogie and point.name.endswith("left")]
    except InputError as error:
        raise AbsentError(str(error)) from None
    if ride.duration * BAND[0] < 1.0:
        raise AbsentError(
            f"{train.result.name}: {ride.duration:.3g} s after the run-in are shorter than a period of"
            f" {BAND[0]:g} Hz; set a longer train.distance and run again"
        )
    figure = new_figure(10.0, f"{train.caption}: floor of the leading vehicle, {BAND[0]:g} to {BAND[1]:g} Hz")
    axes = figure.subplots(2, 1, sharex=True)
    x = ride.body_position
    for panel, direction in zip(axes, ("lateral", "vertical"), strict=True):
        for point, look in zip(points, (LEFT, RIGHT), strict=False):
            curve = Curve(float(x[0]), float(x[-1]))
            series = band_pass(getattr(point, direction), ride.body_interval, *BAND)
            curve.add(x, ride.after_run_in(series))
            panel.plot(*curve.line, label=point.name, rasterized=curve.is_thinned, **look._asdict())
        for sign in (1.0, -1.0):
            limit_line(panel, sign * ACCELERATION_LIMIT, "EN 14363", below=sign > 0.0)
        panel.set(title=f"{direction.capitalize()} acceleration", ylabel="[m/s²]")
        panel.margins(x=0.0)
    axes[1].set_xlabel("chainage of the first vehicle's centre [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
