"""Comparison of two results over the same chainages: wheel forces overlaid, and their difference."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.curve import Band, Curve, bins_for
from tiengine.figures.palette import BLACK, GREY
from tiengine.figures.style import LEFT, RIGHT, in_style, new_figure
from tiengine.indices.train_record import Samples, Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tiengine.result import Result

__all__ = ["draw"]

CHANNELS = {"vertical_force": "Vertical", "lateral_force": "Lateral"}
LEAST_OVERLAP = 1.0  # m of chainage that both runs cover
OFFSET_TOLERANCE = 1e-3  # m between wheelsets of the two trains


@in_style
def draw(result: Result, other: Result, train: int = 0) -> Figure:
    """Draw the forces of the leading left wheel in both files, and the difference (second minus first) of all wheels.

    Values are compared at equal chainages: those of the second file are interpolated linearly to the chainages of the
    first.

    Args:
        result: The first file.
        other: The second file.
        train: Number of the train in both files.

    Raises:
        InputError: The trains have different wheelsets, the runs no chainages in common, or a file lacks the forces.
    """
    a, b = Train(result, train), Train(other, train)
    first, second = a.samples("wheel", *CHANNELS), b.samples("wheel", *CHANNELS)
    begin, end, offset = _common_range(first, second, f"{result.name} and {other.name}")
    differences = {name: _Difference(begin, end, offset, bins_for(len(first))) for name in CHANNELS}
    for x, values, others in _side_by_side(first, second, begin, end):
        for name, difference in differences.items():
            difference.add(x, 1e-3 * values[name], 1e-3 * others[name])
    figure = new_figure(16.0, f"{a.caption} (a) and {b.caption} (b)")
    axes = figure.subplots(4, 1, sharex=True)
    for (name, title), (above, below) in zip(CHANNELS.items(), (axes[:2], axes[2:]), strict=True):
        differences[name].plot(above, below)
        above.set_title(f"{title} force, leading left wheel")
    axes[3].set_xlabel("chainage of the wheelset [m]")
    handles = [handle for panel in axes[:2] for handle in panel.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _common_range(first: Samples, second: Samples, names: str) -> tuple[float, float, Reals]:
    """Chainages of the first vehicle's centre [m] between which both ran, and the wheelset offsets [m]."""
    offsets: list[Reals] = [samples.group["wheelset_offset"][:] for samples in (first, second)]
    if offsets[0].shape != offsets[1].shape or np.abs(offsets[0] - offsets[1]).max() > OFFSET_TOLERANCE:
        counts = " and ".join(str(len(each)) for each in offsets)
        raise InputError(
            f"{names} cannot be compared: {counts} wheelsets, or wheelsets at different places in the train"
        )
    ranges = first.chainage_range, second.chainage_range
    begin, end = max(low for low, _ in ranges), min(high for _, high in ranges)
    if end - begin < LEAST_OVERLAP:
        both = " and ".join(f"{low:.1f} to {high:.1f} m" for low, high in ranges)
        raise InputError(f"{names} cannot be compared: chainages {both} overlap by less than {LEAST_OVERLAP:g} m")
    return begin, end, offsets[0]


def _side_by_side(
    first: Samples, second: Samples, begin: float, end: float
) -> Iterator[tuple[Reals, dict[str, Reals], dict[str, Reals]]]:
    """Yield chainages [m], channels of the first file, and those of the second at these chainages, slice by slice."""
    for x, a in first.slices(first.at(begin), first.at(end + 1e-9)):
        around = slice(max(second.at(float(x[0])) - 1, 0), min(second.at(float(x[-1])) + 1, len(second)))
        x_second, b = second.read(around.start, around.stop)
        yield x, a, {name: _interpolated(x, x_second, values) for name, values in b.items()}


def _interpolated(x: Reals, known_x: Reals, values: Reals) -> Reals:
    """Values of shape (len(known_x), ...) at the chainages x [m], by linear interpolation."""
    columns = [np.interp(x, known_x, column) for column in values.reshape(len(known_x), -1).T]
    return np.stack(columns, axis=1).reshape(len(x), *values.shape[1:])


class _Difference:
    """Difference of one channel of two files [kN], gathered slice by slice."""

    def __init__(self, begin: float, end: float, offset: Reals, bins: int) -> None:
        self._offset = offset
        lead = begin + float(offset[0]), end + float(offset[0])
        self._curves = [Curve(*lead) for _ in range(3)]
        self._band = Band(begin + float(offset.min()), end + float(offset.max()), bins)
        self._count, self._largest, self._peak = 0, 0.0, 0.0
        self._sum: Reals = np.zeros((len(offset), 2))
        self._squares, self._square_differences = np.zeros_like(self._sum), 0.0

    def add(self, x: Reals, a: Reals, b: Reals) -> None:
        """Add forces of both files [kN] at the chainages x [m], shape (n,); forces have shape (n, wheelsets, 2)."""
        difference = b - a
        for curve, values in zip(self._curves, (a, b, difference), strict=True):
            curve.add(x + self._offset[0], values[:, 0, 0])
        for w, offset in enumerate(self._offset):
            self._band.add(x + offset, difference[:, w])
        self._count += len(x)
        self._largest = max(self._largest, float(np.abs(difference).max()))
        self._peak = max(self._peak, float(np.abs(a).max()))
        self._sum += a.sum(axis=0)
        self._squares += (a**2).sum(axis=0)
        self._square_differences += float((difference**2).sum())

    @property
    def summary(self) -> str:
        """Largest and rms difference over all wheels, in words."""
        variance = float((self._squares / self._count - (self._sum / self._count) ** 2).mean())
        rms = float(np.sqrt(self._square_differences / self._count / self._sum.size))
        part = f" ({100.0 * self._largest / self._peak:.2g} % of a's largest)" if self._peak else ""
        spread = f" ({100.0 * rms / np.sqrt(variance):.2g} % of a's standard deviation)" if variance > 0.0 else ""
        return f"largest {self._largest:.3g} kN{part}, rms {rms:.3g} kN{spread}"

    def plot(self, above: Axes, below: Axes) -> None:
        """Draw both files into the upper panel, the difference into the lower one."""
        for curve, look, label in zip(self._curves, (LEFT, RIGHT), ("a", "b"), strict=False):
            above.plot(*curve.line, label=label, rasterized=curve.is_thinned, **look._asdict())
        band = self._band
        below.fill_between(
            band.x, band.low, band.high, color=GREY, linewidth=0.0, rasterized=True, label="b - a, all wheels"
        )
        line = self._curves[2]
        below.plot(
            *line.line, color=BLACK, linewidth=0.7, rasterized=line.is_thinned, label="b - a, leading left wheel"
        )
        below.set_title(f"b - a: {self.summary}")
        for panel in (above, below):
            panel.margins(x=0.0)
            panel.set_ylabel("[kN]")
