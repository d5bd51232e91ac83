"""Reference pages generated from declarations: the keys of a scenario, the channels of a result.

``python -m tiengine.scenario.manual docs`` updates docs/scenario.md and docs/results.md; a test compares them.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tiengine.result_files.channels import GAUGE_FORCE, GAUGE_MOTION, GAUGE_OPENING, GROUPS
from tiengine.result_files.layout import DIMENSIONS, GAUGE_DIMENSIONS
from tiengine.scenario.key_checks import NumberOr
from tiengine.scenario.profile_part import ProfilePoints
from tiengine.scenario.scenario import Scenario
from tiengine.track.fastening import Fastening
from tiengine.track.mortar import Mortar
from tiengine.track.rail import Rail
from tiengine.track.slab import Slab
from tiengine.vehicle.coach import Coach
from tiengine.vehicle.coupling import Coupling
from tiengine.vehicle.vehicle import Vehicle
from tiengine.vehicle.wind import Aerodynamics

__all__ = ["Table", "channel_tables", "page", "tables", "with_channels"]

HEAD = """# Scenario reference

A scenario is a TOML file. Unknown keys are refused, and every value is checked before a run begins. `--set key=value`
changes one on the command line (`--set train.speed_kmh=300`), a dictionary in Python
(`load_scenario("paper", {"train.speed_kmh": 300.0})`). All tables but `[train]` are optional. `tiengine list` shows
the presets and their sources; each result file contains the resolved scenario with all values used.

This page is generated from the declarations in the code (`python -m tiengine.scenario.manual docs`).
"""

PARTS = """## Parts

A part is stated by the name of a preset, by the path of a file relative to the scenario's, or as a table, which may
start from a preset:

```toml
[track.fastening]
like = "ACE2021"
vertical_stiffness = 5e7
```

A scenario's own presets are tables `[presets.KIND.NAME]`, with the kinds that `tiengine list` names. A profile may
also be a SIMPACK or MiniProf file, see [files](files.md).
"""

TYPES: dict[Any, str] = {float: "number", int: "whole number", str: "text", bool: "true or false"}
FILE = re.compile(r"`?(?:docs/|(validation/report/))(\w+)\.md`?")
ROLE = re.compile(r":\w+:`~?\.?([^`]*)`")


@dataclass
class Table:
    """One class of parameters and its places in a scenario file.

    Attributes:
        model: The class.
        places: Headings of its tables.
        level: Level of its heading.
    """

    model: type[BaseModel]
    places: list[str] = field(default_factory=list)
    level: int = 2


def page() -> str:
    """Scenario reference as Markdown."""
    scenario, parts = tables()
    blocks = [HEAD, *map(_section, scenario), PARTS, *map(_section, parts)]
    return "\n".join(blocks)


def tables() -> tuple[list[Table], list[Table]]:
    """Tables of a scenario, and tables of its parts."""
    scenario = list(_walk(Scenario, ""))
    scenario[0].places = ["top of the file"]
    parts: list[Table] = []
    for name, model in (
        ("rail", Rail),
        ("slab", Slab),
        ("slab, `[mortar]`", Mortar),
        ("fastening", Fastening),
        ("profile", ProfilePoints),
        ("coupling", Coupling),
        ("aerodynamics of a car", Aerodynamics),
        ("vehicle, as a coach on bogies", Coach),
        ("vehicle, as bodies and connectors", Vehicle),
    ):
        found = list(_walk(model, "", level=3))
        found[0].places = [name]
        parts += [table for table in found if table.model not in [known.model for known in parts]]
    return scenario, parts


def _walk(model: type[BaseModel], prefix: str, level: int = 2) -> Iterator[Table]:
    """A class and the classes of its tables, each once."""
    yield Table(model, level=level)
    inner: dict[type[BaseModel], Table] = {}
    for key, info in model.model_fields.items():
        found, many = _model_of(info.annotation)
        if found is not None:
            head = f"`[[{prefix}{key}]]`" if many else f"`[{prefix}{key}]`"
            inner.setdefault(found, Table(found, level=level + bool(level > 2))).places.append(head)
    for found, table in inner.items():
        below = list(_walk(found, f"{table.places[0].strip('`[]')}.", level))
        yield table
        yield from below[1:]


def _section(table: Table) -> str:
    """Heading, description and keys of one table."""
    places = table.places[0] if len(table.places) == 1 else f"{', '.join(table.places[:-1])} and {table.places[-1]}"
    lines = [f"{'#' * table.level} {places[0].upper()}{places[1:]}", "", _words(table.model), ""]
    lines += ["| key | type | unit | range | default | meaning |", "| --- | --- | --- | --- | --- | --- |"]
    attributes = _attributes(table.model)
    for key, info in table.model.model_fields.items():
        inner = _inner(info.annotation)
        cells = (
            f"`{key}`",
            _type(info.annotation),
            _unit(info) or _unit(inner),
            _range(info) or _range(inner),
            _default(info),
            attributes.get(key) or info.description or (inner and inner.description) or _table_words(info),
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _type(annotation: Any) -> str:
    """Description of a type."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(arguments[0])
    if origin is Literal:
        return " or ".join(f'`"{word}"`' for word in arguments)
    if origin in (Union, UnionType):
        plain = [argument for argument in arguments if argument is not NoneType]
        if {str, dict} <= {get_origin(argument) or argument for argument in plain}:
            return "part"
        return " or ".join(map(_type, plain))
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return f"list of {_plural(_type(arguments[0]))}"
        return f"list of {len(arguments)} {_plural(_type(arguments[0]))}"
    if origin is dict:
        return "table"
    return TYPES.get(annotation, "table")


