"""Guards: check every millisecond of simulated time whether a train derails or its numbers run away.

Numbers that run away end a train. A derailment, a flange that climbs, a wheel that stays off its rail, forces that
oscillate at the step's own frequency and a measured track that ends are events: they go into the file and onto the
screen, and the scenario says whether they end the train.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.table import ContactTable
from tiengine.engine.lookout import Lookout
from tiengine.engine.state import PARTS
from tiengine.engine.stepper import Plan, Stepper
from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Flags
from tiengine.parameters.conventions import SIDES
from tiengine.recording.gap_watch import GapWatch
from tiengine.recording.step_oscillation import WINDOW, StepOscillation
from tiengine.result_files.channels import DOFS
from tiengine.result_files.events import EVENT_KINDS, Event
from tiengine.scenario.event_policy import Events
from tiengine.scenario.tables import Track
from tiengine.vehicle.train import static_wheel_loads

__all__ = ["Guard", "Watch"]

EVERY = 1e-3
"""Simulated time between two checks [s]."""

LIMITS = (1e4, 1e3, 1e7)
"""Largest coordinate [m, rad], rate and acceleration of a sound run: a wheel flat accelerates a slab by about
1e3 m/s^2. Coordinates grow to large values in sound runs too: a wheelset whose wheels do not roll on r0 turns against
V/r0 by some hundredths of a radian a second, 10 rad in 20 km."""

STEEPEST = 0.98
"""A flange climbs where its slope falls below this part of the steepest; the straight flank varies by 1 %."""

FORCES = [at.VERTICAL_FORCE, at.LATERAL_FORCE]
"""Columns of the wheels' record that are looked at for an oscillation."""

QUIET = 1.0
"""A wheel's event is not reported again within this time [s]."""


@dataclass(eq=False)
class Watch:
    """Memory of the guard from check to check; a checkpoint saves it.

    Attributes:
        lifted: How long each wheel has carried nothing [s], shape (B, W, 2).
        last: Time at which each kind of event was last found at a wheel [s], shape (kinds, B, W, 2).
        ended: Whether the end of the measured track was passed, shape (B,).
        closed: Whether each gap has closed before, shape (B, gaps).
        oscillation: Of the forces at the step's own frequency.
    """

    lifted: NDArray[np.float64]
    last: NDArray[np.float64]
    ended: NDArray[np.bool_]
    closed: NDArray[np.bool_]
    oscillation: StepOscillation

    @classmethod
    def fresh(cls, trains: int, wheelsets: int, gaps: int = 0) -> Watch:
        """Memory before the first check."""
        wheels = (trains, wheelsets, 2)
        return cls(
            lifted=np.zeros(wheels),
            last=np.full((5, *wheels), -np.inf),
            ended=np.zeros(trains, dtype=np.bool_),
            closed=np.zeros((trains, gaps), dtype=np.bool_),
            oscillation=StepOscillation.none(trains, wheelsets),
        )


