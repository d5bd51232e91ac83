"""Points of a plan: values of all factors, from grids, lists, tables and draws, each combined with all others."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import LARGEST_TRACK, read_text_file
from tiengine.scenario.declared_keys import takes_names
from tiengine.scenario.overrides import parse_value
from tiengine.scenario.scenario import Scenario
from tiengine.study.constraints import Constraint
from tiengine.study.plan import MOST_MEMBERS, Factor, Plan
from tiengine.study.sampling import drawn_values, unit_points

__all__ = ["Point", "factor_names", "points_of"]

Part = tuple[dict[str, Any], dict[str, Any]]
"""Changes by key, and values for tables by name of the factor."""


@dataclass(frozen=True)
class Point:
    """Values of all factors.

    Attributes:
        changes: Values by key of the scenario.
        factors: What stands for them in tables, by name of the factor: numbers and texts.
    """

    changes: dict[str, Any]
    factors: dict[str, Any]


def points_of(plan: Plan, folder: Path) -> list[Point]:
    """Expand the factors of a plan, the last one varying fastest.

    Args:
        plan: The plan.
        folder: Where its relative paths start.

    Raises:
        InputError: A table or a distribution breaks a rule, there are too many points, or no point is left.
    """
    designs = list(_designs(plan, folder))
    count = prod(len(design) for design in designs)
    if count > MOST_MEMBERS:
        raise InputError(f"{plan.name}: {count} points; must be at most {MOST_MEMBERS}")
    points = [_joined(parts) for parts in product(*designs)]
    if plan.constraints and points:
        constraints = [Constraint(text, _known(points[0])) for text in plan.constraints]
        points = [point for point in points if all(each.holds(_known(point)) for each in constraints)]
        if not points:
            raise InputError(f"constraints: none of {count} points fulfils them")
    return points


def factor_names(plan: Plan, points: Sequence[Point]) -> list[str]:
    """Names of all factors, in the order of the plan.

    Args:
        plan: The plan.
        points: Its points.
    """
    return list(points[0].factors) if points else [factor.title for factor in plan.factors]


def _designs(plan: Plan, folder: Path) -> Iterator[list[Part]]:
    """Groups of factors that vary together; each entry holds changes and table values of one row."""
    if plan.table is not None:
        yield _table(plan, folder)
    done: set[str] = set()
    for factor in plan.factors:
        if factor.drawn or factor.together in done:
            continue
        if factor.together:
            done.add(factor.together)
            yield _in_step([each for each in plan.factors if each.together == factor.together], folder)
        else:
            yield _in_step([factor], folder)
    drawn = [factor for factor in plan.factors if factor.drawn]
    if drawn and plan.sample is not None:
        unit = unit_points(plan.sample, len(drawn))
        columns = [drawn_values(factor, unit[:, i]) for i, factor in enumerate(drawn)]
        yield [_joined_parts(drawn, row, row) for row in zip(*columns, strict=True)]


def _in_step(factors: list[Factor], folder: Path) -> list[Part]:
    """Rows of factors that advance together."""
    counts = {len(factor.values) for factor in factors}
    if len(counts) > 1:
        raise InputError(
            f"factors together = {factors[0].together!r}: have {' and '.join(map(str, sorted(counts)))} values;"
            " must have the same number"
        )
    rows: list[Part] = []
    for i in range(counts.pop()):
        values = [_located(factor.values[i], folder) for factor in factors]
        shown = [factor.labels[i] if factor.labels else _shown(factor.values[i], i) for factor in factors]
        rows.append(_joined_parts(factors, values, shown))
    return rows


def _joined_parts(factors: Sequence[Factor], values: Sequence[Any], shown: Sequence[Any]) -> Part:
    """Changes and table values of one row."""
    pairs = list(zip(factors, values, strict=True))
    changes = {key: value for factor, value in pairs for key in factor.keys}
    return changes, {factor.title: word for factor, word in zip(factors, shown, strict=True)}


def _table(plan: Plan, folder: Path) -> list[Part]:
    """Rows of the table of a plan."""
    path = folder / plan.table.file if plan.table is not None else folder
    reader = csv.reader(io.StringIO(read_text_file(path, str(path), LARGEST_TRACK)), skipinitialspace=True)
    head, *rows = [row for row in reader if any(cell.strip() for cell in row)] or [[]]
    head = [name.strip() for name in head]
    if not rows or not all(head) or len(set(head)) < len(head):
        raise InputError(f"{path}: must have a first row of different keys, and at least one row of values")
    if shared := set(head) & {key for factor in plan.factors for key in (*factor.keys, factor.title)}:
        raise InputError(f"{path}: {sorted(shared)[0]!r} is a factor of the plan already")
    found: list[Part] = []
    for number, row in enumerate(rows, start=2):
        if len(row) != len(head):
            raise InputError(f"{path}: row {number}: {len(row)} values; must be {len(head)}")
        values = [_parsed(key, text.strip()) for key, text in zip(head, row, strict=True)]
        changes = {key: _located(value, folder) for key, value in zip(head, values, strict=True)}
        found.append((changes, {key: _shown(value, text) for key, value, text in zip(head, values, row, strict=True)}))
    return found


def _parsed(key: str, text: str) -> Any:
    """Value of a cell: a name where the key takes names, otherwise TOML."""
    return text if takes_names(Scenario, key.split(".")) else parse_value(text, key)


def _located(value: Any, folder: Path) -> Any:
    """The value; the name of a file next to the plan becomes absolute."""
    match value:
        case str() if ("/" in value or "." in value) and len(value) < 1000:
            path = folder / value
            return str(path.resolve()) if path.is_file() else value
        case dict():
            return {key: _located(item, folder) for key, item in value.items()}
        case tuple():
            return tuple(_located(item, folder) for item in value)
    return value


def _shown(value: Any, otherwise: Any) -> Any:
    """A number or a text for tables; other values are shown otherwise."""
    return value if isinstance(value, bool | int | float | str) else otherwise


def _joined(parts: Sequence[Part]) -> Point:
    """Point made of one row of every design."""
    changes: dict[str, Any] = {}
    factors: dict[str, Any] = {}
    for some_changes, some_factors in parts:
        changes |= some_changes
        factors |= some_factors
    return Point(changes, factors)


def _known(point: Point) -> dict[str, Any]:
    """Values that constraints may name: by key and by name of the factor."""
    return {**point.changes, **point.factors}
