"""Bodies and the springs, dampers and stops between their points (MODEL §4).

A vehicle is a list of rigid bodies with the motions (y, z, roll, pitch, yaw) and of connectors. A connector
joins a point of body ``a`` to a point of body ``b``. Points are given in vehicle coordinates: x forward from its
centre, y right from the centre line, height above the rail. With (X, Y, Z) the same point relative to the
centre of gravity of the body (Z down), its displacement is

    u_x = Z pitch - Y yaw,   u_y = y + X yaw - Z roll,   u_z = z - X pitch + Y roll;

an elongation is the displacement at ``a`` minus that at ``b``.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tiengine.parameters.quantity import Name, Params, Q

__all__ = [
    "Body",
    "Damper",
    "Direction",
    "Joint",
    "SeriesSprings",
    "Spring",
    "Stop",
    "VehicleClass",
    "check_damper",
    "check_stop",
    "end_motion",
    "extend_table",
    "table_force",
]

Length = Annotated[float, Q("m")]
Point = tuple[Length, Length, Length]
Stiffness = Annotated[float, Q("N/m", ge=0)]
Damping = Annotated[float, Q("N s/m", ge=0)]
RollStiffness = Annotated[float, Q("N m/rad", ge=0)]
Forces = tuple[Annotated[float, Q("N", ge=0)], ...]
Direction = Literal["x", "y", "z"]
SeriesSprings = Annotated[
    bool, Field(description="springs in series with dampers (k_series) are modelled, with internal states")
]


VehicleClass = Literal["coach", "locomotive", "freight"]
"""Classes of vehicles for which the standards set different limits; multiple units count as coaches."""


class Body(Params):
    """Rigid body with its principal axes along x, y, z; a wheelset spins."""

    name: Annotated[str, Field(description="name by which connectors refer to it")]
    mass: Annotated[float, Q("kg", "mass", gt=0)]
    Jx: Annotated[float, Q("kg m^2", "roll inertia", gt=0)]
    Jy: Annotated[float, Q("kg m^2", "pitch inertia; of a wheelset its spin inertia", gt=0)]
    Jz: Annotated[float, Q("kg m^2", "yaw inertia", gt=0)]
    x: Annotated[float, Q("m", "centre of gravity, forward of the vehicle's centre")] = 0.0
    y: Annotated[float, Q("m", "centre of gravity, right of the centre line")] = 0.0
    height: Annotated[float, Q("m", "centre of gravity above the rail", ge=0)]
    wheelset: Annotated[bool, Field(description="rolls on the rails and spins")] = False

    def local(self, point: Point) -> tuple[float, float, float]:
        """(X, Y, Z) from the centre of gravity to a point of the vehicle (x, y, height) [m]."""
        return point[0] - self.x, point[1] - self.y, self.height - point[2]


class Joint(Params):
    """Ends of a connector: two bodies and a point of each (x, y, height above the rail) [m]."""

    name: Name = ""
    a: Annotated[str, Field(description="one body")]
    b: Annotated[str, Field(description="the other body")]
    point_a: Annotated[Point, Field(description="attachment to a: x, y, height above the rail")]
    point_b: Annotated[Point, Field(description="attachment to b: x, y, height above the rail")]


class Spring(Joint):
    """Linear spring and damper in parallel, in the three directions, with bending and torsion.

    Attributes:
        kx: Longitudinal stiffness.
        ky: Lateral stiffness.
        kz: Vertical stiffness.
        cx: Longitudinal damping.
        cy: Lateral damping.
        cz: Vertical damping.
        k_roll: Stiffness against roll between the bodies.
        k_pitch: Stiffness against pitch.
        k_yaw: Stiffness against yaw.
    """

    kx: Stiffness = 0.0
    ky: Stiffness = 0.0
    kz: Stiffness = 0.0
    cx: Damping = 0.0
    cy: Damping = 0.0
    cz: Damping = 0.0
    k_roll: RollStiffness = 0.0
    k_pitch: RollStiffness = 0.0
    k_yaw: RollStiffness = 0.0

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Stiffness of (u_x, u_y, u_z, roll, pitch, yaw) [N/m, N m/rad], shape (6,)."""
        return np.array([self.kx, self.ky, self.kz, self.k_roll, self.k_pitch, self.k_yaw])

    @property
    def damping(self) -> NDArray[np.float64]:
        """Damping of the same elongations [N s/m], shape (6,)."""
        return np.array([self.cx, self.cy, self.cz, 0.0, 0.0, 0.0])


