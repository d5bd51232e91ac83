"""Accelerations of the leading vehicle's floor over the chainage."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiengine.figures.curve import Curve
from tiengine.figures.one_train import of_one_train
from tiengine.figures.style import LEFT, RIGHT, limit_line, new_figure
from tiengine.indices.en14363 import ACCELERATION_LIMITS, BAND
from tiengine.indices.filters import band_pass, band_pass_settling
from tiengine.indices.recorded_ride import RecordedRide
from tiengine.indices.ride import Direction
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


@of_one_train
def draw(train: Train) -> Figure:
    """Draw lateral and vertical acceleration over both bogies, left of the centre line, 0.4 to 10 Hz, after the run-in.

    The floor points are those of the indices (:mod:`tiengine.indices.recorded_ride`), over the first and the last
    running gear. Unlike other figures this one reads whole series into memory.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no accelerations or no wheel forces, or the run is too short.
    """
    try:
        ride = RecordedRide(train.result, train.number, train.scenario)
        points = [point for point in ride.floor(0) if point.over_bogie and point.name.endswith("left")]
        points = points[:1] + points[1:][-1:]
    except InputError as error:
        raise AbsentError(str(error)) from None
    times, settling = ride.body_times, band_pass_settling(*BAND)
    if times.duration(settling) * BAND[0] < 1.0:
        raise AbsentError(
            f"{train.result.name}: {times.duration(settling):.3g} s without run-in and {settling:g} s at either end are"
            f" shorter than a period of {BAND[0]:g} Hz; set a longer train.distance and run again"
        )
    figure = new_figure(10.0, f"{train.caption}: floor of the leading vehicle, {BAND[0]:g} to {BAND[1]:g} Hz")
    axes = figure.subplots(2, 1, sharex=True)
    used = times.used(settling)
    x = times.position[used]
    limit = ACCELERATION_LIMITS.get(ride.vehicle_classes[0])
    directions: tuple[Direction, ...] = ("lateral", "vertical")
    for panel, direction in zip(axes, directions, strict=True):
        for point, look in zip(points, (LEFT, RIGHT), strict=False):
            curve = Curve(float(x[0]), float(x[-1]))
            curve.add(x, band_pass(point.acceleration[direction], times.interval, *BAND)[used])
            panel.plot(*curve.line, label=point.name, rasterized=curve.is_thinned, **look._asdict())
        for sign in (1.0, -1.0):
            if limit is not None:
                limit_line(panel, sign * limit, "EN 14363", below=sign > 0.0)
        panel.set(title=f"{direction.capitalize()} acceleration", ylabel="[m/s²]")
        panel.margins(x=0.0)
    axes[1].set_xlabel("chainage of the first vehicle's centre [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
