"""Extremes of every seat and slab over the chainage, with the neighbours of defects enlarged."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from tiengine.figures.curve import Curve
from tiengine.figures.neighbours import draw_seats, draw_slabs
from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK, ORANGE, PURPLE
from tiengine.figures.style import LEFT, RIGHT, Look, new_figure
from tiengine.indices.extremes import Extremes, read_extremes
from tiengine.indices.ground_under import ground_profile, rail_profile
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

__all__ = ["draw"]

KEY = "output.envelopes"
LOOKS = (LEFT, RIGHT)


@of_one_train
def draw(train: Train) -> Figure:
    """Draw forces of the rail on the fastenings, mortar pressure and slab moments; defects are marked and enlarged.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no envelopes, or the train reached no seat.
    """
    seats, slabs = read_extremes(train, "seats", KEY), read_extremes(train, "slabs", KEY)
    if not seats.reached.any():
        raise AbsentError(f"{train.result.name}: the train reached no seat: there are no envelopes to draw")
    enlarged = [(extremes, draw) for extremes, draw in ((seats, draw_seats), (slabs, draw_slabs)) if extremes.defects]
    shapes = list(_shapes(train))
    height = (20.0 if enlarged else 15.0) + 3.5 * len(shapes)
    figure = new_figure(height, f"{train.caption}: extremes of every seat and slab over the whole run")
    below: Figure | SubFigure = figure
    if enlarged:
        above, below = figure.subfigures(2, 1, height_ratios=(1.0, 2.4), squeeze=False)[:, 0]
        _enlarge(above, enlarged)
    lifts = "largest_opening" in slabs.values and bool(slabs["largest_opening"].any())
    axes = below.subplots((5 if lifts else 4) + len(shapes), 1, sharex=True)
    _vertical(axes[0], seats)
    _lateral(axes[1], seats)
    _pressure(axes[2], slabs)
    _moments(axes[3], slabs)
    if lifts:
        _openings(axes[4], slabs)
    for panel, draw_shape in zip(axes[5 if lifts else 4 :], shapes, strict=True):
        draw_shape(panel)
    for panel in axes:
        _mark(panel, seats, slabs)
        panel.margins(x=0.0)
    axes[-1].set_xlabel("chainage [m]")
    handles = dict(zip(*reversed(axes[0].get_legend_handles_labels()), strict=True))
    below.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3 if len(handles) > 5 else 5)
    return figure


def _enlarge(figure: SubFigure, enlarged: Sequence[tuple[Extremes, Callable[[Axes, Extremes], None]]]) -> None:
    """Draw the surroundings of the worst defect of seats, slabs or both."""
    widths = (2.2, 1.0)[: len(enlarged)]
    panels = np.atleast_1d(figure.subplots(1, len(enlarged), width_ratios=widths))
    for panel, (extremes, draw_defect) in zip(panels, enlarged, strict=True):
        draw_defect(panel, extremes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _line(axes: Axes, extremes: Extremes, values: Any, look: Look, scale: float, **style: Any) -> None:
    """Draw one channel of the seats or slabs that the train reached, over the chainage."""
    x = extremes.chainage[extremes.reached]
    curve = Curve(float(x[0]), float(x[-1]))
    curve.add(x, scale * np.asarray(values, np.float64)[extremes.reached])
    axes.plot(*curve.line, rasterized=curve.is_thinned, **look._asdict(), **style)


def _vertical(axes: Axes, seats: Extremes) -> None:
    for side, look in enumerate(LOOKS):
        _line(axes, seats, seats["largest_vertical_force"][:, side], look, 1e-3, label=SIDES[side])
        _line(axes, seats, seats["smallest_vertical_force"][:, side], look, 1e-3, linewidth=0.5)
    axes.axhline(1e-3 * seats.sound_median("largest_vertical_force"), color=BLACK, linewidth=0.7, linestyle=":",
                 label="median of sound seats")  # fmt: skip
    axes.set(ylabel="[kN]", title="Fastenings: largest vertical force; thin lines: smallest (negative: uplift)")


def _lateral(axes: Axes, seats: Extremes) -> None:
    for side, look in enumerate(LOOKS):
        for name in ("largest_lateral_force", "smallest_lateral_force"):
            _line(axes, seats, seats[name][:, side], look, 1e-3, linewidth=0.8 if name[0] == "l" else 0.5)
    axes.set(ylabel="[kN]", title="Fastenings: largest lateral force to the right; thin lines: to the left")


def _pressure(axes: Axes, slabs: Extremes) -> None:
    for name, look in (("largest_pressure", Look(BLACK, "-")), ("smallest_pressure", Look(BLACK, "--"))):
        _line(axes, slabs, slabs[name], look, 1e-3, drawstyle="steps-mid")
    axes.set(ylabel="[kPa]", title="Mortar: largest pressure; dashed: smallest; dead weight included")


def _moments(axes: Axes, slabs: Extremes) -> None:
    looks = {"x": Look("0.45", "-"), "y": Look(BLACK, "-")}
    for direction, look in looks.items():
        _line(axes, slabs, slabs[f"largest_moment_{direction}"], look, 1e-3, drawstyle="steps-mid")
        dashed = look._replace(linestyle="--")
        _line(axes, slabs, slabs[f"smallest_moment_{direction}"], dashed, 1e-3, drawstyle="steps-mid")
    title = "Slabs: largest bending moment; dashed: smallest; grey: along the track, black: across"
    axes.set(ylabel="[kN m/m]", title=title)


def _shapes(train: Train) -> Iterator[Callable[[Axes], None]]:
    """Functions that draw shapes of rails and displaced ground, where there are such and their files still exist."""
    for profile in (_rails, _ground):
        with suppress(AbsentError, InputError):
            yield profile(train)


def _rails(train: Train) -> Callable[[Axes], None]:
    x, heights = rail_profile(train)

    def draw_rails(axes: Axes) -> None:
        for side, look in enumerate(LOOKS):
            _shape(axes, x, heights[:, side], look)
        axes.set(ylabel="[mm]", title="Rails: shapes of their running surfaces, down positive")

    return draw_rails


def _ground(train: Train) -> Callable[[Axes], None]:
    x, displacement = ground_profile(train)

    def draw_ground(axes: Axes) -> None:
        down, aside = displacement.T
        if down.any():
            axes.fill_between(x, 1e3 * down, 1e3 * max(down.max(), 0.0), color="0.85", linewidth=0.0)
            _shape(axes, x, down, Look(BLACK, "-"))
        if aside.any():
            _shape(axes, x, aside, Look(BLACK, "--"))
        axes.set(ylabel="[mm]", title="Ground: displacement, down positive; dashed: to the right")

    return draw_ground


def _shape(axes: Axes, x: Reals, values: Reals, look: Look) -> None:
    """Draw a shape along the track, down positive, on an axis that points down."""
    curve = Curve(float(x[0]), float(x[-1]))
    curve.add(x, 1e3 * values)
    axes.plot(*curve.line, rasterized=curve.is_thinned, **look._asdict())
    if not axes.yaxis_inverted():
        axes.invert_yaxis()


def _openings(axes: Axes, slabs: Extremes) -> None:
    for name, look in (
        ("opening_at_rest", Look("0.6", "-")),
        ("largest_opening", Look(BLACK, "-")),
        ("smallest_opening", Look(BLACK, "--")),
    ):
        _line(axes, slabs, slabs[name], look, 1e3, drawstyle="steps-mid")
    title = "Opening under slabs: largest; grey: largest at rest; dashed: smallest there, 0 where it closes"
    axes.set(ylabel="[mm]", title=title)


def _mark(axes: Axes, seats: Extremes, slabs: Extremes) -> None:
    """Mark defects, with a triangle that stays visible in long runs, and stretches that not all wheels passed."""
    for extremes, colour, hatch, label in (
        (seats, ORANGE, "", "fastenings with a defect"),
        (slabs, PURPLE, "////", "slab over a void"),
    ):
        for row in extremes.defects:
            low, high = extremes.span(row)
            axes.axvspan(low, high, color=colour, alpha=0.4, hatch=hatch, linewidth=0.0, zorder=0, label=label)
            middle = 0.5 * (low + high)
            axes.plot(middle, 1.0, "v", color=colour, markersize=4, transform=axes.get_xaxis_transform(), clip_on=False)
    for low, high in seats.partly_passed:
        axes.axvspan(low, high, color="0.94", linewidth=0.0, zorder=-1, label="not passed by all wheels")
