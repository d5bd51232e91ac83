"""Equations of motion of a train including the longitudinal motion of its bodies (MODEL §4).

Every body has six motions here (x, y, z, roll, pitch, yaw); :mod:`tiengine.vehicle.train` eliminates x. Each
connector contributes B' k B and B' c B with B its elongation by the motions. A damper's initial slope and a
stop's are part of C and K; the kernel of :mod:`tiengine.kernels.suspension` adds the deviation of its table from
that slope.

Longitudinal inertia. Bodies have no longitudinal coordinate, but under V(t) their inertia forces -m Vdot go
to the wheelsets through the springs. Let x be the bodies' small longitudinal motions relative to the
wheelsets. Quasi-statically K_xx x = -m Vdot - K_xu u. The part of x due to Vdot pushes the coordinates u with
-K_ux x = K_ux K_xx^-1 m Vdot: moments that lift the nose when speed grows and lower it in braking. Each
spring acts on both of its bodies at the mean height of its ends, so that force and reaction have no resultant
moment. The part of x due to u is neglected, as in K (no longitudinal degree of freedom).

Spin. A wheelset's pitch is measured from its spin -V/r0, J (pitch'' - Vdot/r0) = moment: hence +J Vdot/r0.

Effort. Brakes and motors turn the wheelsets (``"wheels"``): every wheelset gets the torque (m_s r0 + J/r0) Vdot against
its pitch, with m_s its equal share of the mass of the vehicle, and the bodies that guide it the reaction, in
proportion to their longitudinal stiffness. The wheelset then rolls at the creepage at which the creep forces of its
wheels are m_s Vdot. Or the force acts at the axles (``"axles"``), as from a linear motor or a coupler at their height:
creep forces carry only the spin of the wheelsets. The moments of the two about the rail differ by m_s r0 + J/r0 per
wheelset.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.errors import InputError
from tiengine.vehicle.connector import Body, Damper, Direction, Joint, Spring, end_motion
from tiengine.vehicle.coupling import Coupling, placed
from tiengine.vehicle.preload import LoadedSpring
from tiengine.vehicle.vehicle import Vehicle

__all__ = ["Assembly", "Effort", "Element", "PlacedBody", "grade_push", "longitudinal_push", "spin_push"]

_AXES: dict[Direction, int] = {"x": 0, "y": 1, "z": 2}
_FORCE_OF_RATE, _FORCE_OF_ELONGATION = 0, 1


Effort = Literal["wheels", "axles"]
"""Where the force that changes the speed acts."""


class PlacedBody(NamedTuple):
    """Body in the train: unique name, number of its vehicle, x from the first vehicle's centre [m]."""

    name: str
    vehicle: int
    x: float
    body: Body


class Element(NamedTuple):
    """Nonlinear element: name, columns and row of its elongation, kind, odd table, whether it lies between cars."""

    name: str
    columns: NDArray[np.intp]
    row: NDArray[np.float64]
    kind: int
    table: NDArray[np.float64]
    between_cars: bool = False

    @property
    def slope(self) -> float:
        """Initial slope of the table, part of C or K but for elements between cars [N s/m, N/m]."""
        return float(self.table[1, 1] / self.table[1, 0])


