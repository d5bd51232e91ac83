"""Trains: matrices of all vehicles together and the data of the suspension kernels (MODEL §4).

Coordinates: five per body (y, z, roll, pitch, yaw), body after body, vehicle after vehicle; then the internal
states of dampers in series with springs, where they are modelled. Connectors and the change of speed are
described in :mod:`tiengine.vehicle.assembly`.

Gyroscopic pair of a wheelset with spin -V/r0: roll moment -J V/r0 yaw', yaw moment +J V/r0 roll'; on the
left-hand side V C_speed, skew. Products of perturbations (pitch' yaw', pitch' roll') are dropped.

Motions without restoring force: y, z, roll and yaw of every vehicle and the spin of every wheelset. (Where
the ends of a lateral spring stand at different heights, the published equations measure its elongation along
the track's y: the car then also shifts by that height times the roll.) Pitch is not among them: without a
longitudinal coordinate the longitudinal springs resist it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import InputError
from tiengine.vehicle.assembly import Assembly, Effort, Element, PlacedBody, grade_push, longitudinal_push, spin_push
from tiengine.vehicle.connector import extend_table
from tiengine.vehicle.coupling import Coupling
from tiengine.vehicle.preload import leaning_stiffness
from tiengine.vehicle.vehicle import Vehicle

__all__ = [
    "MOTIONS",
    "TrainModel",
    "assemble",
    "centre_in_window",
    "static_wheel_loads",
    "train_centres",
    "wheelset_lag",
]

MOTIONS = ("y", "z", "roll", "pitch", "yaw")
"""Order of a body's coordinates."""

_WIDTH = 12  # columns of an element row: five of either body and two unused


@dataclass(frozen=True, eq=False, kw_only=True)
class TrainModel:
    """Constant data of a train.

    M u'' + (C + V C_speed) u' + K u = gravity + Vdot acceleration_force + elements' deviations + contact.

    Attributes:
        n_dof: Coordinates of the bodies, five each: y, z, roll, pitch, yaw.
        n: ``n_dof`` and the internal states of series springs, which come last.
        M: Mass, shape (n, n), zero rows for internal states [kg, kg m^2].
        C: Damping, symmetric, shape (n, n).
        K: Stiffness, symmetric, shape (n, n).
        C_speed: Gyroscopic matrix per unit speed, skew, shape (n, n).
        gravity: Weight [N], shape (n,).
        acceleration_force: Generalised force per unit Vdot, shape (n,).
        wheelset_dof: Coordinates of each wheelset, the leading one first, shape (n_ws, 5).
        wheelset_x: Axles relative to the first vehicle's centre, forward [m], shape (n_ws,).
        wheelset_vehicle: Vehicle of each wheelset, shape (n_ws,).
        wheel_radius: r0 [m], shape (n_ws,).
        half_spacing: b0 [m], shape (n_ws,).
        wheelset_mass: Mass [kg], shape (n_ws,).
        wheelset_spin_inertia: J about the axle [kg m^2], shape (n_ws,).
        body_names: Unique in the train, in the order of the coordinates.
        body_x: Centre of gravity relative to the first vehicle's centre, forward [m], shape (bodies,).
        body_height: Centre of gravity above the rails [m], shape (bodies,).
        body_vehicle_x: Centre of each body's vehicle relative to the first's, forward [m], shape (bodies,).
        body_inertia: Roll, pitch and yaw inertia [kg m^2], shape (bodies, 3).
        K_leaning: Change of K where the train leans, in curves, shape (n, n) (:mod:`tiengine.vehicle.preload`).
        grade_force: Generalised force per unit g sin(gradient) at each body, shape (n, bodies).
        element_index: Coordinates of each nonlinear element, unused 0, shape (n_e, 12).
        element_row: Elongation = row . u, unused 0, shape (n_e, 12).
        element_kind: 0 force of the rate, 1 force of the elongation, shape (n_e,).
        element_linear: Slope that is already part of C or K, zero between vehicles, shape (n_e,).
        element_table: Points (abscissa, force) of an odd law from zero on, shape (n_e, points, 2).
        element_names: Name of each element.
        element_between_cars: Whether it joins two vehicles; its whole law is then the element's, shape (n_e,).
    """

    n_dof: int
    n: int
    M: NDArray[np.float64]
    C: NDArray[np.float64]
    K: NDArray[np.float64]
    C_speed: NDArray[np.float64]
    gravity: NDArray[np.float64]
    acceleration_force: NDArray[np.float64]
    wheelset_dof: NDArray[np.int32]
    wheelset_x: NDArray[np.float64]
    wheelset_vehicle: NDArray[np.int32]
    wheel_radius: NDArray[np.float64]
    half_spacing: NDArray[np.float64]
    wheelset_mass: NDArray[np.float64]
    wheelset_spin_inertia: NDArray[np.float64]
    body_names: tuple[str, ...]
    body_x: NDArray[np.float64]
    body_height: NDArray[np.float64]
    body_vehicle_x: NDArray[np.float64]
    body_inertia: NDArray[np.float64]
    K_leaning: NDArray[np.float64]
    grade_force: NDArray[np.float64]
    element_index: NDArray[np.int32]
    element_row: NDArray[np.float64]
    element_kind: NDArray[np.int32]
    element_linear: NDArray[np.float64]
    element_table: NDArray[np.float64]
    element_names: tuple[str, ...]
    element_between_cars: NDArray[np.bool_]

    def dof(self, body: str, motion: str) -> int:
        """Return the index of a coordinate of a body, e.g. ``dof("car", "z")``."""
        return 5 * self.body_names.index(body) + MOTIONS.index(motion)


