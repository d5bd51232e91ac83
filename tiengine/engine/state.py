"""Physical quantities of a group of trains and their track, whatever trial functions and layout hold them.

Recorder, watchers, guards and checkpoints read these and no coordinates of a rail, so that another step with other
trial functions can stand in place of this one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals

__all__ = ["ACCELERATION", "DISPLACEMENT", "PARTS", "VELOCITY", "State"]

DISPLACEMENT, VELOCITY, ACCELERATION = range(3)

PARTS = ("vehicles", "vertical", "lateral", "slabs")
"""Groups of coordinates of one train: its vehicles, its rails vertically and laterally, its slabs."""


class State(ABC):
    """State at the end of the last step; B trains, W wheelsets.

    Slabs stand still on the ground. Slot i holds the slab whose index is congruent to i modulo the number of slots, so
    that a slab keeps its place in memory while the window passes.

    Attributes:
        first_seat, first_slab: Rear seat and slab of the window.
        iterations: Most Newton iterations of each wheelset since the last reset, shape (B, W).
    """

    first_seat: int
    first_slab: int
    iterations: NDArray[np.int32]

    @property
    @abstractmethod
    def trains(self) -> int:
        """Trains advanced together, B."""

    @property
    @abstractmethod
    def slots(self) -> int:
        """Slabs in memory."""

    @property
    @abstractmethod
    def normal_force(self) -> Reals:
        """Normal force of every wheel [N], shape (B, W, 2); a view that stays valid."""

    @property
    @abstractmethod
    def forces_on_rails(self) -> Reals:
        """Vertical [N], lateral [N] and roll force [N m] of every wheel on its rail, shape (B, W, 2, 3); a view."""

    @property
    @abstractmethod
    def relative_shift(self) -> Reals:
        """Outward shift of every wheel against its rail [m], shape (B, W, 2); a view that stays valid."""

    @property
    @abstractmethod
    def relative_tilt(self) -> Reals:
        """Outward tilt of every wheel against its rail [rad], shape (B, W, 2); a view that stays valid."""

    @property
    @abstractmethod
    def seat_forces(self) -> Reals:
        """Forces of the rails on the seats: down [N], to the right [N] and roll moment about the rail's axis [N m].

        Shape (B, 2 rails, 3, seats of the window from the rear).
        """

    def widen(self, smallest: Reals, largest: Reals) -> None:
        """Widen extremes in place by the seats' forces of the last step, or of all steps since the last call.

        A recorder calls it after those steps at which :attr:`Stepper.seat_extremes_due` says so.

        Args:
            smallest: Shape as :attr:`seat_forces`.
            largest: Same shape.
        """
        forces = self.seat_forces
        np.minimum(smallest, forces, out=smallest)
        np.maximum(largest, forces, out=largest)

    @abstractmethod
    def body_motion(self, kind: int) -> Reals:
        """Displacement, velocity or acceleration of the bodies, shape (B, 5 bodies) [m, rad and their rates].

        Args:
            kind: ``DISPLACEMENT``, ``VELOCITY`` or ``ACCELERATION``.
        """

    @abstractmethod
    def slab_motion(self, kind: int) -> Reals:
        """Displacement, velocity or acceleration of the slabs' coordinates, shape (B, slots, dofs).

        The coordinates are those of the plate's nodes (:mod:`tiengine.track.plate_shapes`), then lateral displacement
        and yaw.

        Args:
            kind: ``DISPLACEMENT``, ``VELOCITY`` or ``ACCELERATION``.
        """

    @abstractmethod
    def rail_motion(self, side: int, s: float) -> Reals:
        """Motion of a rail at a place that moves with the window.

        Args:
            side: 0 left, 1 right.
            s: Place in the window [m].

        Returns:
            Shape (2, 3, 3, B): lateral and vertical; displacement [m], its first and second rate at constant s; the
            value, its first and its second derivative along s.
        """

    @abstractmethod
    def rail_deflection(self, s: Reals) -> Callable[[], Reals]:
        """Bind the vertical deflection of both rails to fixed places in the window.

        Args:
            s: Places [m], shape (points,).

        Returns:
            Call that reads the deflection [m], shape (B, 2, points).
        """

    @abstractmethod
    def squares(self) -> tuple[float, float, float]:
        """Sums of the squares of all coordinates, of their rates and of their second rates; not finite if one is."""

    @abstractmethod
    def part(self, train: int, name: str) -> Reals:
        """Coordinates of a part of one train, and their first and second rates.

        Args:
            train: Its place.
            name: One of ``PARTS``.

        Returns:
            Shape (3, coordinates) for vehicles, (3, 2 rails, coordinates), (3, slots, coordinates) for slabs.
        """

    @abstractmethod
    def put(self, kind: int, name: str, values: Reals) -> None:
        """Fill the coordinates of a part of all trains, or their rates.

        Args:
            kind: ``DISPLACEMENT``, ``VELOCITY`` or ``ACCELERATION``.
            name: One of ``PARTS``.
            values: As :meth:`part` of one kind, with the trains as the first index or the same for all.
        """

    @abstractmethod
    def put_contact(self, contact: Reals, local: Reals, wheelset: Reals, rail: Reals) -> None:
        """Take over contact states and forces, from which the next solve starts.

        Args:
            contact: Contact states, shape (1 or B, W, 2, N_CONTACT).
            local: N, Fx, Fy, Mz on the wheels, shape (..., W, 2, 4).
            wheelset: Forces on y, z, roll, pitch, yaw, shape (..., W, 5).
            rail: Forces on w, v, theta_x, shape (..., W, 2, 3).
        """

    @abstractmethod
    def enter(self, first_seat: int, first_slab: int) -> None:
        """Move the window on to its rear seat and slab: drop the slabs that it leaves, bring new ones in at rest.

        Args:
            first_seat: Index of the rear seat.
            first_slab: Index of the rear slab.
        """

    @abstractmethod
    def clear(self, train: int) -> None:
        """Take a train whose numbers ran away out of the way: nothing moves, no forces."""

    @abstractmethod
    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """All arrays that the coming steps depend on, by name; written in place to restore a checkpoint."""