class Assembly:
    """Matrices over six motions per body, followed by the internal states of series springs.

    Attributes:
        M: Mass, shape (size, size).
        C: Damping, likewise.
        K: Stiffness, likewise.
        K_push: Stiffness of the longitudinal springs with both ends at their middle height, likewise.
        elements: Nonlinear elements.
        springs: Springs, for what a leaning train adds.
    """

    def __init__(self, bodies: Sequence[PlacedBody], internal: int) -> None:
        """Initialise with the inertia of the bodies.

        Args:
            bodies: In the order of the coordinates.
            internal: Number of internal states of series springs.
        """
        self.bodies = bodies
        self.first_internal = self._next_internal = 6 * len(bodies)
        self.size = self.first_internal + internal
        self.M, self.C, self.K, self.K_push = (np.zeros((self.size, self.size)) for _ in range(4))
        self.elements: list[Element] = []
        self.springs: list[LoadedSpring] = []
        for i, (_, _, _, body) in enumerate(bodies):
            own = np.arange(6 * i, 6 * i + 6)
            self.M[own, own] = (body.mass, body.mass, body.mass, body.Jx, body.Jy, body.Jz)

    def add_vehicle(self, vehicle: Vehicle, first: int, series: bool, prefix: str) -> None:
        """Add the connectors of a vehicle.

        Args:
            vehicle: The vehicle.
            first: Its first body.
            series: Whether dampers with ``k_series`` get an internal state.
            prefix: Prefix of the names of its elements.
        """
        index = {body.name: first + i for i, body in enumerate(vehicle.body)}
        for spring in vehicle.spring:
            columns, B = self._elongation(spring, index)
            self.K[np.ix_(columns, columns)] += B.T * spring.stiffness @ B
            self.C[np.ix_(columns, columns)] += B.T * spring.damping @ B
            _, level = self._elongation(_levelled(spring), index)
            _add(self.K_push, columns, level[0], spring.kx)
            ends = ((spring.a, spring.point_a), (spring.b, spring.point_b))
            Z_a, Z_b = (self.bodies[index[name]].body.local(point)[2] for name, point in ends)
            self.springs.append(LoadedSpring(columns, B, level[1], (Z_a, Z_b), spring.ky, spring.kz))
        for damper in vehicle.damper:
            columns, B = self._elongation(damper, index)
            self._add_damper(damper, prefix, columns, B[_AXES[damper.direction]], series)
        for stop in vehicle.stop:
            columns, B = self._elongation(stop, index)
            row = B[_AXES[stop.direction]]
            self._add_element(self.K, prefix + stop.name, columns, row, _FORCE_OF_ELONGATION, stop.table)

    def add_coupling(
        self,
        coupling: Coupling,
        indices: tuple[dict[str, int], dict[str, int]],
        plane: tuple[float, float],
        prefix: str,
    ) -> None:
        """Add the connectors between two vehicles, all of them as elements: C and K couple no two vehicles.

        Args:
            coupling: The coupling.
            indices: Bodies of the vehicle ahead and of the one behind, by name.
            plane: x of the coupling plane in either [m].
            prefix: Prefix of the names of its elements.
        """
        kinds = {_FORCE_OF_ELONGATION: "stiffness", _FORCE_OF_RATE: "damping"}
        for spring in coupling.spring:
            columns, B = self._elongation(placed(spring, *plane), *indices)
            for kind, numbers in kinds.items():
                for row, value in zip(B, getattr(spring, numbers), strict=True):
                    if value > 0.0:
                        table = np.array([[0.0, 0.0], [1.0, value]])
                        self.elements.append(Element(prefix + spring.name, columns, row, kind, table, True))
        for damper in coupling.damper:
            columns, B = self._elongation(placed(damper, *plane), *indices)
            row = B[_AXES[damper.direction]]
            self.elements.append(Element(prefix + damper.name, columns, row, _FORCE_OF_RATE, damper.table, True))
        for stop in coupling.stop:
            columns, B = self._elongation(placed(stop, *plane), *indices)
            row = B[_AXES[stop.direction]]
            self.elements.append(Element(prefix + stop.name, columns, row, _FORCE_OF_ELONGATION, stop.table, True))

    def _elongation(
        self, joint: Joint, index: dict[str, int], behind: dict[str, int] | None = None
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Columns of both bodies (12,) and the derivatives of the six elongations by them (6, 12)."""
        a, b = index[joint.a], (index if behind is None else behind)[joint.b]
        columns = np.concatenate([6 * a + np.arange(6), 6 * b + np.arange(6)])
        motion_a = end_motion(self.bodies[a].body, joint.point_a)
        motion_b = end_motion(self.bodies[b].body, joint.point_b)
        return columns, np.hstack([motion_a, -motion_b])

    def _add_damper(
        self, damper: Damper, prefix: str, columns: NDArray[np.intp], row: NDArray[np.float64], series: bool
    ) -> None:
        """Add a damper over the elongation or, behind its series spring, over an internal state s.

        The spring carries k (elongation - s), the damper F(s'); s has no mass.
        """
        if series and damper.k_series > 0.0:
            s = self._next_internal
            self._next_internal += 1
            _add(self.K, np.append(columns, s), np.append(row, -1.0), damper.k_series)
            columns, row = np.array([s]), np.ones(1)
        self._add_element(self.C, prefix + damper.name, columns, row, _FORCE_OF_RATE, damper.table)

    def _add_element(
        self,
        matrix: NDArray[np.float64],
        name: str,
        columns: NDArray[np.intp],
        row: NDArray[np.float64],
        kind: int,
        table: NDArray[np.float64],
    ) -> None:
        """Add the initial slope to the matrix, and an element unless the law is one straight line."""
        element = Element(name, columns, row, kind, table)
        _add(matrix, columns, row, element.slope)
        if len(table) > 2:
            self.elements.append(element)


def _levelled(spring: Spring) -> Spring:
    """Copy of the spring with both ends at their mean height."""
    height = 0.5 * (spring.point_a[2] + spring.point_b[2])
    ends = {"point_a": (*spring.point_a[:2], height), "point_b": (*spring.point_b[:2], height)}
    return spring.model_copy(update=ends)


def _add(matrix: NDArray[np.float64], columns: NDArray[np.intp], row: NDArray[np.float64], value: float) -> None:
    """Add value row' row at the columns."""
    matrix[np.ix_(columns, columns)] += value * np.outer(row, row)


def longitudinal_push(full: Assembly) -> NDArray[np.float64]:
    """Compute K_ux K_xx^-1 m, the force of the longitudinal inertia of the bodies per unit Vdot.

    Args:
        full: The train.

    Returns:
        Generalised force [kg, kg m] on every motion, zero on the longitudinal ones, shape (size,).

    Raises:
        InputError: No longitudinal spring transmits the inertia of a body to the wheelsets.
    """
    sprung, mass = _sprung(full)
    return _pushed(full, sprung, mass[:, None])[:, 0]


def _sprung(full: Assembly) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Longitudinal motions of the bodies that are not wheelsets, and their masses."""
    sprung = np.array([6 * i for i, placed in enumerate(full.bodies) if not placed.body.wheelset], dtype=np.intp)
    return sprung, np.diag(full.M)[sprung]


def _pushed(full: Assembly, sprung: NDArray[np.intp], mass: NDArray[np.float64]) -> NDArray[np.float64]:
    """K_ux K_xx^-1 m for several columns m, shape (size, columns)."""
    K_xx = full.K_push[np.ix_(sprung, sprung)]
    x = np.linalg.lstsq(K_xx, mass, rcond=None)[0] if len(sprung) else mass
    residual = np.abs(K_xx @ x - mass).max(axis=1, initial=0.0)
    if (residual > 1e-6 * mass.max(initial=0.0)).any():
        name = full.bodies[sprung[np.argmax(residual)] // 6].name
        raise InputError(f"{name}: no longitudinal spring (kx) transmits its inertia to the wheelsets")
    push = full.K_push[:, sprung] @ x
    push[0 : full.first_internal : 6] = 0.0
    return np.asarray(push, dtype=np.float64)


def grade_push(full: Assembly, vehicles: Sequence[Vehicle], effort: str) -> NDArray[np.float64]:
    """Compute the force of gravity along the track on every motion per unit g sin(gradient) at each body.

    It acts as the inertia of a growing speed does, except on the wheelsets' spin: bodies push the coordinates through
    their longitudinal springs; with the effort at the wheels every wheelset of a vehicle gets its share of the torque
    that holds the speed.

    Args:
        full: The train.
        vehicles: Its vehicles.
        effort: ``"axles"`` or ``"wheels"``.

    Returns:
        Generalised forces [kg, kg m], shape (size, bodies).
    """
    push = np.zeros((full.size, len(full.bodies)))
    sprung, mass = _sprung(full)
    push[:, sprung // 6] = _pushed(full, sprung, np.diag(mass))
    if effort == "wheels":
        for i, (_, k, _, body) in enumerate(full.bodies):
            if not body.wheelset:
                continue
            own = np.array([other.body.mass if other.vehicle == k else 0.0 for other in full.bodies])
            torque = own / len(vehicles[k].axle_positions) * vehicles[k].wheel_radius
            push[6 * i + 4] -= torque
            push[4 : full.first_internal : 6] += np.outer(_guides(full, i), torque)
    return push


def spin_push(full: Assembly, vehicles: Sequence[Vehicle], effort: str) -> NDArray[np.float64]:
    """Compute pitch moments per unit Vdot on wheelsets and, with the effort at the wheels, on their frames.

    Args:
        full: The train.
        vehicles: Its vehicles.
        effort: ``"axles"`` or ``"wheels"``.

    Returns:
        Generalised force [kg m] on every motion, shape (size,).

    Raises:
        InputError: Unknown effort.
    """
    if effort not in ("axles", "wheels"):
        raise InputError(f"train.effort = {effort!r}: must be 'axles' or 'wheels'")
    push = np.zeros(full.size)
    for i, (_, k, _, body) in enumerate(full.bodies):
        if not body.wheelset:
            continue
        r0 = vehicles[k].wheel_radius
        push[6 * i + 4] += body.Jy / r0
        if effort == "wheels":
            torque = vehicles[k].mass / len(vehicles[k].axle_positions) * r0 + body.Jy / r0
            push[6 * i + 4] -= torque
            push[4 : full.first_internal : 6] += torque * _guides(full, i)
    return push


def _guides(full: Assembly, wheelset: int) -> NDArray[np.float64]:
    """Shares of the bodies in guiding a wheelset: those of their longitudinal springs to it, shape (bodies,)."""
    stiffness = np.maximum(-full.K_push[6 * wheelset, 0 : full.first_internal : 6], 0.0)
    return np.asarray(stiffness / stiffness.sum(), dtype=np.float64)
