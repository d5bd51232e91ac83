"""Declarations behind dotted keys: the class of a table, the default of a part, keys that take names and no numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

__all__ = ["default_part", "table_class", "takes_names"]

NAMES_OF_A_PART = ("like", "name", "source")
"""Keys of every part's table that hold texts."""


def table_class(model: type[BaseModel] | None, key: str) -> type[BaseModel] | None:
    """Class of the table, or of the tables of the list, that a key holds.

    Args:
        model: Class that declares the key; None where it is unknown.
        key: The key.

    Returns:
        The class; None for other values and within parts, whose class depends on their kind.
    """
    field = model.model_fields.get(key) if model is not None else None
    if field is None:
        return None
    classes = [found for found in _alternatives(field.annotation) if isinstance(found, type)]
    return next((found for found in classes if issubclass(found, BaseModel)), None)


def default_part(model: type[BaseModel] | None, key: str) -> str | None:
    """Name of the preset that a key stands for by default; None if it holds no part or has no default.

    Args:
        model: Class that declares the key; None where it is unknown.
        key: The key.
    """
    field = model.model_fields.get(key) if model is not None else None
    if field is None or not isinstance(field.default, str):
        return None
    return field.default if dict in _alternatives(field.annotation) else None


def takes_names(model: type[BaseModel], path: Sequence[str]) -> bool:
    """Whether a key takes texts of the user's choice and no numbers or truth values.

    Args:
        model: Class of the scenario.
        path: Parts of the dotted key; indices count entries of lists.
    """
    table: type[BaseModel] | None = model
    for depth, key in enumerate(path):
        if key.isdecimal() and depth:
            continue
        field = table.model_fields.get(key) if table is not None else None
        if field is None:
            return depth > 0 and path[-1] in NAMES_OF_A_PART
        alternatives = set(_alternatives(field.annotation))
        if all(part.isdecimal() for part in path[depth + 1 :]):
            return str in alternatives and not alternatives & {int, float, bool, Literal}
        table = table_class(table, key)
    return False


def _alternatives(annotation: Any) -> Iterator[Any]:
    """Plain types that a value, or an entry of a list, may have; Literal stands for fixed words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        yield from _alternatives(arguments[0])
    elif origin in (Union, UnionType, tuple):
        for argument in arguments:
            yield from _alternatives(argument)
    else:
        yield origin or annotation
