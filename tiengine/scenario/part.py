"""Reference to a part of vehicle or track: name of a preset, path of a file, or table."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator

from tiengine.parameters.presets import LONGEST_PATH


def _check_part(value: Any) -> Any:
    """Refuse what cannot refer to a part."""
    if isinstance(value, str) and len(value) > LONGEST_PATH:
        raise ValueError(f"must have at most {LONGEST_PATH} characters")
    if not isinstance(value, str | dict) or not value:
        raise ValueError("must be the name of a preset, the path of a file, or a table")
    return value


Part = Annotated[str | dict[str, Any], BeforeValidator(_check_part)]
"""Name of a preset, path of a file, or table, which may start from a preset: ``{like = "CHN60", ...}``."""

Presets = dict[str, dict[str, dict[str, Any]]]
"""Tables by kind and name."""
