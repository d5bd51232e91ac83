"""What can happen to a train on its way, and what the scenario makes of it."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

from tiengine.parameters.quantity import Params, Q

__all__ = ["EVENT_KINDS", "Event", "Events"]

EVENT_KINDS = ("derailment", "flange_climb", "wheel_lift", "track_end")

Policy = Literal["stop", "record"]


class Events(Params):
    """What ends a train ("stop") and what is only written down ("record").

    Attributes:
        derailment: A wheel is beyond its profile on the flange side, where forces mean nothing any more.
        flange_climb: The contact has passed the steepest part of the flange.
        wheel_lift: A wheel carries nothing for ``wheel_lift_time``.
        track_end: The leading wheel comes to the end of a measured track, smooth beyond it.
    """

    derailment: Policy = "stop"
    flange_climb: Policy = "record"
    wheel_lift: Policy = "record"
    track_end: Policy = "record"
    wheel_lift_time: Annotated[float, Q("s", "how long a wheel must be off its rail", ge=1e-3, le=10.0)] = 0.05


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
