"""What the track feels, beside what the train does: envelopes of seats and slabs, gauges, the deflected track.

Watchers look at the state at the end of every step. With each chunk of steps they give out what is complete, so that
nothing grows with the length of the way; what they hold besides are plain arrays, which :meth:`Trackside.saved` gives
and :meth:`Trackside.restore` takes.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from tiengine.engine.stepper import Stepper
from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Reals
from tiengine.recording.deflection import Deflection
from tiengine.recording.gauge_samples import gauge_samples
from tiengine.recording.seat_envelopes import SeatEnvelopes
from tiengine.recording.slab_envelopes import SlabEnvelopes
from tiengine.result_files.channels import DEFLECTION, SEATS, SLABS
from tiengine.result_files.layout import DTYPES, Block, GroupSpec
from tiengine.scenario.gauges import Gauge, nearest_seat
from tiengine.scenario.scenario import Scenario
from tiengine.track.slab import Slab

__all__ = ["Trackside", "Watcher", "trackside_groups"]


class Watcher(Protocol):
    """One who looks at every step and fills a group of the file."""

    @property
    def stage(self) -> str:
        """What its part of a step is called."""

    def watch(self) -> None:
        """Look at the state at the end of a step."""

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """What is complete, train by train.

        Args:
            time: Ends of the chunk's steps [s], shape (steps,).
            position: Chainage of the first vehicle's centre then [m].
        """

    def rest(self) -> list[Block]:
        """What is kept back until the end of the run, train by train; empty if nothing is."""

    def saved(self) -> dict[str, Reals]:
        """All that it holds between chunks; arrays of its own, not copies."""

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Go on from there."""


@dataclass(eq=False)
class Trackside:
    """The watchers of a run.

    Attributes:
        watchers: By the group that they fill.
        point_offset: Points of the group ``deflection`` forward of the first vehicle's centre [m].
        trains: B.
        dtype: Precision of the file.
    """

    watchers: dict[str, Watcher]
    point_offset: Reals
    trains: int
    dtype: Any

    @classmethod
    def beside(cls, scenario: Scenario, stepper: Stepper) -> Trackside:
        """What a scenario asks for; each watcher becomes a last stage of the stepper.

        Args:
            scenario: Says what is recorded.
            stepper: Is watched.
        """
        watchers = dict(_watchers(scenario, stepper))
        stepper.stages = (*stepper.stages, *((watcher.stage, watcher.watch) for watcher in watchers.values()))
        snapshots = watchers.get("deflection")
        offset = snapshots.point_offset if isinstance(snapshots, Deflection) else np.zeros(0)
        return cls(watchers, offset, int(stepper.model.dims[at.TRAINS]), DTYPES[scenario.output.precision])

    def blocks(self, time: Reals, position: Reals, failed: Container[int] = ()) -> list[dict[str, Block]]:
        """What a chunk of steps has to write, train by train; arrays of its own.

        Args:
            time: Ends of the steps [s], shape (steps,).
            position: Chainage of the first vehicle's centre then [m].
            failed: Places of the trains that failed in these steps. Their seats and slabs, watched beyond the end, are
                left out.
        """
        found: list[dict[str, Block]] = [{} for _ in range(self.trains)]
        for group, watcher in self.watchers.items():
            for b, block in enumerate(watcher.blocks(time, position)):
                if group not in ENVELOPES or b not in failed:
                    found[b][group] = self._cast(block)
        return found

    def rest(self) -> list[dict[str, Block]]:
        """What is left to write at the end of the run, train by train."""
        found: list[dict[str, Block]] = [{} for _ in range(self.trains)]
        for group, watcher in self.watchers.items():
            for b, block in enumerate(watcher.rest()):
                found[b][group] = self._cast(block)
        return found

    def saved(self) -> dict[str, Reals]:
        """All that the rest of the run depends on, between two chunks."""
        return {f"{group}.{key}": value for group, each in self.watchers.items() for key, value in each.saved().items()}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Go on from what :meth:`saved` gave, in a run of the same scenario."""
        for group, watcher in self.watchers.items():
            own = f"{group}."
            watcher.restore({key.removeprefix(own): value for key, value in saved.items() if key.startswith(own)})

    def _cast(self, block: Block) -> Block:
        channels = {name: np.array(value, self.dtype) for name, value in block.channels.items()}
        return Block(block.along, block.chainage, channels)


ENVELOPES = {"seats": SEATS, "slabs": SLABS}


def trackside_groups(scenario: Scenario) -> dict[str, GroupSpec]:
    """Groups of the file that a scenario asks for, in the order of the watchers."""
    out = scenario.output
    groups: dict[str, GroupSpec] = {}
    if out.envelopes:
        groups |= {name: GroupSpec.standard(name, tuple(channels)) for name, channels in ENVELOPES.items()}
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
    where = {"side": gauge.side} if gauge.on == "rail" else {"y": gauge.y}
    return GroupSpec.gauge("motion", {"on": gauge.on, "chainage": gauge.chainage, **where})


def _watchers(scenario: Scenario, stepper: Stepper) -> Iterator[tuple[str, Watcher]]:
    """Who fills the groups."""
    out = scenario.output
    if out.envelopes:
        yield "seats", SeatEnvelopes.of(stepper)
        yield "slabs", SlabEnvelopes.of(scenario, stepper)
    for gauge in scenario.gauges:
        yield f"gauges/{gauge.name}", gauge_samples(gauge, stepper)
    if out.deflection_interval != "none":
        every = max(1, round(float(out.deflection_interval) / stepper.model.given.newmark.dt))
        yield "deflection", Deflection(stepper, every)
