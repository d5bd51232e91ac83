"""Channels of the result file from the records that the steps fill."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.stepper import Plan
from tiengine.engine.window import slabs_in_slots
from tiengine.kernels import layout as at
from tiengine.result_files.channels import MORTAR, PATCH
from tiengine.result_files.layout import DTYPES, Block, GroupSpec, TrainLabels
from tiengine.scenario.scenario import Scenario
from tiengine.vehicle.train import TrainModel

__all__ = ["Recorder", "Samples"]

Times = tuple[NDArray[np.float64], NDArray[np.float64]]

WHEEL_COLUMNS = {
    "normal_force": at.NORMAL_FORCE,
    "vertical_force": at.VERTICAL_FORCE,
    "lateral_force": at.LATERAL_FORCE,
    "longitudinal_creepage": at.LONGITUDINAL_CREEPAGE,
    "lateral_creepage": at.LATERAL_CREEPAGE,
    "spin_creepage": at.SPIN_CREEPAGE,
    "penetration": at.PENETRATION,
    "contact_position_wheel": at.POSITION_WHEEL,
    "contact_position_rail": at.POSITION_RAIL,
    "rolling_radius": at.ROLLING_RADIUS,
    "rail_deflection": at.RAIL_DEFLECTION,
    "longitudinal_creep_force": at.LONGITUDINAL_CREEP_FORCE,
    "lateral_creep_force": at.LATERAL_CREEP_FORCE,
    "spin_moment": at.SPIN_MOMENT,
}
IRREGULARITY_COLUMNS = {"vertical": at.IRREGULARITY_VERTICAL, "lateral": at.IRREGULARITY_LATERAL}
PATCH_COLUMNS = {
    "normal_force": at.PATCH_NORMAL_FORCE,
    "contact_position_wheel": at.PATCH_POSITION_WHEEL,
    "contact_position_rail": at.PATCH_POSITION_RAIL,
    "contact_angle": at.PATCH_ANGLE,
    "longitudinal_creepage": at.PATCH_LONGITUDINAL_CREEPAGE,
    "lateral_creepage": at.PATCH_LATERAL_CREEPAGE,
    "spin_creepage": at.PATCH_SPIN_CREEPAGE,
    "longitudinal_creep_force": at.PATCH_LONGITUDINAL_CREEP_FORCE,
    "lateral_creep_force": at.PATCH_LATERAL_CREEP_FORCE,
}
BODY_ROWS = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True, eq=False)
class Samples:
    """Records of one train in a chunk of steps.

    Attributes:
        wheel: Output of the wheels in every step, see ``layout``, shape (steps, W, 2, N_WHEEL).
        body: Displacement, velocity, acceleration of the bodies, shape (rows, 3, 5 bodies).
        slab: Index of the slab in each slot, recorded with the bodies, shape (rows, slots).
        pressure: Largest and smallest mortar pressure of each slab [Pa], shape (rows, slots, 2).
    """

    wheel: NDArray[np.float64]
    body: NDArray[np.float64]
    slab: NDArray[np.float64]
    pressure: NDArray[np.float64]


@dataclass(frozen=True)
class Recorder:
    """Decides which steps are recorded, and makes the blocks that are written.

    Attributes:
        scenario: Gives channels and intervals.
        dt: Time step [s].
    """

    scenario: Scenario
    dt: float

    @property
    def wheel_every(self) -> int:
        """Steps between two samples of the wheels."""
        return self._steps(self.scenario.output.wheel_interval)

    @property
    def body_every(self) -> int:
        """Steps between two samples of the bodies."""
        return self._steps(self.scenario.output.body_interval)

    def plan(self, done: int, count: int) -> Plan:
        """Steps of a chunk, with the samples of the wheels and the rows of the bodies' record (-1 none).

        Args:
            done: Steps before the chunk.
            count: Steps of the chunk.
        """
        number = np.arange(done + 1, done + count + 1)
        samples = (number % every == 0 for every in (self.wheel_every, self.body_every))
        return Plan(np.arange(count), *(np.where(taken, np.cumsum(taken) - 1, -1) for taken in samples))

    def body_rows(self, done: int, count: int) -> int:
        """Rows of the bodies' record that ``count`` steps after ``done`` fill."""
        return (done + count) // self.body_every - done // self.body_every

    def ends(self, first: int, count: int) -> NDArray[np.float64]:
        """Ends of ``count`` steps from number ``first`` on [s], shape (count,)."""
        return np.asarray(np.arange(first, first + count) * self.dt, np.float64)

    def groups(self) -> dict[str, GroupSpec]:
        """Groups that each train records."""
        return self.groups_of(self.scenario)

    @staticmethod
    def groups_of(scenario: Scenario) -> dict[str, GroupSpec]:
        """Groups that each train of a scenario records."""
        out = scenario.output
        patches = {"patch": GroupSpec.standard("patch", tuple(PATCH), times_of="wheel")}
        return {
            "wheel": GroupSpec.standard("wheel", out.wheel_channels),
            **(patches if scenario.contact.patches == 2 else {}),
            "body": GroupSpec.standard("body", out.body_channels),
            "irregularity": GroupSpec.standard("irregularity", out.irregularity_channels, times_of="wheel"),
            "mortar": GroupSpec.standard("mortar", tuple(MORTAR), times_of="body"),
        }

    def labels(self, train: TrainModel, slots: int) -> TrainLabels:
        """Labels of a train over so many slabs."""
        return TrainLabels(
            vehicles=[vehicle.name for vehicle in self.scenario.parts.vehicles],
            bodies=train.body_names,
            wheelset_vehicle=train.wheelset_vehicle,
            wheelset_offset=train.wheelset_x,
            slots=slots,
        )

    def blocks(
        self, chunk: Chunk, first: int, position: NDArray[np.float64], rows: Iterable[int]
    ) -> list[dict[str, Block]]:
        """Blocks of some trains to be written after a chunk of steps.

        Args:
            chunk: Filled buffers.
            first: Number of the chunk's first step, counted from 1 (the state after one step).
            position: Chainage of the first vehicle's centre at each step [m], shape (steps,).
            rows: Places of the trains in the chunk.

        Returns:
            Groups of each of these trains; the arrays are copies, times are shared between trains.
        """
        times = self._times(np.arange(first, first + len(position)), position)
        at_bodies = np.arange(first, first + len(position)) % self.body_every == 0
        pressure = chunk.mortar[:, : int(at_bodies.sum())]
        held = slabs_in_slots(chunk.rear_slab[: pressure.shape[1]], pressure.shape[2]).astype(np.float64)
        return [self._block(Samples(chunk.wheel[b], chunk.body[b], held, pressure[b]), times, first) for b in rows]

    def block(self, samples: Samples, steps: NDArray[np.int64], position: NDArray[np.float64]) -> dict[str, Block]:
        """Blocks of one train.

        Args:
            samples: Records of the steps; rows beyond them are ignored.
            steps: Numbers of the steps, counted from 1 and successive, shape (steps,).
            position: Chainage of the first vehicle's centre at each step [m], shape (steps,).
        """
        return self._block(samples, self._times(steps, position), int(steps[0]))

    def _times(self, steps: NDArray[np.int64], position: NDArray[np.float64]) -> tuple[Times, Times]:
        """Times [s] and chainages [m] of the wheels' samples and of the bodies'."""
        at_wheels, at_bodies = steps % self.wheel_every == 0, steps % self.body_every == 0
        time = steps * self.dt
        return (time[at_wheels], position[at_wheels]), (time[at_bodies], position[at_bodies])

    def _block(self, samples: Samples, times: tuple[Times, Times], first: int) -> dict[str, Block]:
        """The groups of one train, in the precision of the file; ``first`` is the number of the first step."""
        out, (at_wheels, at_bodies) = self.scenario.output, times
        wheels, bodies = len(at_wheels[0]), len(at_bodies[0])
        every, body = self.wheel_every, samples.body[:bodies]
        wheel = samples.wheel[-first % every :: every][:wheels]
        irregularity = {name: wheel[..., IRREGULARITY_COLUMNS[name]] for name in out.irregularity_channels}
        forces = {name: wheel[..., WHEEL_COLUMNS[name]] for name in out.wheel_channels}
        shape = (bodies, body.shape[-1] // 5, 5)  # a short last chunk may hold no sample of the bodies
        motion = {name: body[:, BODY_ROWS[name]].reshape(shape) for name in out.body_channels}
        largest, smallest = samples.pressure[:bodies, :, 0], samples.pressure[:bodies, :, 1]
        bed = {"slab": samples.slab[:bodies], "largest_pressure": largest, "smallest_pressure": smallest}
        patches = {"patch": self._cast(at_wheels, _patches(wheel))} if self.scenario.contact.patches == 2 else {}
        return {
            "wheel": self._cast(at_wheels, forces),
            **patches,
            "irregularity": self._cast(at_wheels, irregularity),
            "body": self._cast(at_bodies, motion),
            "mortar": self._cast(at_bodies, bed),
        }

    def _cast(self, times: Times, channels: dict[str, NDArray[np.float64]]) -> Block:
        """Copy, since the buffers are filled again; in the file's precision, to halve the data that workers send."""
        dtype = DTYPES[self.scenario.output.precision]
        return Block(*times, {name: np.array(value, dtype) for name, value in channels.items()})

    def _steps(self, interval: float | str) -> int:
        return 1 if isinstance(interval, str) else max(1, round(interval / self.dt))


def _patches(wheel: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Channels of the patches from the wheels' output, shape (rows, W, 2, 2 patches) each."""
    each = wheel[..., at.N_WHEEL :].reshape(*wheel.shape[:-1], 2, at.N_PATCH)
    found = {name: each[..., column] for name, column in PATCH_COLUMNS.items()}
    total = found["normal_force"].sum(axis=-1, keepdims=True)
    found["share"] = found["normal_force"] / np.where(total > 0.0, total, 1.0)
    along = found["longitudinal_creep_force"] * found["longitudinal_creepage"]
    found["wear_number"] = np.abs(along) + np.abs(found["lateral_creep_force"] * found["lateral_creepage"])
    return {name: found[name] for name in PATCH}
