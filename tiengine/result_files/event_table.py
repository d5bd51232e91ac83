"""Table of the events of a train in its result file: one row per event, one dataset per column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import h5py

from tiengine.result_files.channels import Channel
from tiengine.result_files.events import Event

__all__ = ["EVENT", "EVENTS", "create_events", "event_columns"]

EVENTS = "events"
"""Name of the group."""

EVENT = "event"
"""Name of its dimension, and of the column that numbers the events."""

CHUNK = 64  # rows

TEXT = h5py.string_dtype()

COLUMNS = {
    EVENT: ("i4", Channel("1", "number of the event")),
    "time": ("f8", Channel("s", "time")),
    "position": ("f8", Channel("m", "chainage of the first vehicle's centre")),
    "kind": (
        TEXT,
        Channel(
            "1", "derailment, flange_climb, wheel_lift, oscillation, contact_range, track_end, gap_closes or runaway"
        ),
    ),
    "wheelset": ("i4", Channel("1", "wheelset, 1 leads; 0 if the event concerns none")),
    "side": (TEXT, Channel("1", "left, right or empty")),
    "message": (TEXT, Channel("1", "description")),
    "stops": ("i1", Channel("1", "1 if the event ended the run of the train")),
}


def create_events(group: Any) -> None:
    """Create the empty columns.

    Args:
        group: HDF5 group.
    """
    for name, (dtype, meaning) in COLUMNS.items():
        column = group.create_dataset(name, (0,), dtype, maxshape=(None,), chunks=(CHUNK,))
        column.attrs["units"], column.attrs["long_name"] = meaning.units, meaning.long_name
        if name == EVENT:
            column.make_scale(name)
        else:
            column.dims[0].attach_scale(group[EVENT])


def event_columns(events: Sequence[Event], first: int) -> dict[str, list[Any]]:
    """Rows of the table, by column.

    Args:
        events: Events in order.
        first: Number of the first event.
    """
    return {
        EVENT: list(range(first, first + len(events))),
        "time": [event.time for event in events],
        "position": [event.position for event in events],
        "kind": [event.kind for event in events],
        "wheelset": [event.wheelset for event in events],
        "side": [event.side for event in events],
        "message": [event.words for event in events],
        "stops": [int(event.stops) for event in events],
    }
