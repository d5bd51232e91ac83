"""What can happen to a train on its way, and what the scenario makes of it."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["EVENT_KINDS", "Event"]

EVENT_KINDS = ("derailment", "flange_climb", "wheel_lift", "oscillation", "track_end")


class Event(NamedTuple):
    """Something that happened to a train.

    Attributes:
        kind: One of ``EVENT_KINDS``, or ``"runaway"``.
        time: When [s].
        position: Chainage of the first vehicle's centre [m].
        wheelset: From 1; 0 where it concerns none.
        side: ``"left"``, ``"right"``, or nothing.
        words: What happened.
        stops: Whether it ends the train.
    """

    kind: str
    time: float
    position: float
    wheelset: int
    side: str
    words: str
    stops: bool

    def __str__(self) -> str:
        """One sentence."""
        return f"{self.words} (t = {self.time:.4f} s, chainage {self.position:.2f} m)"
