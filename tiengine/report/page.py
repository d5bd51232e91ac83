"""Report of a result as one self-contained HTML page: no network, no scripts, pictures embedded.

The template is ``tiengine/library/report.html.jinja``; all text from the file is escaped when it is inserted.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined

import tiengine
from tiengine.figures.catalogue import KINDS
from tiengine.figures.style import png
from tiengine.indices.by_car import Column, by_car
from tiengine.indices.index import Index
from tiengine.indices.key_figures import key_figures, summarise
from tiengine.indices.metrics import Metrics, Spread
from tiengine.indices.train_record import AbsentError, Train
from tiengine.indices.wheel_extremes import wheel_extremes
from tiengine.parameters.errors import InputError
from tiengine.report.metrics_table import notes, place
from tiengine.report.scenario_words import scenario_words
from tiengine.result_files.output_file import check_output
from tiengine.result_files.reader import COMPLETE
from tiengine.result_files.summary import summary
from tiengine.track.fastening import POINT

if TYPE_CHECKING:
    from tiengine.result import Result

__all__ = ["render", "write"]

MOST = 100  # rows of failures, and of events
MOST_NAMES = 20  # indices over their limit that are named


@dataclass(frozen=True)
class _Picture:
    name: str
    title: str
    caption: str
    image: str


def render(result: Result, train: int | None = None) -> str:
    """Render the page.

    Args:
        result: An open file.
        train: Number of the train whose figures are drawn; the first complete one if None. Key figures and indices are
            those of all trains.

    Returns:
        The page as HTML.

    Raises:
        InputError: There is no such train.
    """
    complete = [i for i in range(result.trains) if result.status(i) == COMPLETE]
    shown = Train(result, train if train is not None else complete[0] if complete else 0).number
    environment = Environment(
        loader=PackageLoader("tiengine", "library"), autoescape=True, undefined=StrictUndefined, trim_blocks=False
    )
    environment.filters.update(number=_number, unit=_unit, verdict=_verdict)
    several = result.trains > 1
    pictures, absent = _pictures(result, shown)
    content = {
        "title": result.scenario.name,
        "seats_are_points": result.scenario.parts.fastening.baseplate == POINT,
        "file": Path(result.name).name,
        "version": tiengine.__version__,
        "trains": result.trains,
        "several": several,
        "notice": _notice(result),
        "hint": f"Key figures and indices are those of all trains; figures of a single train show train {shown}."
        if several
        else "",
        "scenario": scenario_words(result.scenario),
        "toml": result.scenario_toml,
        "figures_of_one": [] if several else key_figures(Train(result, shown)),
        "summaries": summarise([(i, key_figures(Train(result, i))) for i in complete]) if several else [],
        **_indices(result),
        "figures": pictures,
        "absent": absent,
        "failures": list(result.failures.items()),
        "events": list(_events(result)),
        "most": MOST,
        "facts": list(_facts(result, shown)),
    }
    content["contents"] = _contents(content)
    return environment.get_template("report.html.jinja").render(content)


def write(result: Result, path: Path, train: int | None = None) -> None:
    """Write the page to a file, which it replaces.

    Args:
        result: An open file.
        path: Path of the page; ends in .html or .htm.
        train: See :func:`render`.

    Raises:
        InputError: The suffix is another one, there is no such train, or the path cannot be written.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"output = {str(path)!r}: its suffix must be .html or .htm")
    check_output(path, force=True)
    page = render(result, train)
    try:
        path.write_text(page, encoding="utf-8")
    except OSError as error:
        raise InputError(f"output = {str(path)!r}: cannot be written ({error.strerror or error})") from None


def _notice(result: Result) -> str:
    """Notice at the head of the page about runs that are not complete; empty if all are."""
    failed = len(result.failures)
    if result.trains > 1:
        return f"{failed} of {result.trains} trains did not complete their run and are left out." if failed else ""
    if result.status() == COMPLETE:
        return ""
    why = result.status() or "unknown status"
    return f"The run is not complete: {why}. This page shows the results up to that point."


