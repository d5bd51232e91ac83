"""Records of the track: envelopes of seats and slabs, gauges, snapshots of the deflection.

Watchers read the state at the end of steps; the extremes of slabs come from the chunk's record. With each chunk of
steps they hand over what is complete, so that memory does not grow with distance; what they keep are plain arrays,
which :meth:`Trackside.saved` returns and :meth:`Trackside.restore` takes.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from tiengine.engine.stepper import Plan, Stepper
from tiengine.parameters.arrays import Flags, Reals
from tiengine.recording.deflection import Deflection
from tiengine.recording.gauge_samples import gauge_samples
from tiengine.recording.seat_envelopes import SeatEnvelopes
from tiengine.recording.slab_envelopes import SlabEnvelopes
from tiengine.result_files.channels import DEFLECTION, OPENINGS, SEATS, SLABS
from tiengine.result_files.layout import DTYPES, Block, GroupSpec
from tiengine.scenario.gauges import Gauge, nearest_seat
from tiengine.scenario.scenario import Scenario
from tiengine.track.slab import Slab

__all__ = ["Trackside", "Watcher", "trackside_groups"]


class Record(Protocol):
    """Fills a group of the file."""

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Hand over what is complete, train by train.

        Args:
            time: Ends of the chunk's steps [s], shape (steps,).
            position: Chainage of the first vehicle's centre then [m].
        """

    def remainder(self) -> list[Block]:
        """Hand over what is kept until the end of the run, train by train; empty if nothing is."""

    def saved(self) -> dict[str, Reals]:
        """All arrays that it holds between chunks, not copies."""

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`."""


@runtime_checkable
class Watcher(Record, Protocol):
    """Reads the state at the end of steps and fills a group of the file."""

    @property
    def stage(self) -> str:
        """Name of its stage of the step."""

    def watch(self) -> None:
        """Read the state at the end of a step."""

    def due(self, plan: Plan) -> Flags:
        """Steps of a plan after which :meth:`watch` reads the state, shape (steps,)."""


@dataclass(eq=False)
class Trackside:
    """The records of a run's track.

    Attributes:
        records: By the group that they fill.
        point_offset: Points of the group ``deflection`` forward of the first vehicle's centre [m].
        trains: Trains advanced together, B.
        dtype: Precision of the file.
    """

    records: dict[str, Record]
    point_offset: Reals
    trains: int
    dtype: Any

    @classmethod
    def watching(cls, scenario: Scenario, stepper: Stepper) -> Trackside:
        """Watchers of the groups that a scenario records, called by the stepper after each step.

        Args:
            scenario: Selects the groups that are recorded.
            stepper: Is watched.
        """
        records = dict(_records(scenario, stepper))
        for record in records.values():
            if isinstance(record, Watcher):
                stepper.watch(record.stage, record.watch, due=record.due)
        snapshots = records.get("deflection")
        offset = snapshots.point_offset if isinstance(snapshots, Deflection) else np.zeros(0)
        return cls(records, offset, stepper.state.trains, DTYPES[scenario.output.precision])

    def blocks(self, time: Reals, position: Reals, failed: Container[int] = ()) -> list[dict[str, Block]]:
        """Blocks to be written after a chunk of steps, train by train; the arrays are copies.

        Args:
            time: Ends of the steps [s], shape (steps,).
            position: Chainage of the first vehicle's centre then [m].
            failed: Places of the trains that failed in these steps. Their seats and slabs, watched beyond that instant,
                are left out.
        """
        found: list[dict[str, Block]] = [{} for _ in range(self.trains)]
        for group, record in self.records.items():
            for b, block in enumerate(record.blocks(time, position)):
                if group not in ENVELOPES or b not in failed:
                    found[b][group] = self._cast(block)
        return found

    def remainder(self) -> list[dict[str, Block]]:
        """Blocks to be written at the end of the run, train by train."""
        found: list[dict[str, Block]] = [{} for _ in range(self.trains)]
        for group, record in self.records.items():
            for b, block in enumerate(record.remainder()):
                found[b][group] = self._cast(block)
        return found

    def saved(self) -> dict[str, Reals]:
        """Arrays that the coming steps depend on, between two chunks."""
        return {f"{group}.{key}": value for group, each in self.records.items() for key, value in each.saved().items()}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`, in a run of the same scenario."""
        for group, record in self.records.items():
            own = f"{group}."
            record.restore({key.removeprefix(own): value for key, value in saved.items() if key.startswith(own)})

    def _cast(self, block: Block) -> Block:
        channels = {name: np.array(value, self.dtype) for name, value in block.channels.items()}
        return Block(block.along, block.chainage, channels)


ENVELOPES = {"seats": SEATS, "slabs": SLABS}


def trackside_groups(scenario: Scenario) -> dict[str, GroupSpec]:
    """Groups of the file that a scenario records of the track, in the order of the records."""
    out = scenario.output
    groups: dict[str, GroupSpec] = {}
    if out.envelopes:
        groups |= {name: GroupSpec.standard(name, tuple(channels)) for name, channels in ENVELOPES.items()}
        if scenario.slabs_may_lift:
            groups["slabs"] = GroupSpec.standard("slabs", (*SLABS, *OPENINGS))
    if out.deflection_interval != "none":
        groups["deflection"] = GroupSpec.standard("deflection", tuple(DEFLECTION))
    for gauge in scenario.gauges:
        groups[f"gauges/{gauge.name}"] = _gauge_group(gauge, scenario.parts.slab)
    return groups


def _gauge_group(gauge: Gauge, slab: Slab) -> GroupSpec:
    """Group of a gauge; a fastening's chainage is its seat's."""
    if gauge.on == "fastening":
        seat = nearest_seat(gauge.chainage, slab)
        known = {"on": gauge.on, "chainage": (seat + 0.5) * slab.fastening_pitch, "seat": seat, "side": gauge.side}
        return GroupSpec.gauge("force", known)
    if gauge.on == "gap":
        return GroupSpec.gauge("opening", {"on": gauge.on, "chainage": gauge.chainage, "y": gauge.y})
    where = {"side": gauge.side} if gauge.on == "rail" else {"y": gauge.y}
    return GroupSpec.gauge("motion", {"on": gauge.on, "chainage": gauge.chainage, **where})


def _records(scenario: Scenario, stepper: Stepper) -> Iterator[tuple[str, Record]]:
    """Records by the group that they fill."""
    out = scenario.output
    if out.envelopes:
        yield "seats", SeatEnvelopes.of(stepper)
        yield "slabs", SlabEnvelopes.of(scenario, stepper)
    for gauge in scenario.gauges:
        yield f"gauges/{gauge.name}", gauge_samples(gauge, stepper)
    if out.deflection_interval != "none":
        every = max(1, round(float(out.deflection_interval) / stepper.ingredients.newmark.dt))
        yield "deflection", Deflection(stepper, every)
