"""Units and ranges of parameters, declared once, with the field.

A parameter class derives from :class:`Params` and annotates its fields with :func:`Q`::

    class Rail(Params):
        EI: Annotated[float, Q("N m^2", gt=0)]

The same declaration is used for validation, HDF5 attributes and the manual. All values are SI.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from tiengine.parameters.errors import InputError, nearest

__all__ = ["Name", "Params", "PlainName", "Q", "Source", "build", "explain"]

M = TypeVar("M", bound=BaseModel)


_WORDS = {
    "Value error, ": "",
    "Input should be": "must be",
    "a valid tuple": "a list",
    "a valid dictionary": "a table",
    "a valid number": "a number",
    "a valid integer": "a whole number",
    "a valid string": "a text",
    "a valid boolean": "true or false",
}


def Q(unit: str, description: str = "", **rule: Any) -> Any:
    """Declare the unit and range of a parameter.

    Args:
        unit: SI unit as text, ``"-"`` for none.
        description: Meaning of the number.
        rule: pydantic bounds: ``gt``, ``ge``, ``lt``, ``le``.

    Returns:
        A pydantic ``Field`` carrying the unit in its JSON schema.
    """
    return Field(description=description or None, json_schema_extra={"unit": unit}, **rule)


def _check_plain(name: str) -> str:
    """Refuse slashes and control characters."""
    if any(mark in name for mark in "/\\\n\t\r"):
        raise ValueError("must be one line without slashes, since files are named after it")
    return name


Name = Annotated[str, Field(description="name", max_length=200)]
PlainName = Annotated[
    str,
    Field(description="name, also of its result file by default", min_length=1, max_length=200),
    AfterValidator(_check_plain),
]
"""A name that also names a file; it cannot point to another folder."""
Source = Annotated[str, Field(description="source of the numbers")]


class Params(BaseModel):
    """Frozen, validated parameters; unknown keys are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, arbitrary_types_allowed=True, allow_inf_nan=False
    )


def build(model: type[M], table: Mapping[str, Any], where: str = "") -> M:
    """Make validated parameters from a table, with one-line errors.

    Args:
        model: A class derived from :class:`Params`.
        table: Its keys and values; tuples, not lists.
        where: Prefix that names the object in messages.

    Returns:
        The parameters.

    Raises:
        InputError: The first value that breaks a rule.
    """
    try:
        return model.model_validate(dict(table))
    except ValidationError as error:
        raise InputError(explain(error, model, where)) from None


def explain(error: ValidationError, model: type[BaseModel], where: str = "") -> str:
    """One-line message for the first error that pydantic found.

    Args:
        error: Exception raised by pydantic.
        model: Class being built, for the nearest known key.
        where: Prefix that names the object (file or table).

    Returns:
        ``"<where><key> = <value>: <rule>"``.
    """
    first = error.errors()[0]
    raised = first.get("ctx", {}).get("error")
    if isinstance(raised, InputError):  # a rule between keys, which names them itself
        return str(raised)
    path, unit = _trace(model, first["loc"])
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")
    prefix = f"{where}.{key}" if where and key else where or key
    if first["type"] == "extra_forbidden":
        return f"{prefix}: unknown key{nearest(str(path[-1]), _known(model, path[:-1]))}"
    if first["type"] == "missing":
        return f"{prefix}: missing; a value is required"
    # A union reports every alternative it tried; they share the path of the field.
    rules = [_rule(e["msg"]) for e in error.errors() if _trace(model, e["loc"])[0] == path]
    alternatives = [rules[0], *(rule.removeprefix("must be ") for rule in rules[1:])]
    rule = " or ".join(dict.fromkeys(alternatives))
    return f"{prefix} = {_short(first['input'])}: {rule}{f' {unit}' if _is_bound(first['type']) else ''}"


def _rule(message: str) -> str:
    """Pydantic's message in the wording of this package."""
    message = re.sub(r"^\w+ should have (.*) after validation, not \d+", r"must have \1", message)
    for old, new in _WORDS.items():
        message = message.replace(old, new)
    return f"{message[:1].lower()}{message[1:]}"


def _is_bound(kind: str) -> bool:
    """Whether an error of this kind is a violated bound, which has a unit."""
    return kind.startswith(("greater_than", "less_than"))


def _short(value: Any) -> str:
    """A value as one short line."""
    text = " ".join(repr(list(value) if isinstance(value, tuple) else value).split())
    return text if len(text) <= 80 else f"{text[:77]}..."


def _trace(model: Any, path: tuple[int | str, ...]) -> tuple[tuple[int | str, ...], str]:
    """The path without the tags pydantic adds for union members, and the unit declared for its last field."""
    kept: list[int | str] = []
    unit = ""
    for depth, part in enumerate(path, start=1):
        fields = getattr(model, "model_fields", None)
        if isinstance(part, int) or (fields is not None and (part in fields or depth == len(path))):
            kept.append(part)
        if fields is not None and part in fields:
            extra = fields[part].json_schema_extra
            unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
            model = next(
                (t for t in _classes(fields[part].annotation) if issubclass(t, BaseModel)),
                fields[part].annotation,
            )
    return tuple(kept), "" if unit == "-" else unit


def _known(model: Any, path: tuple[int | str, ...]) -> list[str]:
    """Keys known at ``path`` below ``model``; empty where the path leaves the declared classes."""
    for part in path:
        if isinstance(part, int):
            continue
        field = getattr(model, "model_fields", {}).get(part)
        if field is None:
            return []
        model = next((t for t in _classes(field.annotation) if issubclass(t, BaseModel)), None)
    return list(getattr(model, "model_fields", {}))


def _classes(annotation: Any) -> list[type]:
    """Every class mentioned in an annotation."""
    if isinstance(annotation, type) and not getattr(annotation, "__args__", ()):
        return [annotation]
    return [found for part in getattr(annotation, "__args__", ()) for found in _classes(part)]