@dataclass(eq=False)
class Guard:
    """Checks the state of trains between steps.

    Attributes:
        stepper: Its state is checked.
        policy: Consequences of each event, from the scenario.
        track_end: Chainage where each train's measured track ends [m], infinite without, shape (B,).
        watch: Memory from check to check.
        gaps: Gaps that may close; None if there are none.
        found: Events since they were last taken, by place of the train.
        stopped: Number of the step in which a train was stopped, by its place.
        called: Whether the stepper looks at the state itself and calls for a check where it is needed.
    """

    stepper: Stepper
    policy: Events
    track_end: NDArray[np.float64]
    watch: Watch
    gaps: GapWatch | None = None
    found: dict[int, list[Event]] = field(default_factory=dict)
    stopped: dict[int, int] = field(default_factory=dict)
    called: bool = False

    @classmethod
    def watching(
        cls, stepper: Stepper, policy: Events, track_end: NDArray[np.float64], track: Track | None = None
    ) -> Guard:
        """New guard, called by the stepper after each step.

        Args:
            stepper: Is watched.
            policy: Consequences of each event, from the scenario.
            track_end: See the class.
            track: Of the scenario, whose gaps are watched.
        """
        trains, wheelsets, _ = stepper.state.normal_force.shape
        gaps = None if track is None else GapWatch.of(track, stepper)
        watched = gaps if gaps is not None and gaps.count else None
        watch = Watch.fresh(trains, wheelsets, 0 if watched is None else watched.count)
        guard = cls(stepper, policy, track_end, watch, watched)
        guard.called = stepper.look_out(guard.lookout)
        stepper.watch("guards", guard.watch_step, due=guard.due)
        return guard

    def __post_init__(self) -> None:
        """Keep what every check needs."""
        self.state, ingredients = self.stepper.state, self.stepper.ingredients
        self._dt, self._train = ingredients.newmark.dt, ingredients.train
        self._done, self._position = 0, np.zeros(0)
        self._flying = True  # until checked: a checkpoint may have brought wheels in flight
        self._checked = -1
        self.every = max(int(EVERY / self._dt + 1e-9), 1)
        self._look_every = StepOscillation.interval(self._dt)
        self._shift, self._normal = self.state.relative_shift, self.state.normal_force
        self._tilt = self.state.relative_tilt
        self._static_load = float(static_wheel_loads(self._train).max())
        table, contacts = ingredients.contact, ingredients.contacts
        # the first node and the last are beyond the range
        self._steepest_tilt, self._innermost = -table.alpha_min - table.dalpha, table.u_min + table.du
        self._climbs = [climbing_shift(each) for each in ((table,) if contacts is None else contacts.tables)]
        self._least_climb = min(self._climbs)
        self._table = np.zeros((len(self._train.wheelset_x), 2)) if contacts is None else contacts.number
        self._derailed = table.u_min + (table.values.shape[0] - 2) * table.du
        self._wheel_front = float(self._train.wheelset_x.max())
        self._nearest_end = float(self.track_end.min())
        squares = [limit * limit for limit in LIMITS]
        limits = np.array([*squares, self._least_climb, self._steepest_tilt, self._innermost])
        self.lookout = Lookout(self.every, limits, self.check_row)

    def load(self, done: int, position: NDArray[np.float64]) -> None:
        """Take the numbers and places of the coming steps.

        Args:
            done: Steps before them.
            position: Chainage of the first vehicle's centre at the end of each [m], shape (steps,).
        """
        self._done, self._position = done, position
        self.lookout.steps_before = done
        self._set_always()

    def _set_always(self) -> None:
        """Let a check follow every look while wheels fly, gaps may close, or a measured track may end in this chunk."""
        ends = bool(self._position[-1:].max(initial=-np.inf) + self._wheel_front > self._nearest_end)
        self.lookout.always = self._flying or ends or self.gaps is not None

    def check_row(self, i: int) -> None:
        """Check the state after the step in row ``i`` of the chunk."""
        self.check(self._done + i + 1, float(self._position[i]))
        self._set_always()

    def watch_step(self) -> None:
        """Check at the end of a step if it is time to, and after the last of a chunk."""
        i = self.stepper.rows.step
        step, position = self._done + i + 1, float(self._position[i])
        if (i + 1) % self._look_every == 0:
            self._oscillates(i, step * self._dt, position)
        if (step % self.every == 0 or i + 1 == len(self._position)) and step != self._checked:
            self.check(step, position)

    def due(self, plan: Plan) -> Flags:
        """Steps after which the state is checked, or the forces of the last ones are looked at."""
        due: Flags = ((plan.step + 1) % self._look_every == 0) | (plan.step + 1 == len(self._position))
        if not self.called:
            due |= (self._done + plan.step + 1) % self.every == 0
        return due

    def check(self, step: int, position: float) -> None:
        """Check the state after a step.

        Args:
            step: Its number, from 1.
            position: Chainage of the first vehicle's centre [m].
        """
        time, self._checked = step * self._dt, step
        squares = zip(self.state.squares(), LIMITS, strict=True)
        if not all(square < limit * limit for square, limit in squares):  # not a number is not less, either
            self._runaway(step, time, position)
        if not self._normal.min() > 0.0:
            self._lifts(step, time, position)
        elif self._flying:
            self.watch.lifted[:], self._flying = 0.0, False
        if self._shift.max() > self._least_climb:
            self._climb(step, time, position)
        if np.abs(self._tilt).max() > self._steepest_tilt or self._shift.min() < self._innermost:
            self._leaves_table(step, time, position)
        if self.gaps is not None:
            for train, side, words in self.gaps.fresh(self.gaps.closed(), self.watch.closed):
                stops = self.policy.gap_closes == "stop"
                self._report(train, step, Event("gap_closes", time, position, 0, side, words, stops))
        if position + self._wheel_front > self._nearest_end:
            self._track_ends(step, time, position)

    def _lifts(self, step: int, time: float, position: float) -> None:
        """Report wheels that have carried nothing for too long."""
        lifted, self._flying = self.watch.lifted, True
        lifted += self.every * self._dt
        lifted[self._normal > 0.0] = 0.0
        lasting = lifted >= self.policy.wheel_lift_time
        self._report_wheels(2, lasting, step, time, position, f"off the rail for {self.policy.wheel_lift_time:g} s")

    def _climb(self, step: int, time: float, position: float) -> None:
        """Report wheels beyond the steepest part of their flange, or beyond their profile."""
        touching = self._normal > 0.0
        for table, limit in enumerate(self._climbs):
            climbs = (self._shift > limit) & touching & (self._table == table)
            words = f"climbs on its flange: lateral shift beyond {limit * 1e3:.1f} mm"
            self._report_wheels(1, climbs, step, time, position, words)
        words = f"derailed: lateral shift beyond {self._derailed * 1e3:.1f} mm on the flange side"
        self._report_wheels(0, self._shift > self._derailed, step, time, position, words)

    def _leaves_table(self, step: int, time: float, position: float) -> None:
        """Report wheels that keep the geometry of the table's edge."""
        touching = self._normal > 0.0
        words = (
            f"keeps the contact geometry of its table's edge: tilt beyond {self._steepest_tilt * 1e3:.3g} mrad or shift"
            f" below {self._innermost * 1e3:.1f} mm"
        )
        beyond = (np.abs(self._tilt) > self._steepest_tilt) | (self._shift < self._innermost)
        self._report_wheels(4, touching & beyond, step, time, position, words)

    def _oscillates(self, i: int, time: float, position: float) -> None:
        """Report wheels whose forces alternate from step to step, up to row ``i`` of the chunk."""
        samples = self.stepper.chunk.wheel[:, i + 1 - WINDOW : i + 1, ..., FORCES]
        found, size = self.watch.oscillation.look(samples, self._look_every * self._dt, self._static_load)
        if not found.any():
            return
        words = (
            f"forces alternate from step to step by {1e-3 * size[found].max():.2g} kN: the step is unstable; try"
            f" numerics.time_step = {0.5 * self._dt:g} or more passes"
        )
        self._report_wheels(3, found, self._done + i + 1, time, position, words)

    def take(self) -> dict[int, list[Event]]:
        """Events since the last call, by place of the train."""
        found, self.found = self.found, {}
        return found

    def _report(self, train: int, step: int, event: Event) -> None:
        """Keep an event of a train that still runs."""
        if train in self.stopped:
            return
        self.found.setdefault(train, []).append(event)
        if event.stops:
            self.stopped[train] = step

    def _report_wheels(
        self, kind: int, affected: NDArray[np.bool_], step: int, time: float, position: float, words: str
    ) -> None:
        """Report wheels with an event, each when it begins."""
        name, last = EVENT_KINDS[kind], self.watch.last[kind]
        stops = getattr(self.policy, name) == "stop"
        for train, wheelset, side in np.argwhere(affected & (last < time - QUIET)):
            sentence = f"wheelset {wheelset + 1} {SIDES[side]} {words}"
            self._report(int(train), step, Event(name, time, position, int(wheelset) + 1, SIDES[side], sentence, stops))
        last[affected] = time

    def _track_ends(self, step: int, time: float, position: float) -> None:
        for train in np.flatnonzero((position + self._wheel_front > self.track_end) & ~self.watch.ended):
            self.watch.ended[train] = True
            words = f"the measured track ends at chainage {self.track_end[train]:.2f} m; it is smooth from there"
            stops = self.policy.track_end == "stop"
            self._report(int(train), step, Event("track_end", time, position, 0, "", words, stops))

    def _runaway(self, step: int, time: float, position: float) -> None:
        """Report the trains whose numbers have run away, and the part of them that was first."""
        for train in range(self.state.trains):
            found = self._excess(train)
            worst = max(excess for excess, _ in found)
            if worst < 1.0:
                continue
            first = [words for excess, words in found if excess == worst]  # several, once all are not-a-numbers
            what = first[0] if len(first) == 1 else f"one of {', '.join(first)}"
            shorter = 0.5 * self._dt
            words = (
                f"numbers ran away, first of {what}; try numerics.time_step = {shorter:g}, more passes, or look at the"
                " irregularity there"
            )
            self._report(train, step, Event("runaway", time, position, 0, "", words, True))
            self.state.clear(train)

    def _excess(self, train: int) -> list[tuple[float, str]]:
        """Largest coordinate over its limit, and its words, of every part of a train."""
        found = []
        with np.errstate(over="ignore", invalid="ignore"):
            for part in PARTS:
                motion = zip(self.state.part(train, part), LIMITS, strict=True)
                rows = np.stack([np.abs(row) / limit for row, limit in motion])
                rows[~np.isfinite(rows)] = np.inf
                place = np.unravel_index(int(rows.argmax()), rows.shape)[1:]
                found.append((float(rows.max()), self._words(part, [int(i) for i in place])))
        return found

    def _words(self, part: str, place: list[int]) -> str:
        """Describe a coordinate."""
        if part == "slabs":
            slots, rear = self.state.slots, self.state.first_slab
            return f"slab {rear + (place[0] - rear) % slots}"
        if part == "vehicles":
            bodies = self._train.body_names
            body, dof = divmod(place[0], len(DOFS))
            return f"body {bodies[body]} ({DOFS[dof]})" if body < len(bodies) else "a damper in series with its spring"
        return f"the {SIDES[place[0]]} rail, {part}ly"


def climbing_shift(table: ContactTable) -> float:
    """Lateral shift at which a wheel without tilt has passed the steepest part of its flange [m].

    Args:
        table: Contact geometry.
    """
    slope = table.values[:, table.values.shape[1] // 2, at.TAN_GAMMA :: at.N_TABLE].max(axis=1)
    steep = np.flatnonzero(slope >= STEEPEST * slope.max())
    return float(table.u_min + min(int(steep[-1]) + 1, len(slope) - 2) * table.du)
