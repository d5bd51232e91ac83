"""Overrides of single keys of a scenario: ``--set train.speed_kmh=300`` and its Python form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import DEEPEST, plain_toml, to_tuples
from tiengine.scenario.declared_keys import default_part, table_class, takes_names

__all__ = ["Overrides", "apply_overrides", "parse_value"]

MOST_DIGITS = 9  # of an index
TOML_OPENINGS = ('"', "'", "[", "{")  # of texts, lists and tables

Overrides = Mapping[str, Any] | Sequence[str]
"""Either ``{"train.speed_kmh": 300.0}``, nested tables, or texts ``"train.speed_kmh=300"``."""


def apply_overrides(tables: dict[str, Any], overrides: Overrides, model: type[BaseModel]) -> dict[str, Any]:
    """Set keys in the tables of a scenario.

    A key may reach into a part that the scenario names: ``track.fastening.vertical_stiffness=5e7`` turns
    ``"ACE2021"`` into ``{like = "ACE2021", vertical_stiffness = 5e7}``, whether the scenario names the part or leaves
    it to its default. A bare text for a key that takes names is not read as TOML: ``track.rail_profile=60E1``.

    Args:
        tables: Tables of the scenario; not changed.
        overrides: Keys and values; later entries take precedence.
        model: Class of the scenario, which declares its keys.

    Returns:
        New tables.

    Raises:
        InputError: A text without ``=``, or a key below a number.
    """
    for key, value in _pairs(overrides, model):
        if key.count(".") >= DEEPEST:
            raise InputError(f"--set {key[:40]}...: must have at most {DEEPEST} parts")
        tables = _replaced(tables, key.split("."), value, key, model)
    return tables


def parse_value(text: str, key: str = "") -> Any:
    """Value of a TOML text; a bare word that is not TOML is taken as a string.

    Args:
        text: ``300``, ``[1, 2]``, ``true``, ``{factor = 0.5}``, ``explicit``.
        key: Its key for messages.

    Raises:
        InputError: It is nested too deep.
    """
    try:
        parsed = plain_toml(f"value = {text}", f"--set {key[:80]}")
    except InputError:
        raise
    except ValueError:
        return text.strip()
    return to_tuples(parsed["value"], key) if list(parsed) == ["value"] else text


def _pairs(overrides: Overrides, model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values; a nested table changes single keys and does not replace a table."""
    if not isinstance(overrides, Mapping):
        for text in (overrides,) if isinstance(overrides, str) else overrides:
            key, equals, value = text.partition("=")
            if not equals or not key.strip():
                raise InputError(f"--set {text!r}: must be KEY=VALUE, such as train.speed_kmh=300")
            is_name = takes_names(model, key.strip().split(".")) and not value.lstrip().startswith(TOML_OPENINGS)
            yield key.strip(), value.strip() if is_name else parse_value(value, key.strip())
        return
    for key, value in overrides.items():
        if prefix.count(".") >= DEEPEST:
            raise InputError(f"{prefix[:40]}...: nested deeper than {DEEPEST} tables")
        if isinstance(value, Mapping) and value:
            yield from _pairs(value, model, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", to_tuples(value, f"{prefix}{key}")


def _replaced(node: Any, path: list[str], value: Any, key: str, model: type[BaseModel] | None) -> Any:
    """A copy of ``node``, a table of ``model``, with the value at ``path`` replaced."""
    if not path:
        return value
    head, tail = path[0], path[1:]
    if isinstance(node, dict):
        part = default_part(model, head)
        return {**node, head: _replaced(node.get(head, part or {}), tail, value, key, table_class(model, head))}
    if isinstance(node, str):  # the name of a preset, of which one key is changed
        return {"like": node, head: _replaced({}, tail, value, key, None)}
    if isinstance(node, tuple):
        if not head.isdecimal() or len(head) > MOST_DIGITS or int(head) >= len(node):
            raise InputError(f"--set {key}: {head!r} must be an index between 0 and {len(node) - 1}")
        return tuple(
            _replaced(item, tail, value, key, model) if i == int(head) else item for i, item in enumerate(node)
        )
    raise InputError(f"--set {key}: {head!r} lies below a value that is not a table ({node!r})")