def _indices(result: Result) -> dict[str, Any]:
    """Worst indices by standard, those by vehicle, their notes, and an overall verdict."""
    complete = [i for i in range(result.trains) if result.status(i) == COMPLETE]
    vehicles = max(len(train.train.vehicles) for train in result.scenario.members)
    try:
        metrics = result.metrics()
    except InputError as error:
        columns = _by_car(vehicles, result, complete, ())
        return {"indices": [], "notes": [], "verdict": None, "no_indices": str(error), "cars": columns}
    groups: dict[str, list[Any]] = {}
    worst = metrics.spread(by_vehicle=False)
    for each in worst:
        groups.setdefault(each.worst.standard, []).append((place(each.worst, metrics), each))
    indices = [each.worst for each in metrics.spread()]
    return {
        "indices": list(groups.items()),
        "notes": notes([each.worst for each in worst], metrics),
        "verdict": _overall_verdict(indices, metrics),
        "no_indices": "",
        "cars": _by_car(vehicles, result, complete, metrics.spread()),
    }


def _by_car(vehicles: int, result: Result, trains: Sequence[int], spread: Sequence[Spread]) -> list[Column]:
    """Columns of the table by vehicle; none for a single vehicle."""
    if vehicles == 1:
        return []
    try:
        extremes = [wheel_extremes(Train(result, i)) for i in trains]
    except AbsentError:
        extremes = []
    return by_car(vehicles, spread, extremes)


def _overall_verdict(indices: Sequence[Index], metrics: Metrics) -> dict[str, Any]:
    judged = [index for index in indices if index.verdict != "none"]
    over = [index for index in judged if index.verdict == "over"]
    worst = " (worst of all trains)" if len(metrics.trains) > 1 else ""
    count = f"{len(judged)} of {len(indices)} indices have a value and a limit{worst}"
    if not over:
        return {"over": False, "text": f"{count}: all are within the limit." if judged else f"{count}."}
    names = [f"{index.standard}, {index.name} at {place(index, metrics)}" for index in over]
    more = f"; and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return {"over": True, "text": f"{count}: {len(over)} over the limit ({'; '.join(names[:MOST_NAMES])}{more})."}


def _pictures(result: Result, train: int) -> tuple[list[_Picture], list[tuple[str, str]]]:
    """All figures that the file has the data for, and the reasons why others are absent."""
    pictures, absent = [], []
    for kind in KINDS:
        try:
            image = base64.b64encode(png(kind.draw(result, train))).decode("ascii")
        except AbsentError as error:
            absent.append((kind.title, str(error)))
        else:
            pictures.append(_Picture(kind.name, kind.title, kind.caption, image))
    return pictures, absent


def _events(result: Result) -> Iterator[dict[str, Any]]:
    """Yield the events of all trains; older files have none."""
    for train in range(result.trains):
        node = result[f"trains/{train:03d}"]
        if "events" not in node:
            continue
        table = node["events"]
        messages = table["message"].asstr()[:]
        for time, position, message in zip(table["time"][:], table["position"][:], messages, strict=True):
            yield {"train": train, "time": float(time), "position": float(position), "message": str(message)}


def _facts(result: Result, train: int) -> Iterator[tuple[str, str]]:
    """Yield sizes, times, versions and machine of the run."""
    attributes = result.attributes
    yield "file", result.name
    yield from summary(attributes)
    yield "status", result.status(train) if result.trains == 1 else f"{len(result.failures)} failures"
    own = result.facts(train)
    if "window_length" in own:
        yield "window", f"{own['window_length']:g} m"
    for name in ("seed", "functions", "modes", "passes", "slabs", "seats_in_window", "trains_together"):
        if name in own:
            yield name.replace("_", " "), str(own[name])
    for name, value in attributes.items():
        if name.endswith("_version") or name == "platform":
            yield name.replace("_", " "), str(value)


def _contents(content: dict[str, Any]) -> list[tuple[str, str]]:
    """Anchors and headings of the table of contents."""
    entries = [
        ("scenario", "Scenario"),
        ("numbers", "Key figures"),
        *([("vehicles", "The train by vehicle")] if content["cars"] else []),
        ("indices", "Indices of the standards"),
        *((f"figure-{picture.name}", picture.title) for picture in content["figures"]),
    ]
    if content["several"] or content["failures"] or content["events"]:
        entries.append(("trains", "Trains"))
    return [*entries, ("facts", "Run facts")]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _unit(unit: str) -> str:
    """Print a unit with a raised exponent."""
    return unit.replace("^2", "²")


def _verdict(index: Index) -> str:
    """Print a verdict in words, so that it does not depend on colour."""
    missing = "no value" if index.value is None else "no limit"
    return {"within": "within the limit", "over": "OVER THE LIMIT", "none": missing}[index.verdict]
