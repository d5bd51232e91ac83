"""What ends a train and what is only recorded."""

from __future__ import annotations

from typing import Annotated, Literal

from tiengine.parameters.quantity import Params, Q

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
