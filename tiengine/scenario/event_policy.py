"""Policy for events: which end a train and which are only recorded."""

from __future__ import annotations

from typing import Annotated, Literal

from tiengine.parameters.quantity import Params, Q

Policy = Literal["stop", "record"]


class Events(Params):
    """Events that end a train ("stop") or are only recorded ("record").

    Attributes:
        derailment: A wheel has left the contact table on the flange side; forces are no longer valid.
        flange_climb: The contact has passed the steepest part of the flange.
        wheel_lift: A wheel is unloaded for ``wheel_lift_time``.
        oscillation: Wheel forces alternate from step to step and grow, or stay large: the time step is unstable.
        contact_range: A wheel is tilted beyond the contact table, or shifted beyond it on the field side: it keeps the
            geometry of the table's edge.
        track_end: The leading wheel reaches the end of a measured track; the track is smooth beyond it.
        gap_closes: A gap of a mortar void, where it is largest, or of a hanging fastening closes for the first time.
    """

    derailment: Policy = "stop"
    flange_climb: Policy = "record"
    wheel_lift: Policy = "record"
    oscillation: Policy = "stop"
    contact_range: Policy = "record"
    track_end: Policy = "record"
    gap_closes: Policy = "record"
    wheel_lift_time: Annotated[float, Q("s", "time a wheel must be off its rail", ge=1e-3, le=10.0)] = 0.05
