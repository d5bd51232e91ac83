"""Power spectral densities of wheel forces and accelerations, with the frequencies that spacings impose.

Anything spaced by d excites at the passing frequency V/d: seats, slabs and, seen from the rail, the wheelsets of a
bogie, bogies and vehicles. P2 is the resonance of :mod:`tiengine.indices.p2_resonance`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy import signal

from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK, BLUE, GREEN, ORANGE
from tiengine.figures.style import LEFT, RIGHT, Look, new_figure, plain
from tiengine.indices.p2_resonance import p2_of
from tiengine.indices.train_record import SLICE, AbsentError, Samples, Train
from tiengine.parameters.arrays import Reals
from tiengine.scenario.contact_settings import contact_settings
from tiengine.vehicle.running_gear import cars, running_gears

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw", "passing_frequencies", "welch"]

LONGEST_SEGMENT = 1.0  # s: resolution of 1 Hz
LEAST_SEGMENTS = 4  # end to end; seven with their overlaps
LEAST_DURATION = 0.4  # s
HIGHEST = 1000.0  # Hz
Y, Z = 0, 1


@of_one_train
def draw(train: Train) -> Figure:
    """Draw densities of Q and Y, mean over all wheels, and of the accelerations of the bodies, mean over the vehicles.

    Of several vehicles, bands show the range over the wheelsets and over the vehicles. Vehicles that the run leaves too
    little time after their run-in are left out.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no wheel forces, or the run after the run-in is too short.
    """
    wheels = train.samples("wheel", "vertical_force", "lateral_force")
    shown, segment = _vehicles(train, wheels)
    several = len(train.scenario.parts.vehicles) > 1
    figure = new_figure(14.0, f"{train.caption}: Welch's method, Hann windows of {segment:.3g} s, run-in left out")
    above, below = figure.subplots(2, 1, sharex=True)
    whose = f"vehicles 1 to {len(shown)}, bands: range of the wheelsets" if len(shown) > 1 else "the leading vehicle"
    found = [welch(wheels, begin, segment, wheelsets) for begin, wheelsets in shown]
    for look, name, label in ((LEFT, "vertical_force", "vertical, Q"), (RIGHT, "lateral_force", "lateral, Y")):
        S = np.concatenate([densities[name].mean(axis=2) for _, densities in found], axis=1)
        _plot(above, found[0][0], S, look, label, band=len(shown) > 1)
    above.set(ylabel="density [N²/Hz]", title=f"Wheel forces, mean over all wheels{f' of {whose}' if several else ''}")
    _accelerations(below, train, segment, len(shown))
    top = min(HIGHEST, 0.5 / wheels.interval)
    above.set_xlim(1.0 / segment, top)
    largest = max(above.dataLim.y1, 1e-30)
    above.set_ylim(1e-12 * largest, 3.0 * largest)  # room for the labels
    below.set_xlabel("frequency [Hz]")
    below.xaxis.set_major_formatter("{x:g}")
    marks = passing_frequencies(train)
    for panel in (above, below):
        _mark(panel, marks, labelled=panel is above, limits=(1.0 / segment, top))
        if panel.get_legend_handles_labels()[0]:
            panel.legend(loc="upper right" if panel is above else "lower left")
    return figure


def welch(samples: Samples, begin: int, segment: float, columns: slice | None = None) -> tuple[Reals, dict[str, Reals]]:
    """Estimate one-sided densities by Welch's method, with Hann windows that overlap by half, slice by slice.

    Args:
        samples: The channels.
        begin: Index of the first sample used.
        segment: Length of a window [s].
        columns: Wheelsets or bodies of the channels; all if None.

    Returns:
        Frequencies [Hz], shape (n,), and densities [unit^2/Hz] by channel, shape (n, ...).
    """
    size = round(segment / samples.interval)
    step = size - size // 2
    windows = (len(samples) - begin - size) // step + 1
    at_once = max(SLICE // step, 1)
    total: dict[str, Reals] = {}
    frequency = np.empty(0)
    for first in range(0, windows, at_once):
        count = min(at_once, windows - first)
        start = begin + first * step
        _, channels = samples.read(start, start + (count - 1) * step + size, columns)
        for name, values in channels.items():
            frequency, S = signal.welch(values, 1.0 / samples.interval, nperseg=size, axis=0)
            total[name] = total.get(name, 0.0) + count / windows * S
    return frequency, total


def passing_frequencies(train: Train) -> dict[str, tuple[float, float]]:
    """Compute lowest and highest passing frequencies, and P2 [Hz], by name.

    Args:
        train: The train; its scenario gives all spacings and speeds.
    """
    scenario, parts = train.scenario, train.scenario.parts
    axles, gears = parts.vehicles[0].axle_positions, running_gears(parts.vehicles[0])
    distances = {"seats": parts.slab.fastening_pitch, "slabs": parts.slab.pitch}
    if len(axles) > 1:
        distances["wheelsets"] = float(axles[0] - axles[1])
    if 1 < len(gears) < len(axles):
        distances["bogies"] = gears[0].centre - gears[1].centre
    if len(parts.vehicles) > 1:
        distances["vehicles"] = float(parts.centres[0] - parts.centres[1])
    first, last = scenario.rear + scenario.centre_in_window, scenario.train.distance
    speeds = [scenario.train.speed.at(x)[0] for x in np.linspace(first, first + last, 50)]
    found = {name: (min(speeds) / d, max(speeds) / d) for name, d in distances.items()}
    found["2 x seats"] = tuple(2.0 * f for f in found["seats"])  # type: ignore[assignment]
    p2 = p2_of(parts, contact_settings(scenario, train.model))
    return {**found, "P2": (p2, p2)}


def _vehicles(train: Train, samples: Samples) -> tuple[list[tuple[int, slice]], float]:
    """First sample and wheelsets of every vehicle that covers enough time after its run-in, and the window [s]."""
    vehicle = train.model.wheelset_vehicle
    found, shortest = [], 0.0
    for number in range(vehicle[-1] + 1):
        wheelsets = np.flatnonzero(vehicle == number)
        begin = samples.after(train.scenario.output.run_in + float(train.wheelset_lag[wheelsets[0]]))
        duration = (len(samples) - begin) * samples.interval
        if duration < LEAST_DURATION:
            break
        found.append((begin, slice(wheelsets[0], wheelsets[-1] + 1)))
        shortest = duration
    if not found:
        raise AbsentError(
            f"{train.result.name}: {duration:.3g} s after the run-in are too short for a spectrum, {LEAST_DURATION} s"
            " are needed; set a longer train.distance or a shorter output.run_in and run again"
        )
    return found, min(LONGEST_SEGMENT, shortest / LEAST_SEGMENTS)


def _accelerations(axes: Axes, train: Train, segment: float, vehicles: int) -> None:
    """Draw cars, frames and wheelsets of the first vehicles, or the reason why there are no accelerations."""
    whose = f"mean over vehicles 1 to {vehicles}, bands: their range" if vehicles > 1 else "leading vehicle"
    axes.set(ylabel="density [(m/s²)²/Hz]", title=f"Accelerations, {whose}")
    try:
        bodies = train.samples("body", "acceleration")
    except AbsentError as absent:
        axes.text(0.5, 0.5, plain(str(absent)), transform=axes.transAxes, ha="center", va="center", wrap=True)
        return
    names = list(bodies.group["body"].asstr()[:])
    looks = {
        "car, vertical": (Look(BLUE, "-"), 0, Z),
        "car, lateral": (Look(ORANGE, "--"), 0, Y),
        "bogie frames, vertical": (Look(GREEN, "-."), 1, Z),
        "wheelsets, vertical": (Look(BLACK, ":"), 2, Z),
    }
    means: dict[str, list[Reals]] = {}
    frequency = np.empty(0)
    for number in range(vehicles):
        groups = _bodies(train, number, names)
        rows = [row for group in groups for row in group]
        if not rows:
            continue
        first = min(rows)
        lag = float(train.wheelset_lag[np.searchsorted(train.model.wheelset_vehicle, number)])
        begin = bodies.after(train.scenario.output.run_in + lag)
        frequency, densities = welch(bodies, begin, segment, slice(first, max(rows) + 1))
        for label, (_, group, motion) in looks.items():
            if groups[group]:
                among = [row - first for row in groups[group]]
                means.setdefault(label, []).append(densities["acceleration"][:, among, motion].mean(axis=1))
    for label, found in means.items():
        _plot(axes, frequency, np.stack(found, axis=1), looks[label][0], label, band=vehicles > 1)


def _bodies(train: Train, vehicle: int, names: Sequence[str]) -> tuple[list[int], list[int], list[int]]:
    """Rows of a vehicle's cars, other suspended bodies and wheelsets among the recorded bodies."""
    vehicles = train.scenario.parts.vehicles
    prefix = f"v{vehicle + 1} " if len(vehicles) > 1 else ""
    suspended = [body.name for body in vehicles[vehicle].body if not body.wheelset]
    car_names = [car.body.name for car in cars(vehicles[vehicle])]
    wanted = (
        [f"{prefix}{name}" for name in car_names],
        [f"{prefix}{name}" for name in suspended if name not in car_names],
        [f"wheelset {i + 1}" for i in np.flatnonzero(train.model.wheelset_vehicle == vehicle)],
    )
    return tuple([names.index(name) for name in group if name in names] for group in wanted)  # type: ignore[return-value]


