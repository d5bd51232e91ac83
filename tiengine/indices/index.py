"""Index of a standard: a value and its limit, with the clause that both come from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

__all__ = ["Index", "Verdict", "no_limit", "worst", "worst_of"]

Verdict = Literal["within", "over", "none"]


@dataclass(frozen=True, kw_only=True)
class Index:
    """One index of one vehicle, at the place where it is worst.

    Attributes:
        standard: Name and edition of the standard.
        name: Name of the quantity.
        vehicle: Number of the vehicle, 1 for the leading one.
        place: Wheelset, wheel or floor point that it belongs to.
        value: Value; None where the run is too short for it.
        unit: Unit of value and limit.
        limit: Limit; None where the standard has none.
        clause: Clause of method and limit.
        shortfall: Reason why it is an index only and not an assessment as defined by the standard; empty for an
            assessment.
        note: Further information, such as the standard's class.
    """

    standard: str
    name: str
    vehicle: int
    place: str
    value: float | None
    unit: str
    limit: float | None
    clause: str
    shortfall: str = ""
    note: str = ""

    @property
    def kind(self) -> Literal["assessment", "index"]:
        """Whether run and statistics are those that the standard requires."""
        return "index" if self.shortfall else "assessment"

    @property
    def verdict(self) -> Verdict:
        """Whether the value is within its limit; ``"none"`` without value or limit."""
        if self.value is None or self.limit is None:
            return "none"
        return "within" if self.value <= self.limit else "over"

    @property
    def severity(self) -> float:
        """Measure that the worst index has most of: the utilised part of the limit, or the value without a limit."""
        if self.value is None:
            return -1.0
        return self.value / self.limit if self.limit else self.value

    def to_dict(self) -> dict[str, Any]:
        """Return fields, kind and verdict, for JSON."""
        return {**asdict(self), "kind": self.kind, "verdict": self.verdict}


def no_limit(vehicle_class: str | None) -> str:
    """Say why a value has no limit.

    Args:
        vehicle_class: Class of the vehicle; None if it is not stated.
    """
    if vehicle_class is None:
        return "no limit, since the class of the vehicle is not stated: set its vehicle_class, or use --class"
    return f"no limit known for vehicles of class {vehicle_class}"


def worst(indices: Iterable[Index]) -> Index:
    """Return the worst of the values of one index at several places."""
    return max(indices, key=lambda index: index.severity)


def worst_of(indices: Iterable[Index]) -> Iterator[Index]:
    """Yield the worst of the values of one index at several places, or nothing if there are none."""
    found = list(indices)
    if found:
        yield worst(found)
