"""Events that can occur to a train during a run."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["EVENT_KINDS", "Event"]

EVENT_KINDS = ("derailment", "flange_climb", "wheel_lift", "oscillation", "contact_range", "track_end", "gap_closes")


class Event(NamedTuple):
    """Event of one train.

    Attributes:
        kind: One of ``EVENT_KINDS``, or ``"runaway"``.
        time: Time [s].
        position: Chainage of the first vehicle's centre [m].
        wheelset: Number from 1; 0 if the event concerns no wheelset.
        side: ``"left"``, ``"right"`` or empty.
        words: Description.
        stops: Whether the event ends the run of the train.
    """

    kind: str
    time: float
    position: float
    wheelset: int
    side: str
    words: str
    stops: bool

    def __str__(self) -> str:
        """Description with time and chainage."""
        return f"{self.words} (t = {self.time:.4f} s, chainage {self.position:.2f} m)"
