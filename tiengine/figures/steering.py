"""Steering of the wheelsets through curves: yaw against the radial direction, lateral position between the rails."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiengine.figures.alignment import line_of, plot_beneath
from tiengine.figures.curve import Curve
from tiengine.figures.curving import COLOURS
from tiengine.figures.one_train import of_one_train
from tiengine.figures.style import new_figure
from tiengine.indices.train_record import Train
from tiengine.vehicle.train import MOTIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


@of_one_train
def draw(train: Train) -> Figure:
    """Draw yaw and lateral position of the wheelsets of the leading vehicle, with curvature and cant beneath.

    Both are relative to the track frame at the wheelset: a wheelset that stands radially has no yaw.

    Args:
        train: The train.

    Raises:
        AbsentError: The line is straight and level, or the file lacks the bodies' displacement.
    """
    line = line_of(train)
    samples = train.samples("body", "displacement")
    model = train.model
    offset = [float(x) for x in model.wheelset_x[model.wheelset_vehicle == 0]]
    names = list(samples.group["body"].asstr()[:])
    rows = [names.index(model.body_names[dof[0] // 5]) for dof in model.wheelset_dof[: len(offset)]]
    begin, end = samples.chainage_range
    kinds = (("yaw", 1e3, "[mrad]", "Yaw of each wheelset"), ("y", 1e3, "[mm]", "Lateral position of each wheelset"))
    curves = {kind[0]: [Curve(begin + x, end + x) for x in offset] for kind in kinds}
    for position, channels in samples.slices():
        for w, row in enumerate(rows):
            for name, scale, _, _ in kinds:
                curves[name][w].add(position + offset[w], scale * channels["displacement"][:, row, MOTIONS.index(name)])
    figure = new_figure(13.5, f"{train.caption}: steering of the leading vehicle's wheelsets")
    axes = figure.subplots(3, 1, sharex=True)
    for panel, (name, _, unit, title) in zip(axes, kinds, strict=False):
        for w, curve in enumerate(curves[name]):
            panel.plot(*curve.line, color=COLOURS[w % len(COLOURS)], label=f"wheelset {w + 1}")
        panel.set(title=f"{title}, relative to the track", ylabel=unit)
        panel.margins(x=0.0)
    plot_beneath(axes[2], line, begin, end)
    axes[2].set_xlabel("chainage of the wheelset [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
