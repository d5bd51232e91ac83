"""What an index of a standard is: a value beside its limit, with the clause both come from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

__all__ = ["Index", "Verdict", "worst"]

Verdict = Literal["within", "over", "none"]


@dataclass(frozen=True, kw_only=True)
class Index:
    """One index of one vehicle, at the place where it is worst.

    Attributes:
        standard: Name and edition of the standard.
        name: What the index is.
        vehicle: The vehicle, 1 leads.
        place: Wheelset, wheel or floor point that it belongs to.
        value: Value; None where the run is too short for it.
        unit: Unit of value and limit.
        limit: Limit; None where the standard has none.
        clause: Clause of method and limit.
        shortfall: Why it is an index only and no assessment in the standard's sense; empty for an assessment.
        note: What else there is to say, such as the standard's class.
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
        """Whether run and statistics are those that the standard asks for."""
        return "index" if self.shortfall else "assessment"

    @property
    def verdict(self) -> Verdict:
        """Whether the value keeps its limit; ``"none"`` without value or limit."""
        if self.value is None or self.limit is None:
            return "none"
        return "within" if self.value <= self.limit else "over"

    @property
    def severity(self) -> float:
        """What makes one index worse than another: the part of the limit used, or the value if it has no limit."""
        if self.value is None:
            return -1.0
        return self.value / self.limit if self.limit else self.value

    def to_dict(self) -> dict[str, Any]:
        """Fields, kind and verdict, for JSON."""
        return {**asdict(self), "kind": self.kind, "verdict": self.verdict}


def worst(indices: Iterable[Index]) -> Index:
    """The worst of one index at several places."""
    return max(indices, key=lambda index: index.severity)
