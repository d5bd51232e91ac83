"""Report of a study as one self-contained HTML page, in the form of the report of a run."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

import tiengine
from tiengine.figures.style import png
from tiengine.parameters.errors import InputError
from tiengine.report.scenario_words import scenario_words
from tiengine.result_files.output_file import check_output
from tiengine.scenario.scenario import to_toml
from tiengine.study import pictures
from tiengine.study.bands import draw_study_bands
from tiengine.study.convergence import course
from tiengine.study.extreme_values import fit_extremes
from tiengine.study.folder import Folder
from tiengine.study.percentiles import percentiles
from tiengine.study.sensitivity import sobol_indices, swings
from tiengine.study.table import Table, read_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["render", "write"]

PERCENTS = (5.0, 50.0, 95.0, 99.0, 99.9)
LEVELS = (10.0, 100.0, 1000.0, 10000.0)
BY_DEFAULT = 3  # key figures that are shown in full
MOST_FAILURES = 100


@dataclass
class _Answer:
    """Everything about one key figure.

    Attributes:
        name: Its column.
        words: Name and unit.
        percentiles, levels: Rows of tables.
        law: Sentence on the fitted law.
        pictures: Caption and image of every figure.
        absent: Reasons why some are missing.
    """

    name: str
    words: str
    percentiles: list[Any]
    levels: list[Any] = field(default_factory=list)
    law: str = ""
    swings: list[Any] = field(default_factory=list)
    sobol: list[Any] = field(default_factory=list)
    pictures: list[tuple[str, str]] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)

    def draw(self, caption: str, make: Callable[[], Figure]) -> None:
        """Add a figure, or the reason why it cannot be drawn."""
        try:
            self.pictures.append((caption, base64.b64encode(png(make())).decode("ascii")))
        except InputError as error:
            self.absent.append(str(error))


def render(folder: Folder) -> str:
    """Render the page of a study, also of one that is not complete yet.

    Args:
        folder: Its folder.

    Returns:
        The page as HTML.

    Raises:
        InputError: No train is complete, or the plan names an unknown key figure.
    """
    design, table, status = folder.design, read_table(folder), folder.status()
    if not table.complete.any():
        raise InputError(f"{folder.path}: no train is complete yet")
    shown = design.plan.quantities or [name for name in table.figures if _varies(table, name)][:BY_DEFAULT]
    environment = Environment(
        loader=PackageLoader("tiengine", "library"), autoescape=True, undefined=StrictUndefined, trim_blocks=False
    )
    environment.filters.update(number=_number)
    bands = _Answer("bands", "", [])
    bands.draw("", lambda: draw_study_bands(folder))
    failures = [(int(i), str(why)) for i, why in zip(table["train"], table["status"], strict=True) if why != "complete"]
    content = {
        "title": design.plan.name,
        "folder": folder.path.name,
        "version": tiengine.__version__,
        "status": status.rows(),
        "notice": ""
        if status.finished
        else f"{status.complete} of {status.tasks} tasks are complete; this page shows them.",
        "factors": [_factor_row(table, name) for name in table.factors],
        "points": len(design.points),
        "scenario": scenario_words(design.base) if design.base is not None else [],
        "toml": to_toml(design.base.model_copy(update={"presets": {}})) if design.base is not None else "",
        "summary": [_summary_row(table, name) for name in table.figures if _varies(table, name)],
        "percents": PERCENTS,
        "answers": [_answer(folder, table, name) for name in shown],
        "bands": bands,
        "failures": failures[:MOST_FAILURES],
        "failed": len(failures),
    }
    return environment.get_template("study.html.jinja").render(content)


def write(folder: Folder, path: Path) -> None:
    """Write the page to a file, which it replaces.

    Args:
        folder: Folder of the study.
        path: Ends in .html or .htm.

    Raises:
        InputError: See :func:`render`; or the path cannot be written.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"output = {str(path)!r}: its suffix must be .html or .htm")
    check_output(path, force=True)
    path.write_text(render(folder), encoding="utf-8")


def _answer(folder: Folder, table: Table, name: str) -> _Answer:
    """Percentiles, extremes, influences and convergence of one key figure."""
    plan, values = folder.design.plan, table.values(name)
    found = _Answer(name, pictures.words(name), percentiles(values, PERCENTS))
    title = f"{folder.path.name}: {len(values)} trains"
    law = None
    try:
        law = fit_extremes(values, smallest=name.startswith("smallest"))
        found.levels = law.levels(LEVELS)
        found.law = "Gumbel's law" if law.law == "gumbel" else f"the extreme-value law with shape {law.shape:.3f}"
    except InputError as error:
        found.absent.append(str(error))
    found.draw(
        "Share of trains beyond a value, each train being a block; the line is the fitted law, the band its interval."
        " Read no further than the band stays narrow. With factors the trains are those of all points together.",
        lambda: pictures.draw_exceedance(values, name, law, title),
    )
    found.swings = swings(table, name)
    if found.swings:
        found.draw(
            "Every train against every factor; the line joins means of values or of fifths.",
            lambda: pictures.draw_scatter(table, name, title),
        )
        found.draw(
            "Range over which the mean moves with each factor, all others as they come; the vertical line is the mean.",
            lambda: pictures.draw_tornado(found.swings, name, float(values.mean()), title),
        )
    if plan.sample is not None and plan.sample.method == "saltelli":
        try:
            found.sobol = sobol_indices(plan, table, name)
            found.draw(
                "Shares of the variance that each factor explains alone (first order) and takes part in (total).",
                lambda: pictures.draw_sobol(found.sobol, name, title),
            )
        except InputError as error:
            found.absent.append(str(error))
    courses = [(f"{percent:g} %", course(values, percent)) for percent in (50.0, 95.0, 99.0)]
    found.draw(
        "Estimates from the first trains of a random order; with enough trains the bands no longer narrow visibly.",
        lambda: pictures.draw_convergence(courses, name, title),
    )
    return found


def _varies(table: Table, name: str) -> bool:
    """Whether a figure has at least two values that differ."""
    values = table[name][table.complete]
    values = values[np.isfinite(values)]
    return len(values) > 1 and float(np.ptp(values)) > 0.0


def _factor_row(table: Table, name: str) -> tuple[str, str]:
    """Name of a factor and the values that it takes."""
    column = table[name]
    different = sorted(set(column.tolist()), key=lambda value: (str(type(value)), value))
    if len(different) > 8 and column.dtype.kind in "fiu":
        return name, f"{column.min():.4g} to {column.max():.4g}, {len(different)} values"
    return name, ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in different[:30])


def _summary_row(table: Table, name: str) -> tuple[str, list[float], float]:
    """Words, percentiles and the number of trains of one figure."""
    values = table.values(name)
    return pictures.words(name), [float(value) for value in np.percentile(values, PERCENTS)], len(values)


def _number(value: float) -> str:
    return f"{value:.4g}"
