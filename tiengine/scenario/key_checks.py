"""Checks of single keys of a scenario beyond a numeric range."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from pydantic import BeforeValidator

__all__ = ["NumberOr", "channel_names", "check_speed", "number_or"]


def _finite(value: Any) -> bool:
    """Whether a value is a finite number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and -math.inf < value < math.inf  # a whole number may be too large for a float


@dataclass(frozen=True)
class NumberOr(BeforeValidator):
    """Check of a key that is one word or a number within a range, described for the manual.

    Attributes:
        word: The word.
        unit: SI unit of the number.
        low: Smallest number.
        high: Largest number.
    """

    word: str = ""
    unit: str = "-"
    low: float = -math.inf
    high: float = math.inf


def number_or(word: str, unit: str, low: float, high: float) -> NumberOr:
    """Make a check for one word or a number in ``low .. high``."""

    def check(value: Any) -> Any:
        if value == word:
            return value
        if not _finite(value) or not low <= value <= high:
            raise ValueError(f"must be {word!r} or a number between {low:g} and {high:g} {unit}")
        return float(value)

    return NumberOr(check, word=word, unit=unit, low=low, high=high)


def check_speed(value: Any) -> Any:
    """Check a speed, or rows of chainage and speed."""
    if isinstance(value, tuple):
        if len(value) < 2 or not all(isinstance(r, tuple) and len(r) == 2 and all(map(_finite, r)) for r in value):
            raise ValueError("must be a number or two or more rows [chainage_m, km/h]")
        if any(b[0] <= a[0] for a, b in pairwise(value)):
            raise ValueError("chainages must increase from row to row")
        speeds = [row[1] for row in value]
    elif _finite(value):
        speeds = [value]
    else:
        raise ValueError("must be a number or two or more rows [chainage_m, km/h]")
    if not all(0.0 < speed <= 1000.0 for speed in speeds):
        raise ValueError("must be greater than 0 and at most 1000 km/h")
    return value


def channel_names(known: dict[str, Any]) -> BeforeValidator:
    """Make a check for "all" or a list of known channels."""

    def check(value: Any) -> Any:
        if value == "all":
            return tuple(known)
        if not isinstance(value, tuple) or not all(isinstance(name, str) for name in value):
            raise ValueError("must be 'all' or a list of channel names")
        for name in value:
            if name not in known:
                raise ValueError(f"no such channel {name!r}; known: {', '.join(known)}")
        if len(set(value)) < len(value):
            raise ValueError("must name each channel once")
        return value

    return BeforeValidator(check)