def _plot(axes: Axes, frequency: Reals, densities: Reals, look: Look, label: str, *, band: bool) -> None:
    """Draw the mean of densities, shape (n, k), and a band for their range.

    The value at 0 Hz is left out, and so are densities of zero, which a logarithmic axis cannot show.
    """
    mean = densities.mean(axis=1)
    if not mean[1:].any():
        return
    axes.loglog(frequency[1:], mean[1:], label=label, **look._asdict())
    if band:
        low, high = densities.min(axis=1), densities.max(axis=1)
        axes.fill_between(frequency[1:], low[1:], high[1:], color=look.color, alpha=0.25, linewidth=0.0)


def _mark(axes: Axes, marks: dict[str, tuple[float, float]], *, labelled: bool, limits: tuple[float, float]) -> None:
    """Shade passing frequencies within the limits [Hz]."""
    for name, (low, high) in marks.items():
        if not limits[0] < low <= high < limits[1]:
            continue
        axes.axvspan(low, high, color="0.5", linewidth=0.8, alpha=0.6, zorder=0)
        if labelled:
            axes.annotate(
                f"{name} {low:.3g}{f' to {high:.3g}' if high > 1.001 * low else ''} Hz",
                (low, 0.0),
                (-1, 3),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                rotation=90,
                ha="right",
                va="bottom",
                fontsize=6.5,
                color="0.25",
            )