def centre_in_window(window: float, wheelset_x: NDArray[np.float64]) -> float:
    """Centre of the first vehicle from the rear end of a window that has the wheels in its middle [m].

    Args:
        window: Length [m].
        wheelset_x: Wheelsets relative to the first vehicle's centre [m], shape (n_ws,).
    """
    return window / 2.0 - 0.5 * float(wheelset_x.max() + wheelset_x.min())


def train_centres(vehicles: Sequence[Vehicle]) -> NDArray[np.float64]:
    """Return the centres of coupled vehicles relative to the first [m], backwards negative, shape (vehicles,)."""
    lengths = np.array([vehicle.length_over_couplers for vehicle in vehicles])
    return -np.append(0.0, np.cumsum(0.5 * (lengths[:-1] + lengths[1:])))


def assemble(
    vehicles: Sequence[Vehicle],
    centres: NDArray[np.float64] | None = None,
    *,
    series_springs: bool | None = None,
    effort: Effort = "wheels",
    couplings: Sequence[tuple[int, Coupling]] = (),
) -> TrainModel:
    """Assemble the matrices and nonlinear elements of a train.

    Args:
        vehicles: The leading one first.
        centres: Centre of each vehicle relative to the first's, forward [m]; from the coupler lengths if None.
        series_springs: Every damper with ``k_series`` gets an internal state; None: as each vehicle states.
        effort: Where the force that changes the speed acts.
        couplings: Couplings, each with the number of the vehicle ahead, from 0.

    Returns:
        The train.

    Raises:
        InputError: The centres do not fall, or a body has no longitudinal spring to the wheelsets.
    """
    centres = train_centres(vehicles) if centres is None else np.asarray(centres, dtype=np.float64)
    _check_centres(vehicles, centres)
    bodies = _place(vehicles, centres)
    series = [vehicle.series_springs if series_springs is None else series_springs for vehicle in vehicles]
    internal = sum(
        damper.k_series > 0.0 for vehicle, on in zip(vehicles, series, strict=True) if on for damper in vehicle.damper
    )
    full = Assembly(bodies, internal)
    first = 0
    for k, vehicle in enumerate(vehicles):
        prefix = f"v{k + 1} " if len(vehicles) > 1 else ""
        full.add_vehicle(vehicle, first, series[k], prefix)
        first += len(vehicle.body)
    _couple(full, vehicles, centres, couplings)
    push = longitudinal_push(full) + spin_push(full, vehicles, effort)
    return _reduce(full, vehicles, centres, push, grade_push(full, vehicles, effort))


def _couple(
    full: Assembly,
    vehicles: Sequence[Vehicle],
    centres: NDArray[np.float64],
    couplings: Sequence[tuple[int, Coupling]],
) -> None:
    """Add couplings; the plane in which two vehicles meet divides their distance as their lengths do."""
    firsts = np.cumsum([0, *(len(vehicle.body) for vehicle in vehicles)])
    for k, coupling in couplings:
        ahead, behind = vehicles[k], vehicles[k + 1]
        index = tuple({body.name: int(firsts[i]) + m for m, body in enumerate(vehicles[i].body)} for i in (k, k + 1))
        gap, share = float(centres[k] - centres[k + 1]), ahead.length / (ahead.length + behind.length)
        plane = (-gap * share, gap * (1.0 - share))
        full.add_coupling(coupling, (index[0], index[1]), plane, f"v{k + 1}-v{k + 2} ")