class Damper(Joint):
    """Damper along one direction, odd in its rate, optionally in series with a spring.

    Either slopes ``c[i]`` from the rates ``v[i]`` on (``v[0] = 0``), or points (v, F) from (0, 0) on. Beyond
    the last point the last slope continues: repeat the last force to saturate.

    Attributes:
        direction: Direction of its force.
        v: Rates.
        c: Slopes from these rates on.
        F: Forces at these rates.
        k_series: Stiffness of the spring in series, 0 for none.
    """

    direction: Direction
    v: tuple[Annotated[float, Q("m/s", ge=0)], ...]
    c: tuple[Damping, ...] = ()
    F: Forces = ()
    k_series: Stiffness = 0.0

    @model_validator(mode="after")
    def _check(self) -> Damper:
        check_damper(self.v, self.c, self.F)
        return self

    @property
    def table(self) -> NDArray[np.float64]:
        """Points (rate [m/s], force [N]) for rates from zero on, shape (n, 2), n >= 2."""
        if self.F:
            return np.column_stack([self.v, self.F])
        v = np.append(self.v, 2.0 * self.v[-1] or 1.0)
        return np.column_stack([v, np.append(0.0, np.cumsum(np.diff(v) * self.c))])


class Stop(Joint):
    """Spring along one direction, odd in its elongation, by points (x, F); no force below a gap x[0] > 0.

    Beyond the last point the last slope continues.

    Attributes:
        direction: Direction of its force.
        x: Elongations.
        F: Forces at these elongations.
    """

    direction: Direction
    x: tuple[Annotated[float, Q("m", ge=0)], ...]
    F: Forces

    @model_validator(mode="after")
    def _check(self) -> Stop:
        check_stop(self.x, self.F)
        return self

    @property
    def table(self) -> NDArray[np.float64]:
        """Points (elongation [m], force [N]) for elongations from zero on, shape (n, 2), n >= 2."""
        points = np.column_stack([self.x, self.F])
        return points if self.x[0] == 0.0 else np.vstack([np.zeros((1, 2)), points])


def check_damper(v: tuple[float, ...], c: tuple[float, ...], F: tuple[float, ...]) -> None:
    """Refuse a damper table that does not rise from zero.

    Args:
        v: Rates [m/s].
        c: Slopes from those rates on [N s/m], or empty.
        F: Forces at those rates [N], or empty.

    Raises:
        ValueError: The rule that is broken.
    """
    if bool(c) == bool(F):
        raise ValueError("must have either slopes c or forces F")
    _check_points("v", v, "F" if F else "c", F or c)
    if v[0] != 0.0 or (F and (F[0] != 0.0 or len(F) < 2)):
        raise ValueError("v must start at zero, a table of forces at (0, 0) with a second point")


def check_stop(x: tuple[float, ...], F: tuple[float, ...]) -> None:
    """Refuse a stop table that does not rise from zero force.

    Args:
        x: Elongations [m].
        F: Forces [N].

    Raises:
        ValueError: The rule that is broken.
    """
    _check_points("x", x, "F", F)
    if len(x) < 2 or F[0] != 0.0:
        raise ValueError("must have two points or more, the first of zero force")


def _check_points(key: str, values: tuple[float, ...], other: str, others: tuple[float, ...]) -> None:
    """Refuse tables of unequal length or with abscissae that do not rise."""
    if not values or len(values) != len(others):
        raise ValueError(f"{key} and {other} must have the same length, one or more")
    if any(later <= earlier for earlier, later in pairwise(values)):
        raise ValueError(f"{key} must rise from point to point")


def extend_table(table: NDArray[np.float64], points: int) -> NDArray[np.float64]:
    """Extend a force table by points on the line of its last segment.

    Args:
        table: Points (abscissa, force), shape (n, 2), n >= 2.
        points: Number of points of the result, at least n.

    Returns:
        The same curve, shape (points, 2).
    """
    step = table[-1] - table[-2]
    count = np.arange(1, points - len(table) + 1)[:, None]
    return np.vstack([table, table[-1] + count * step])


def table_force(table: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Odd force by a table of points, its last slope going on.

    Args:
        table: Points (abscissa, force), shape (n, 2).
        q: Abscissas [m, m/s].
    """
    size = np.abs(q)
    beyond = (table[-1, 1] - table[-2, 1]) / (table[-1, 0] - table[-2, 0]) * np.maximum(size - table[-1, 0], 0.0)
    return np.asarray(np.sign(q) * (np.interp(size, table[:, 0], table[:, 1]) + beyond), np.float64)


def end_motion(body: Body, point: Point) -> NDArray[np.float64]:
    """Matrix of the motion of a point of a body, longitudinal motion included.

    A wheelset's pitch is the perturbation of its spin; axle boxes do not follow it, so its column is zero.

    Args:
        body: The body.
        point: (x, y, height) in the vehicle [m].

    Returns:
        Rows (u_x, u_y, u_z, roll, pitch, yaw), columns the body's (x, y, z, roll, pitch, yaw), shape (6, 6).
    """
    X, Y, Z = body.local(point)
    motion = np.eye(6)
    motion[:3, 3:] = [[0.0, Z, -Y], [-Z, 0.0, X], [Y, -X, 0.0]]
    if body.wheelset:
        motion[:, 4] = 0.0
    return motion
