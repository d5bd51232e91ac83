"""Ingredients of a model: parts of track and train, numerics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.table import ContactTable
from tiengine.contact.wheel_contacts import WheelContacts
from tiengine.irregularity.wheel_shapes import WheelTables
from tiengine.kernels import layout as at
from tiengine.model.base_motion_loads import BaseMotionLoads
from tiengine.model.newmark import Newmark
from tiengine.parameters.arrays import Reals
from tiengine.track.dead_state import DeadState
from tiengine.track.fastening import Fastening, seat_count
from tiengine.track.knots import Grading, graded_knots
from tiengine.track.mortar import Mortar
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.sines import Sines
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices
from tiengine.track.splines import Splines
from tiengine.vehicle.given_loads import GivenLoads, LoadSource, sum_of_loads
from tiengine.vehicle.train import TrainModel, centre_in_window

__all__ = ["Ingredients", "SlabDesigns"]


@dataclass(frozen=True)
class SlabDesigns:
    """The different slabs of a track: sound ones, and those with voids or failed fastenings.

    Attributes:
        matrices: Matrices of each design, the sound one first.
        seat_scale: Factors of the fastenings on each, shape (designs, seats per slab, 2).
        of_slab: Design of the slabs (by index along the track) that are not sound.
    """

    matrices: tuple[SlabMatrices, ...]
    seat_scale: NDArray[np.float64]
    of_slab: Mapping[int, int]


@dataclass(frozen=True)
class Ingredients:
    """Ingredients of a model: track, train and numerics.

    Attributes:
        rail: Rail section, the same left and right.
        fastening: Sound fastening.
        seat_factors: Factors of seats first..first+count-1, shape (count, 2).
        slab: Slab.
        mortar: Its bed.
        designs: The different slabs.
        train: Vehicles.
        contact: Contact geometry of wheel and rail; that of the first left wheel where they differ.
        contacts: Contact of every wheel where wheels or rails differ, else None.
        friction: Coefficient of friction.
        cross_level_rolls: Whether a cross level turns the railheads.
        length: Window l [m].
        modes: Sines of a rail field, N; not used by splines.
        newmark: Step and coefficients.
        passes: Passes per step.
        cover: Enough slabs for every seat of the window, or the paper's count.
        explicit_mortar: Treat the bed explicitly.
        grading: Knots of the splines; None for sines.
        local_compliance: Add the static compliance that the trial functions lack under the wheels.
        static_compliance: Add it at the seats, and between wheels and seats, as well; sines only.
        absorbing_zone: Length of the zones at the window's ends with additional springs to the ground [m]; 0 for none.
        shaped: Whether rails have shapes or wheels are out of round.
        out_of_round: Tables of wheels out of round; None where all are round.
        trains: Trains advanced together.
        given: What makes given loads of the train, beyond gravity.
        seat_plays: Gaps of seats first..first+count-1 [m], 0 where none hangs, shape (count, 2); None if none hangs.
        dead: State at rest of slabs on a bed without tension; None for slabs under their own weight alone.
    """

    rail: Rail
    fastening: Fastening
    seat_factors: Callable[[int, int], NDArray[np.float64]]
    slab: Slab
    mortar: Mortar
    designs: SlabDesigns
    train: TrainModel
    contact: ContactTable
    friction: float
    cross_level_rolls: bool
    length: float
    modes: int
    newmark: Newmark
    grading: Grading | None = None
    passes: int = 2
    cover: bool = True
    explicit_mortar: bool = False
    local_compliance: bool = False
    static_compliance: bool = False
    absorbing_zone: float = 0.0
    shaped: bool = False
    out_of_round: WheelTables | None = None
    contacts: WheelContacts | None = None
    trains: int = 1
    given: tuple[LoadSource, ...] = ()
    seat_plays: Callable[[int, int], Reals] | None = None
    dead: DeadState | None = None

    def bound_factors(self, first: int, count: int) -> Reals:
        """Factors of consecutive fastenings, 0 of those that hang: they carry nothing at rest, shape (count, 2).

        Args:
            first: Index of the first seat.
            count: Number of seats.
        """
        factors = self.seat_factors(first, count)
        return factors if self.seat_plays is None else np.where(self.seat_plays(first, count) > 0.0, 0.0, factors)

    def hanging_seats(self, first: int) -> tuple[Reals, Reals]:
        """Play of the window's seats and their springs at rest, k_v g and k_v u [N], shape (seats, 2) each; 0 if sound.

        Args:
            first: Index of the rear seat.
        """
        assert self.seat_plays is not None
        play = self.fastening.vertical_stiffness * self.seat_plays(first, self.seats)
        rest = np.zeros_like(play)
        if self.dead is not None:
            for j in np.flatnonzero((play > 0.0).any(axis=1)).tolist():
                slab, seat = divmod(first + j, self.slab.fastenings)
                rest[j] = self.dead.seat_force[self.dead.of(slab)][seat]
        return play, np.where(play > 0.0, rest, 0.0)

    def pressure_at_rest(self, slab: int) -> Reals:
        """Pressure of the bed under a slab at rest, negative where a gap is open [Pa], shape (n_el, n_q).

        Args:
            slab: Index along the track.
        """
        if self.dead is None:
            return self.designs.matrices[self.designs.of_slab.get(slab, 0)].bed_weight_pressure
        pressure: Reals = self.dead.pressure[self.dead.of(slab)]
        return pressure

    @property
    def load_sets(self) -> int:
        """Sets of given loads: 0 if there are none, 1 if all trains have the same, else one for each train."""
        return max((source.sets for source in self.given), default=0)

    def given_loads(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads | None:
        """Sum of the given loads, None if there are none; arguments as in :class:`LoadSource`."""
        return sum_of_loads(self.given, self.train, time, x, V, V_rate) if self.given else None

    @property
    def moving_ground(self) -> BaseMotionLoads | None:
        """Motion of the ground in time, None if it is at rest."""
        return next((source for source in self.given if isinstance(source, BaseMotionLoads)), None)

    @property
    def rail_loads(self) -> int:
        """Given loads of a rail in a step: on w and v of its trial functions where the ground moves, else none."""
        return 0 if self.moving_ground is None else 2 * self.functions.count

    @property
    def contact_values(self) -> Reals:
        """Contact tables of all wheels, shape (tables n_u, n_alpha, 10 patches)."""
        return self.contact.values if self.contacts is None else self.contacts.values

    @property
    def channels(self) -> int:
        """Track channels at a wheelset that the step takes."""
        return at.N_SHAPED if self.shaped else at.N_IRREGULARITY

    @property
    def slots(self) -> int:
        """Slabs in memory."""
        return self.slab.slots(self.length, self.cover)

    @property
    def seat_reach(self) -> float:
        """How far outside the window a seat's middle may stand and still act on the rails [m]."""
        return 0.0 if self.grading is None else 0.5 * self.fastening.length

    @property
    def seats(self) -> int:
        """Most seats in the window at once."""
        return seat_count(self.length + 2.0 * self.seat_reach, self.slab.fastening_pitch)

    @cached_property
    def functions(self) -> Splines | Sines:
        """Trial functions of the rails."""
        if self.grading is None:
            return Sines(self.length, self.modes)
        return Splines(graded_knots(self.length, self.wheel_s, self.grading))

    @cached_property
    def operators(self) -> RailOperators:
        """Matrices of a rail in the trial functions."""
        return RailOperators(self.rail, self.functions)

    @property
    def centre_s(self) -> float:
        """Centre of the first vehicle in the window [m]."""
        return centre_in_window(self.length, self.train.wheelset_x)

    @property
    def wheel_s(self) -> NDArray[np.float64]:
        """Wheels in the window [m], shape (W,)."""
        return self.centre_s + self.train.wheelset_x

    @property
    def dof_counts(self) -> dict[str, int]:
        """Degrees of freedom of one train: vehicles (internal states apart), rails, slabs, all."""
        vehicles, rails = self.train.n_dof, 2 * 5 * self.functions.count
        slabs = self.slots * self.designs.matrices[0].n
        return {
            "vehicles": vehicles,
            "rails": rails,
            "slabs": slabs,
            "total": vehicles + rails + slabs,
            "internal_states": self.train.n - self.train.n_dof,
        }