def _check_centres(vehicles: Sequence[Vehicle], centres: NDArray[np.float64]) -> None:
    if not vehicles:
        raise InputError("train.vehicles = (): a train needs a vehicle")
    if centres.shape != (len(vehicles),) or not np.isfinite(centres).all():
        raise InputError(f"train.centres = {centres.tolist()}: expected {len(vehicles)} finite numbers [m]")
    if (np.diff(centres) >= 0.0).any():
        raise InputError(f"train.centres = {centres.tolist()}: must fall, the first vehicle leads")


def _place(vehicles: Sequence[Vehicle], centres: NDArray[np.float64]) -> list[PlacedBody]:
    """Bodies of the whole train, wheelsets numbered through it from the front."""
    placed = []
    wheelsets = 0
    for k, (vehicle, centre) in enumerate(zip(vehicles, centres, strict=True)):
        rank = {x: i for i, x in enumerate(vehicle.axle_positions)}
        for body in vehicle.body:
            name = body.name if len(vehicles) == 1 else f"v{k + 1} {body.name}"
            if body.wheelset:
                name = f"wheelset {wheelsets + rank[body.x] + 1}"
            placed.append(PlacedBody(name, k, float(centre) + body.x, body))
        wheelsets += len(rank)
    return placed


def _reduce(
    full: Assembly,
    vehicles: Sequence[Vehicle],
    centres: NDArray[np.float64],
    push: NDArray[np.float64],
    grade: NDArray[np.float64],
) -> TrainModel:
    """Eliminate the longitudinal motions and arrange the data for the engine."""
    bodies = full.bodies
    keep = np.array([i for i in range(full.size) if i >= full.first_internal or i % 6])
    new = np.full(full.size, -1)
    new[keep] = np.arange(len(keep))
    n_dof, n = 5 * len(bodies), len(keep)
    wheelsets = [i for i, placed in enumerate(bodies) if placed.body.wheelset]
    order = sorted(wheelsets, key=lambda i: (bodies[i].vehicle, -bodies[i].x))
    dofs = np.array([5 * i + np.arange(5) for i in order], dtype=np.int32)
    owner = np.array([bodies[i].vehicle for i in order], dtype=np.int32)
    radius = np.array([vehicles[k].wheel_radius for k in owner])
    spin = np.array([bodies[i].body.Jy for i in order])
    M = full.M[np.ix_(keep, keep)]
    index, row, table = _lay_out(full.elements, new)
    return TrainModel(
        n_dof=n_dof,
        n=n,
        M=M,
        C=full.C[np.ix_(keep, keep)],
        K=full.K[np.ix_(keep, keep)],
        C_speed=_gyroscopic(n, dofs, spin / radius),
        gravity=GRAVITY * np.diag(M) * (np.arange(n) % 5 == MOTIONS.index("z")),
        acceleration_force=push[keep],
        wheelset_dof=dofs,
        wheelset_x=np.array([bodies[i].x for i in order]),
        wheelset_vehicle=owner,
        wheel_radius=radius,
        half_spacing=np.array([vehicles[k].half_spacing for k in owner]),
        wheelset_mass=np.array([bodies[i].body.mass for i in order]),
        wheelset_spin_inertia=spin,
        body_names=tuple(placed.name for placed in bodies),
        body_x=np.array([placed.x for placed in bodies]),
        body_height=np.array([placed.body.height for placed in bodies]),
        body_vehicle_x=np.array([centres[placed.vehicle] for placed in bodies]),
        body_inertia=np.array([(placed.body.Jx, placed.body.Jy, placed.body.Jz) for placed in bodies]),
        K_leaning=_leaning(full, keep, dofs),
        grade_force=grade[keep],
        element_index=index,
        element_row=row,
        element_kind=np.array([element.kind for element in full.elements], dtype=np.int32),
        element_linear=np.array([0.0 if element.between_cars else element.slope for element in full.elements]),
        element_table=table,
        element_names=tuple(element.name for element in full.elements),
        element_between_cars=np.array([element.between_cars for element in full.elements], dtype=np.bool_),
    )


def with_wheel_radii(train: TrainModel, radius: NDArray[np.float64]) -> TrainModel:
    """Give every wheelset the mean radius of its own wheels, on which it spins; the same object if it has that already.

    Args:
        train: The train with its vehicles' radii.
        radius: Mean radius of the wheels of each wheelset [m], shape (n_ws,).
    """
    if np.array_equal(radius, train.wheel_radius):
        return train
    momentum = train.wheelset_spin_inertia / radius
    return replace(train, wheel_radius=radius, C_speed=_gyroscopic(train.n, train.wheelset_dof, momentum))


