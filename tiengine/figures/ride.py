"""Accelerations of the leading vehicle's floor over the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiengine.figures.curve import Curve
from tiengine.figures.style import LEFT, RIGHT, in_style, limit_line, new_figure
from tiengine.indices.en14363 import ACCELERATION_LIMIT, BAND
from tiengine.indices.filters import band_pass
from tiengine.indices.ride import Ride
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tiengine.result import Result

__all__ = ["draw"]


@in_style
def draw(result: Result, train: int = 0) -> Figure:
    """Lateral and vertical acceleration over either bogie, left of the centre line, 0.4 to 10 Hz, behind the run-in.

    The points are those of the indices (:mod:`tiengine.indices.ride`). Holds one value a sample of the bodies in
    memory, as the indices do.

    Args:
        result: An open file.
        train: Number of the train.

    Raises:
        InputError: No such train, no accelerations or forces in the file, or too short a run.
    """
    source = Train(result, train)
    try:
        ride = Ride(result, train, source.scenario)
        points = [point for point in ride.floor(0) if point.over_bogie and point.name.endswith("left")]
    except InputError as error:
        raise AbsentError(str(error)) from None
    if ride.duration * BAND[0] < 1.0:
        raise AbsentError(
            f"{result.name}: {ride.duration:.3g} s behind the run-in are shorter than a period of {BAND[0]:g} Hz; set a"
            " longer train.distance and run again"
        )
    figure = new_figure(10.0, f"{source.caption}: floor of the leading vehicle, {BAND[0]:g} to {BAND[1]:g} Hz")
    axes = figure.subplots(2, 1, sharex=True)
    x = ride.body_position
    for panel, direction in zip(axes, ("lateral", "vertical"), strict=True):
        for point, look in zip(points, (LEFT, RIGHT), strict=False):
            curve = Curve(float(x[0]), float(x[-1]))
            series = band_pass(getattr(point, direction), ride.body_interval, *BAND)
            curve.add(x, ride.behind_run_in(series))
            panel.plot(*curve.line, label=point.name, rasterized=curve.is_thinned, **look._asdict())
        for sign in (1.0, -1.0):
            limit_line(panel, sign * ACCELERATION_LIMIT, "EN 14363", below=sign > 0.0)
        panel.set(title=f"{direction.capitalize()} acceleration", ylabel="[m/s²]")
        panel.margins(x=0.0)
    axes[1].set_xlabel("chainage of the first vehicle's centre [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
