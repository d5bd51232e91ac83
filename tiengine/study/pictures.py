"""Figures of a study: exceedance and its law, scatter against each factor, tornado, Sobol' indices, convergence."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.palette import BLACK, BLUE, GREY, SKY, VERMILION
from tiengine.figures.style import in_style, new_figure, plain
from tiengine.parameters.arrays import Reals
from tiengine.study.convergence import Course
from tiengine.study.extreme_values import ExtremeLaw
from tiengine.study.sensitivity import SobolIndex, Swing
from tiengine.study.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_convergence", "draw_exceedance", "draw_scatter", "draw_sobol", "draw_tornado", "words"]

UNITS = {"_kN_m_m": "kN m/m", "_m_s_2": "m/s²", "_kN": "kN", "_ms": "ms", "_kPa": "kPa", "_mm": "mm", "_Hz": "Hz"}
"""Units at the end of columns."""

MOST_FACTORS = 12
ACROSS = 3  # panels in a row


def words(name: str) -> str:
    """Name of a column as words, its unit in brackets."""
    for ending, unit in UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')} [{unit}]"
    return name.replace("_", " ")


@in_style
def draw_exceedance(values: Reals, figure_name: str, law: ExtremeLaw | None, title: str = "") -> Figure:
    """Draw how many trains exceed a value (or fall below, for smallest values), with the fitted law.

    Args:
        values: Values of a figure, shape (trains,).
        figure_name: Its name.
        law: Law of the extreme values; None draws none.
        title: Small text above the figure.
    """
    smallest = figure_name.startswith("smallest")
    ordered = np.sort(values) if smallest else np.sort(values)[::-1]
    share = (np.arange(len(values)) + 1.0) / (len(values) + 1.0)
    figure = new_figure(8.0, title)
    axes = figure.subplots()
    if law is not None:
        counts = np.geomspace(1.05, max(3.0 * len(values), 100.0), 60)
        levels = law.levels(list(counts))
        low, middle, high = np.array([(each.low, each.value, each.high) for each in levels]).T
        axes.fill_betweenx(1.0 / counts, low, high, color=SKY, alpha=0.4, linewidth=0.0, label="95 % interval")
        name = "Gumbel's law" if law.law == "gumbel" else f"GEV, shape {law.shape:.2f}"
        axes.plot(middle, 1.0 / counts, color=BLUE, label=name)
    axes.plot(ordered, share, ".", color=BLACK, markersize=3.0, label=f"{len(values)} trains")
    axes.set(
        yscale="log",
        xlabel=plain(words(figure_name)),
        ylabel="share of trains below" if smallest else "share of trains above",
    )
    axes.legend()
    return figure


@in_style
def draw_scatter(table: Table, figure_name: str, title: str = "") -> Figure:
    """Draw a figure against each factor.

    Args:
        table: Table of a study that has factors.
        figure_name: Name of a key figure.
        title: Small text above the figure.
    """
    names = [name for name in table.factors if len(set(table[name].tolist())) > 1][:MOST_FACTORS]
    across = max(min(ACROSS, len(names)), 1)
    rows = max(-(-len(names) // across), 1)
    figure = new_figure(5.5 * rows + 0.5, title)
    panels = figure.subplots(rows, across, squeeze=False, sharey=True)
    used = table.complete & np.isfinite(table[figure_name])
    for panel, name in zip(panels.flat, names, strict=False):
        _scatter(panel, table, name, figure_name, used)
    for panel in panels.flat[len(names) :]:
        panel.set_visible(False)
    figure.supylabel(plain(words(figure_name)), fontsize=8.0)
    return figure


def _scatter(panel: Axes, table: Table, name: str, figure_name: str, used: Reals) -> None:
    """Draw one panel, with the means of fifths, or of values."""
    factor, values = table[name][used], table[figure_name][used]
    if factor.dtype.kind not in "fiu":
        labels = sorted(set(map(str, factor)))
        factor = np.array([labels.index(str(value)) for value in factor], np.float64)
        panel.set_xticks(range(len(labels)), [plain(label) for label in labels], rotation=20)
    panel.plot(factor, values, ".", color=BLUE, markersize=2.5, alpha=0.5)
    different = np.unique(factor)
    edges = different if len(different) <= 10 else np.quantile(factor, np.linspace(0.0, 1.0, 6))
    groups = (
        [factor == value for value in different]
        if len(different) <= 10
        else [(factor >= a) & (factor <= b) for a, b in pairwise(edges)]
    )
    means = [(factor[group].mean(), values[group].mean()) for group in groups if group.any()]
    panel.plot(*zip(*means, strict=True), color=VERMILION, marker="o", markersize=3.0)
    panel.set_xlabel(plain(name))


@in_style
def draw_tornado(found: Sequence[Swing], figure_name: str, mean: float, title: str = "") -> Figure:
    """Draw the swings of a figure, the widest on top.

    Args:
        found: Swings, the widest first.
        figure_name: Name of the figure.
        mean: Its mean over all trains.
        title: Small text above the figure.
    """
    shown = list(found[:MOST_FACTORS])
    figure = new_figure(2.5 + 0.9 * len(shown), title)
    axes = figure.subplots()
    for row, swing in enumerate(reversed(shown)):
        axes.barh(row, swing.high - swing.low, left=swing.low, color=SKY, height=0.6)
        for x, label, side in ((swing.low, swing.at_low, "right"), (swing.high, swing.at_high, "left")):
            shift = (-3 if side == "right" else 3, 0)
            axes.annotate(plain(label), (x, row), shift, textcoords="offset points", ha=side, va="center", fontsize=6.5)
    axes.axvline(mean, color=BLACK, linewidth=0.8)
    axes.set_yticks(range(len(shown)), [plain(swing.factor) for swing in reversed(shown)])
    axes.use_sticky_edges = False  # room for the labels at either end
    axes.margins(x=0.25)
    axes.set_xlabel(plain(f"mean of {words(figure_name)}"))
    return figure


@in_style
def draw_sobol(found: Sequence[SobolIndex], figure_name: str, title: str = "") -> Figure:
    """Draw first-order and total indices with their intervals.

    Args:
        found: Indices of all factors.
        figure_name: Name of the figure.
        title: Small text above the figure.
    """
    figure = new_figure(7.0, title)
    axes = figure.subplots()
    x = np.arange(len(found))
    for shift, color, label, value, error in (
        (-0.2, BLUE, "first order", [each.first for each in found], [each.first_error for each in found]),
        (0.2, GREY, "total", [each.total for each in found], [each.total_error for each in found]),
    ):
        axes.bar(
            x + shift, value, 0.38, color=color, label=label, yerr=error, error_kw={"linewidth": 0.8, "capsize": 2.0}
        )
    axes.set_xticks(x, [plain(each.factor) for each in found], rotation=20 if len(found) > 5 else 0)
    axes.set(ylabel="share of the variance", title=plain(words(figure_name)))
    axes.legend()
    return figure


@in_style
def draw_convergence(courses: Sequence[tuple[str, Course]], figure_name: str, title: str = "") -> Figure:
    """Draw estimates with their intervals against the number of trains.

    Args:
        courses: Name of each estimate and its course.
        figure_name: Name of the figure.
        title: Small text above the figure.
    """
    figure = new_figure(7.0, title)
    axes = figure.subplots()
    for (name, found), color in zip(courses, (BLUE, VERMILION, BLACK), strict=False):
        axes.fill_between(found.counts, found.low, found.high, color=color, alpha=0.2, linewidth=0.0)
        axes.plot(found.counts, found.value, color=color, marker=".", label=name)
    axes.set(xscale="log", xlabel="number of trains", ylabel=plain(words(figure_name)))
    axes.legend()
    return figure
