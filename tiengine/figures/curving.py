"""Wheel forces over the alignment: sum of Y, Y and Q of the wheels of the leading vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiengine.figures.alignment import line_of, plot_beneath
from tiengine.figures.curve import Curve
from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLUE, GREEN, ORANGE, VERMILION
from tiengine.figures.style import new_figure
from tiengine.indices.train_record import Train

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COLOURS", "draw"]

CUT_OFF = 5.0  # Hz: what a curve does, without most of the irregularity
COLOURS = (BLUE, ORANGE, GREEN, VERMILION)
"""Colours of the wheelsets of a vehicle, repeated beyond four."""


@of_one_train
def draw(train: Train) -> Figure:
    """Draw the forces of the leading vehicle, low pass of 5 Hz, with curvature and cant beneath.

    Args:
        train: The train.

    Raises:
        AbsentError: The line is straight and level, or the file lacks the wheel forces.
    """
    line = line_of(train)
    samples = train.samples("wheel", "vertical_force", "lateral_force")
    offset = samples.group["wheelset_offset"][:]
    count = int((train.model.wheelset_vehicle == 0).sum())
    begin, end = samples.chainage_range
    names = ("axle", "Y left", "Y right", "Q left", "Q right")
    curves = {name: [Curve(begin + x, end + x) for x in map(float, offset[:count])] for name in names}
    for own, position, filtered in samples.low_passed(CUT_OFF):
        for w in range(count):
            x = (position + offset[w])[:own]
            Y, Q = (1e-3 * filtered[name][:own, w] for name in ("lateral_force", "vertical_force"))
            for name, values in zip(names, (Y.sum(axis=1), *Y.T, *Q.T), strict=True):
                curves[name][w].add(x, values)
    figure = new_figure(17.5, f"{train.caption}: forces of the leading vehicle on the rails, low pass {CUT_OFF:g} Hz")
    axes = figure.subplots(4, 1, sharex=True)
    panels = (
        ("ΣY [kN]", "Lateral force of each wheelset, right positive", (("axle", "-"),)),
        ("Y [kN]", "Lateral force of each wheel: left full, right dashed", (("Y left", "-"), ("Y right", "--"))),
        ("Q [kN]", "Vertical force of each wheel: left full, right dashed", (("Q left", "-"), ("Q right", "--"))),
    )
    for panel, (ordinate, title, drawn) in zip(axes, panels, strict=False):
        for name, dashes in drawn:
            for w, curve in enumerate(curves[name]):
                label = f"wheelset {w + 1}" if name == "axle" else None
                panel.plot(*curve.line, color=COLOURS[w % len(COLOURS)], linestyle=dashes, label=label)
        panel.set(ylabel=ordinate, title=title)
        panel.margins(x=0.0)
    plot_beneath(axes[3], line, begin, end)
    axes[3].set_xlabel("chainage of the wheelset [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