def _plural(words: str) -> str:
    return words.replace("list", "lists", 1) if words.startswith("list") else f"{words}s"


def _unit(info: FieldInfo | None) -> str:
    """SI unit of a key, empty where there is none."""
    if info is None:
        return ""
    extra = info.json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else next((m.unit for m in _numbers(info)), None)
    return "" if unit in (None, "-") else str(unit)


def _range(info: FieldInfo | None) -> str:
    """Bounds of a number."""
    if info is None:
        return ""
    for number in _numbers(info):
        return f"{_number(number.low)} to {_number(number.high)}"
    signs = {Gt: "> ", Ge: "≥ ", Lt: "< ", Le: "≤ "}
    bounds = [(signs[type(mark)], mark) for mark in info.metadata if type(mark) in signs]
    return ", ".join(sign + _number(getattr(mark, type(mark).__name__.lower())) for sign, mark in bounds)


def _number(value: Any) -> str:
    """Format a number as in TOML."""
    if isinstance(value, int):
        return str(value)
    return re.sub(r"e([+-])0*", lambda match: f"e{match[1].strip('+')}", f"{value:g}")


def _numbers(info: FieldInfo) -> list[NumberOr]:
    return [mark for mark in info.metadata if isinstance(mark, NumberOr)]


def _default(info: FieldInfo) -> str:
    """Format a default value as in TOML."""
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if value is None or value in ((), {}) or isinstance(value, BaseModel):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, tuple):  # lists of texts name all channels of a group
        return "all" if isinstance(value[0], str) else f"[{', '.join(map(_number, value))}]"
    return f'`"{value}"`' if isinstance(value, str) and value else str(value)


def _words(model: type[BaseModel]) -> str:
    """The docstring of a class as Markdown, without its list of attributes."""
    text = (inspect.getdoc(model) or "").split("\nAttributes:")[0].strip()
    text = ROLE.sub(r"`\1`", text).replace("``", "`")
    return FILE.sub(lambda match: f"[{match[2]}]({'../' * bool(match[1])}{match[1] or ''}{match[2]}.md)", text)


def _attributes(model: type[BaseModel]) -> dict[str, str]:
    """Descriptions of attributes from the docstrings of a class and its parents."""
    found: dict[str, str] = {}
    for parent in reversed(model.__mro__):
        _, _, text = inspect.cleandoc(parent.__doc__ or "").partition("Attributes:\n")
        for match in re.finditer(r"^ {4}(\w+): (.*(?:\n {5,}.*)*)", text, flags=re.MULTILINE):
            words = " ".join(match[2].split()).rstrip(".").replace("``", "`")
            is_name = words.split()[0].endswith("'s")
            found[match[1]] = words if is_name else f"{words[:1].lower()}{words[1:]}"
    return found


def _table_words(info: FieldInfo) -> str:
    """Description of a key that holds a table, empty for other keys."""
    model, many = _model_of(info.annotation)
    if model is None:
        return ""
    return "tables, see below" if many else "table, see below"


def _model_of(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """Class of the tables of a key, if any, and whether there may be several."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, False
    for argument in get_args(annotation):
        model, _ = _model_of(argument)
        if model is not None:
            return model, get_origin(annotation) is tuple
    return None, False


def _inner(annotation: Any) -> FieldInfo | None:
    """Declaration of the entries of a list, or of an optional value."""
    for argument in get_args(annotation):
        marks = getattr(argument, "__metadata__", ())
        for mark in marks:
            if isinstance(mark, FieldInfo):
                return mark
    return None


def channel_tables() -> str:
    """Channel tables of every group of a result as Markdown."""
    groups = [(name, DIMENSIONS[name], channels) for name, channels in GROUPS.items()]
    groups.append(("gauges/NAME, on rail or slab", GAUGE_DIMENSIONS["motion"], GAUGE_MOTION))
    groups.append(("gauges/NAME, on a fastening", GAUGE_DIMENSIONS["force"], GAUGE_FORCE))
    groups.append(("gauges/NAME, in a gap", GAUGE_DIMENSIONS["opening"], GAUGE_OPENING))
    lines: list[str] = []
    for name, dimensions, channels in groups:
        lines += ["", f"### {name}", "", f"Dimensions: {', '.join(dimensions)}.", ""]
        lines += ["| channel | unit | meaning |", "| --- | --- | --- |"]
        lines += [f"| `{key}` | {channel.units} | {channel.long_name} |" for key, channel in channels.items()]
    return "\n".join([*lines, ""])


def with_channels(text: str) -> str:
    """Replace the channel tables between the marks of a page."""
    begin, rest = text.split("<!-- channels -->")
    _, end = rest.split("<!-- /channels -->")
    return f"{begin}<!-- channels -->\n{channel_tables()}\n<!-- /channels -->{end}"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    (folder / "scenario.md").write_text(page(), encoding="utf-8")
    results = folder / "results.md"
    results.write_text(with_channels(results.read_text(encoding="utf-8")), encoding="utf-8")