def _leaning(full: Assembly, keep: NDArray[np.intp], wheelset_dof: NDArray[np.int32]) -> NDArray[np.float64]:
    """K_leaning, with the preloads of the springs over held wheelsets."""
    K, weight = full.K[np.ix_(keep, keep)], np.zeros(full.size)
    weight[2 : full.first_internal : 6] = GRAVITY * np.diag(full.M)[2 : full.first_internal : 6]
    free = np.setdiff1d(np.arange(len(keep)), wheelset_dof.ravel())
    u = np.zeros(full.size)
    u[keep[free]] = np.linalg.lstsq(K[np.ix_(free, free)], weight[keep[free]], rcond=None)[0]
    return leaning_stiffness(full.springs, u)[np.ix_(keep, keep)]


def _gyroscopic(n: int, wheelset_dof: NDArray[np.int32], momentum: NDArray[np.float64]) -> NDArray[np.float64]:
    """C_speed from the wheelsets' angular momentum per unit speed, J/r0 [kg m]."""
    roll, yaw = wheelset_dof[:, 2], wheelset_dof[:, 4]
    C_speed = np.zeros((n, n))
    C_speed[roll, yaw] = momentum
    C_speed[yaw, roll] = -momentum
    return C_speed


def _lay_out(
    elements: Sequence[Element], new: NDArray[np.intp]
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """Element index, row and table arrays of :class:`TrainModel`."""
    index = np.zeros((len(elements), _WIDTH), dtype=np.int32)
    row = np.zeros((len(elements), _WIDTH))
    points = max((len(element.table) for element in elements), default=2)
    table = np.zeros((len(elements), points, 2))
    for e, element in enumerate(elements):
        used = (new[element.columns] >= 0) & (element.row != 0.0)
        count = np.count_nonzero(used)
        index[e, :count] = new[element.columns[used]]
        row[e, :count] = element.row[used]
        table[e] = extend_table(element.table, points)
    return index, row, table


def wheelset_lag(train: TrainModel) -> NDArray[np.float64]:
    """Return the distance of each vehicle's leading wheelset behind that of the train [m], shape (n_ws,).

    All wheelsets of a vehicle have its distance: what is evaluated by chainage begins for a vehicle this much later.
    """
    first = np.searchsorted(train.wheelset_vehicle, train.wheelset_vehicle)
    return np.asarray(train.wheelset_x[0] - train.wheelset_x[first], np.float64)


def static_wheel_loads(train: TrainModel, speed_rate: float = 0.0) -> NDArray[np.float64]:
    """Compute wheel loads at rest with the wheelsets fixed, linear springs only.

    Args:
        train: The train.
        speed_rate: Vdot [m/s^2] whose longitudinal inertia acts in addition to gravity.

    Returns:
        Load of the left and the right wheel of each wheelset [N], shape (n_ws, 2).

    Raises:
        InputError: A body can move without resistance while the wheelsets are fixed.
    """
    load = train.gravity + speed_rate * train.acceleration_force
    held = train.wheelset_dof.ravel()
    free = np.setdiff1d(np.arange(train.n), held)
    _check_held(train, free)
    u = np.zeros(train.n)
    u[free] = np.linalg.solve(train.K[np.ix_(free, free)], load[free])
    support = load - train.K @ u  # on the wheelset from above, to be carried by the rails
    total, roll = support[train.wheelset_dof[:, 1]], support[train.wheelset_dof[:, 2]]
    half_difference = roll / (2.0 * train.half_spacing)
    return np.column_stack([0.5 * total - half_difference, 0.5 * total + half_difference])


def _check_held(train: TrainModel, free: NDArray[np.intp]) -> None:
    """Refuse bodies that the springs do not restrain, by the smallest eigenvalue of K scaled to a unit diagonal."""
    K = train.K[np.ix_(free, free)]
    stiffness = np.diag(K)
    scale = 1.0 / np.sqrt(np.where(stiffness > 0.0, stiffness, 1.0))
    values, vectors = np.linalg.eigh(scale[:, None] * K * scale)
    if len(free) and values[0] < 1e-10:
        dof = free[np.argmax(np.abs(vectors[:, 0]) * (free < train.n_dof))]
        raise InputError(f"{train.body_names[dof // 5]}: not restrained by springs, mostly in {MOTIONS[dof % 5]}")
