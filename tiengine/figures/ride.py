"""Accelerations of the floor over the chainage: of the only vehicle, or of the worst one of a train."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.curve import Band, Curve, bins_for
from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import GREY
from tiengine.figures.style import LEFT, RIGHT, limit_line, new_figure
from tiengine.indices.en14363 import ACCELERATION_LIMITS, BAND
from tiengine.indices.filters import band_pass, band_pass_settling
from tiengine.indices.recorded_ride import RecordedRide
from tiengine.indices.ride import Direction
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw"]

DIRECTIONS: tuple[Direction, ...] = ("lateral", "vertical")


@of_one_train
def draw(train: Train) -> Figure:
    """Draw lateral and vertical acceleration over both bogies, left of the centre line, 0.4 to 10 Hz, after the run-in.

    The floor points are those of the indices (:mod:`tiengine.indices.recorded_ride`), over the first and the last
    running gear. Of several vehicles the worst one is drawn in each panel, and a band for all of them. Unlike other
    figures this one reads whole series into memory, those of one vehicle at a time.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no accelerations or no wheel forces, or the run is too short.
    """
    try:
        ride = RecordedRide(train.result, train.number, train.scenario)
        ride.floor(0)
    except InputError as error:
        raise AbsentError(str(error)) from None
    settling = band_pass_settling(*BAND)
    times = ride.acceleration_times(0)
    if times.duration(settling) * BAND[0] < 1.0:
        raise AbsentError(
            f"{train.result.name}: {times.duration(settling):.3g} s without run-in and {settling:g} s at either end are"
            f" shorter than a period of {BAND[0]:g} Hz; set a longer train.distance and run again"
        )
    vehicles = len(ride.vehicle_classes)
    x = times.position[times.used(settling)]
    limits = min(_first(ride, vehicle) for vehicle in range(vehicles)), float(x[-1])
    panels = {direction: _Panel(*limits, bins_for(len(x))) for direction in DIRECTIONS}
    for vehicle in range(vehicles):
        _add_vehicle(panels, ride, vehicle)
    whose = f"all {vehicles} vehicles" if vehicles > 1 else "the leading vehicle"
    figure = new_figure(10.0, f"{train.caption}: floor of {whose}, {BAND[0]:g} to {BAND[1]:g} Hz")
    axes = figure.subplots(2, 1, sharex=True)
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        found = panels[direction]
        found.plot(panel, several=vehicles > 1)
        limit = ACCELERATION_LIMITS.get(ride.vehicle_classes[found.worst])
        for sign in (1.0, -1.0):
            if limit is not None:
                limit_line(panel, sign * limit, "EN 14363", below=sign > 0.0)
        which = f"; vehicle {found.worst + 1}" if vehicles > 1 else ""
        panel.set(title=f"{direction.capitalize()} acceleration{which}", ylabel="[m/s²]")
        panel.margins(x=0.0)
    axes[1].set_xlabel(f"chainage of the {'' if vehicles > 1 else 'first '}vehicle's centre [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


class _Panel:
    """Accelerations of one direction: those of the worst vehicle so far, and the band of all.

    Attributes:
        worst: Vehicle with the largest magnitude, from 0.
    """

    def __init__(self, begin: float, end: float, bins: int) -> None:
        self._band, self._limits = Band(begin, end, bins), (begin, end)
        self._curves: dict[str, Curve] = {}
        self._largest = -1.0
        self.worst = 0

    def add(self, vehicle: int, x: Reals, series: dict[str, Reals]) -> None:
        """Add a vehicle's series by the names of its floor points, shape (n,), at its chainages [m]."""
        for values in series.values():
            self._band.add(x, values)
        largest = max(float(np.abs(values).max()) for values in series.values())
        if largest > self._largest:
            self._largest, self.worst = largest, vehicle
            self._curves = {name: Curve(*self._limits) for name in series}
            for name, curve in self._curves.items():
                curve.add(x, series[name])

    def plot(self, axes: Axes, *, several: bool) -> None:
        if several:
            band = self._band
            axes.fill_between(
                band.x, band.low, band.high, color=GREY, linewidth=0.0, label="all vehicles", rasterized=True
            )
        for (name, curve), look in zip(self._curves.items(), (LEFT, RIGHT), strict=False):
            label = f"worst vehicle, {name}" if several else name
            axes.plot(*curve.line, label=label, rasterized=curve.is_thinned, **look._asdict())


def _first(ride: RecordedRide, vehicle: int) -> float:
    """First chainage of a vehicle that is drawn [m]; infinite if none is."""
    times = ride.acceleration_times(vehicle)
    position = times.position[times.used(band_pass_settling(*BAND))]
    return float(position[0]) - ride.lag(vehicle) if len(position) else np.inf


def _add_vehicle(panels: dict[Direction, _Panel], ride: RecordedRide, vehicle: int) -> None:
    """Filter a vehicle's floor points; a vehicle that covers less than a period after its run-in is left out."""
    times, settling = ride.acceleration_times(vehicle), band_pass_settling(*BAND)
    if times.duration(settling) * BAND[0] < 1.0:
        return
    points = [point for point in ride.floor(vehicle) if point.over_bogie and point.name.endswith("left")]
    used, behind = times.used(settling), ride.lag(vehicle)
    for direction, panel in panels.items():
        series = {
            point.name: band_pass(point.acceleration[direction], times.interval, *BAND)[used]
            for point in points[:1] + points[1:][-1:]
        }
        panel.add(vehicle, times.position[used] - behind, series)
