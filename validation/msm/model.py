r"""Constant arrays of the full-length track: modes of the whole rail, all slabs.

A simply supported Timoshenko rail of length L, fixed to the ground, sin(k_i x) for w, v, theta_x and cos(k_i x) for
theta_y, theta_z, k_i = i pi / L. Per mode, over L/2:

    vertical:  [m, rho I] and  [[kGA k^2, -kGA k], [-kGA k, kGA + EI k^2]]        (w, theta_y)
    lateral:   the same with the lateral section, and  rho Ip, GK k^2             (v, theta_z; theta_x)

Newmark's operator M + beta dt^2 K + A_s is solved mode by mode: A_s holds the fastenings smeared along the rail, which
keeps the passes from diverging and cancels as they converge (Hughes and Liu 1978). A slab's operator holds its bed
and its own side of the seats.

Shared with the engine: vehicle, contact, irregularity and the start's contact forces. Rails, fastenings, slabs and
mortar are programmed independently.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.table import ContactTable
from tiengine.irregularity.irregularity import HALF_BASE
from tiengine.kernels import layout as at
from tiengine.model.constant_data import CONTACT_TOLERANCE
from tiengine.model.ingredients import Ingredients
from tiengine.model.newmark import Newmark
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario
from tiengine.track.fastening import Fastening
from tiengine.track.mortar import Mortar
from tiengine.track.rail import Rail
from tiengine.vehicle.train import TrainModel, static_wheel_loads
from validation.msm.plate import ModalSlab, modal_slab
from validation.msm.seats import SeatTransform

__all__ = ["FullTrack", "SlabGroup", "build_track", "whole_seats"]

(WW, W_THETA, THETA_Y, VV, V_THETA, THETA_Z, TORSION) = range(7)
"""Rows of the rails' modal stiffness; the first six also of K in the vertical and the lateral plane."""
(INV_WW, INV_WT, INV_TT, INV_VV, INV_VZ, INV_VX, INV_ZZ, INV_ZX, INV_XX) = range(9)
"""Rows of the inverses of the rails' operators by mode: vertical (w, theta_y), lateral (v, theta_z, theta_x)."""
(
    KV, CV, KL, CL, ARM, BASE2, SMEAR_V, SMEAR_L, X_REAR, RAIL_LENGTH, HALF_BETA_DT2, HALF_GAMMA_DT, N_NUMBERS,
) = range(13)  # fmt: skip
"""Entries of ``numbers``: fastening, a, b^2, smeared operator per mode, rear end and length of the rail, predictors."""

REAR_MARGIN = 10.0
"""Least length of rail behind the last wheel at the start [m]; the rail begins at the slab joint before that."""


@dataclass(frozen=True, eq=False)
class SlabGroup:
    """Slabs of one design: all sound slabs, or one slab with voids or failed fastenings.

    Attributes:
        slab: Modal matrices.
        index: Slabs along the rail, counted from its rear end, shape (k,).
        inverse: Inverse of the operator, shape (m + 2, m + 2).
    """

    slab: ModalSlab
    index: NDArray[np.int64]
    inverse: Reals


@dataclass(frozen=True, eq=False)
class FullTrack:
    """Constant data of the full-length model.

    Attributes:
        rail_length: L [m], whole seat pitches.
        modes: N.
        first_slab: Index along the track of the rail's first slab; its first seat is first_slab times the seats per
            slab.
        rear: Chainage of the rail's rear end [m].
        transform: Sums over seats.
        stiffness: Rows by mode, shape (7, N).
        mass: mu L/2 of w, theta_y, v, theta_z, theta_x, shape (5,).
        inverse: Rows of inverses by mode, shape (9, N).
        seat_scale: Factors of the fastenings, 0 beyond the rail's end, shape (2, slabs, seats per slab).
        groups: Slabs by design, the sound ones first.
        seat: Seat rows of the sound slab as factors of one product: [w, dw/dy] by side, shape (4, m, seats).
        numbers, dims, constants: For the kernels.
        wheel: Numbers of each wheelset, shape (W, N_WHEEL_NUMBERS).
        vehicle_load: Force per unit rate of speed, gravity, then zeros: no given loads, shape (2 n + n_e + 2 W,).
        train, contact, contact_values: Shared with the engine.
        rail, fastening, mortar: Parameters.
        dead_pressure: Weight of a slab on its bed [Pa].
        newmark: Step and coefficients.
        passes: Passes per step.
    """

    rail_length: float
    modes: int
    first_slab: int
    rear: float
    transform: SeatTransform
    stiffness: Reals
    mass: Reals
    inverse: Reals
    seat_scale: Reals
    groups: tuple[SlabGroup, ...]
    seat: Reals
    numbers: Reals
    dims: NDArray[np.int32]
    constants: Reals
    wheel: Reals
    vehicle_load: Reals
    train: TrainModel
    contact: ContactTable
    contact_values: Reals
    rail: Rail
    fastening: Fastening
    mortar: Mortar
    dead_pressure: float
    newmark: Newmark
    passes: int

    @property
    def half_base(self) -> float:
        """Half width b between a fastening's two half springs [m]."""
        return self.rail.half_base

    @property
    def slabs(self) -> int:
        """Number of slabs along the rail."""
        return self.seat_scale.shape[1]

    @property
    def slab_modes(self) -> int:
        """Number of plate modes of a slab."""
        return self.seat.shape[1]

    @property
    def dof_counts(self) -> dict[str, int]:
        """Degrees of freedom of vehicles, rails, slabs, and in all."""
        counts = {
            "vehicles": self.train.n_dof,
            "rails": 2 * 5 * self.modes,
            "slabs": self.slabs * (self.slab_modes + 2),
        }
        return {**counts, "total": sum(counts.values())}


def whole_seats(length: float, pitch: float) -> int:
    """Number of seats near length/pitch, length in m, with small prime factors for a fast transform."""
    near = round(length / pitch)
    return min(range(near - 3, near + 4), key=lambda n: (_largest_prime(n), abs(n - near)))


def build_track(
    scenario: Scenario, given: Ingredients, length: float, modes_per_metre: float, slab_modes: int
) -> FullTrack:
    """Assemble and factorise.

    Args:
        scenario: Scenario to run.
        given: Parts of the engine: vehicle, contact, and the parameters of rail, fastening, slab and mortar.
        length: Length of the rail [m]; rounded to whole seats.
        modes_per_metre: Trial functions per field and metre.
        slab_modes: Plate modes per slab.

    Raises:
        InputError: Mortar without tension, which the traditional model lacks.
    """
    if given.mortar.no_tension:
        raise InputError("track.mortar_no_tension = true: the full-length model's mortar is linear")
    d, per_slab = given.slab.fastening_pitch, given.slab.fastenings
    seats = whole_seats(length, d)
    L = seats * d
    modes = round(modes_per_metre * L)  # 0.2 % fewer per metre would change forces by 0.1 % of their peak
    first_wheel = scenario.rear + scenario.centre_in_window + float(given.train.wheelset_x.min())
    first_slab = int(np.floor((first_wheel - REAR_MARGIN) / given.slab.pitch))
    scale = _seat_scale(given, first_slab * per_slab, seats, per_slab)
    groups = _slab_groups(scenario, given, scale, first_slab, slab_modes)
    stiffness, mass = _rail(given.rail, L, modes)
    per_mode = max(1.0, 0.5 * modes / seats) * L / (2.0 * d)  # half of the factor of waves that coincide at the seats
    numbers = _numbers(given, per_mode, first_slab * given.slab.pitch, L)
    sound = groups[0].slab.seat
    return FullTrack(
        rail_length=L,
        modes=modes,
        first_slab=first_slab,
        rear=first_slab * given.slab.pitch,
        transform=SeatTransform.of(seats, modes, given.fastening.length / d),
        stiffness=stiffness,
        mass=mass,
        inverse=_rail_inverse(stiffness, mass, numbers, given.newmark),
        seat_scale=scale,
        groups=groups,
        seat=np.ascontiguousarray(sound.reshape(4, *sound.shape[2:])),
        numbers=numbers,
        dims=_dims(given),
        constants=_constants(given, _missing(given.rail, L, modes)),
        wheel=_wheels(given),
        vehicle_load=_loads(given.train),
        train=given.train,
        contact=given.contact,
        contact_values=given.contact_values,
        rail=given.rail,
        fastening=given.fastening,
        mortar=given.mortar,
        dead_pressure=given.slab.weight_pressure,
        newmark=given.newmark,
        passes=given.passes,
    )


def _wheels(given: Ingredients) -> Reals:
    """Numbers of each wheelset for the shared kernels of the contact, shape (W, N_WHEEL_NUMBERS)."""
    train = given.train
    wheel = np.full((len(train.wheel_radius), at.N_WHEEL_NUMBERS), -1.0)
    wheel[:, : at.SPIN_INERTIA + 1] = np.stack(
        [train.wheel_radius, train.half_spacing, train.wheelset_spin_inertia], axis=1
    )
    if given.contacts is not None:
        wheel[:, at.RADIUS_LEFT :] = given.contacts.numbers
    return wheel


def _loads(train: TrainModel) -> Reals:
    """Loads of the vehicle in the order of ``tiengine.engine.load_rows``."""
    nothing = np.zeros(len(train.element_kind) + 2 * len(train.wheelset_x))
    return np.concatenate([train.acceleration_force, train.gravity, nothing])


def _largest_prime(n: int) -> int:
    largest, p = 1, 2
    while n > 1:
        if n % p == 0:
            n, largest = n // p, p
        else:
            p += 1
    return largest


def _seat_scale(given: Ingredients, first_seat: int, seats: int, per_slab: int) -> Reals:
    """Factors of all seats by slab, shape (2, slabs, seats per slab)."""
    slabs = -(-seats // per_slab)
    scale = np.zeros((slabs * per_slab, 2))
    scale[:seats] = given.seat_factors(first_seat, seats)
    return np.ascontiguousarray(scale.T.reshape(2, slabs, per_slab))


def _slab_groups(
    scenario: Scenario, given: Ingredients, scale: Reals, first_slab: int, slab_modes: int
) -> tuple[SlabGroup, ...]:
    """Group the sound slabs, then each slab that has a void or a fastening that is not sound."""
    slabs = scale.shape[1]
    voids = {i: [v for v in scenario.track.mortar_voids if v.slab == first_slab + i] for i in range(slabs)}
    odd = [i for i in range(slabs) if voids[i] or (scale[:, i] != 1.0).any()]
    sound = modal_slab(given.slab, given.mortar, [], slab_modes, given.fastening.baseplate)
    even = np.setdiff1d(np.arange(slabs), odd)
    one = np.ones((2, given.slab.fastenings))
    groups = [SlabGroup(sound, even, _slab_inverse(given, sound, one))]
    for i in odd:
        slab = (
            sound
            if not voids[i]
            else modal_slab(given.slab, given.mortar, voids[i], slab_modes, given.fastening.baseplate)
        )
        groups.append(SlabGroup(slab, np.array([i]), _slab_inverse(given, slab, scale[:, i])))
    return tuple(groups)


def _slab_inverse(given: Ingredients, slab: ModalSlab, scale: Reals) -> Reals:
    """Inverse of M + gamma dt C + beta dt^2 K of a slab with its own side of the seats."""
    f, newmark, b = given.fastening, given.newmark, given.rail.half_base
    vertical = newmark.beta_dt2 * f.vertical_stiffness + newmark.gamma_dt * f.vertical_damping
    lateral = newmark.beta_dt2 * f.lateral_stiffness + newmark.gamma_dt * f.lateral_damping
    A = np.diag(slab.mass) + newmark.gamma_dt * slab.damping + newmark.beta_dt2 * slab.stiffness
    m = len(slab.omega)
    across = np.stack([np.ones_like(slab.seat_x), slab.seat_x])
    for side in range(2):
        w, slope = slab.seat[0, side], b * slab.seat[1, side]
        A[:m, :m] += vertical * ((w * scale[side]) @ w.T + (slope * scale[side]) @ slope.T)
        A[m:, m:] += lateral * ((across * scale[side]) @ across.T)
    return np.asarray(np.linalg.inv(A), dtype=np.float64)


def _rail(r: Rail, L: float, modes: int) -> tuple[Reals, Reals]:
    """Modal stiffness (7, N) and mass (5,)."""
    k, half = np.arange(1, modes + 1) * np.pi / L, L / 2.0
    rows = []
    for kappa, inertia in ((r.kappa_vertical, r.Iy), (r.kappa_lateral, r.Iz)):
        shear = kappa * r.G * r.A * half
        rows += [shear * k**2, -shear * k, shear + r.E * inertia * half * k**2]
    rows.append(r.GK * half * k**2)
    m, rho = r.mass_per_length, r.rho
    return np.stack(rows), half * np.array([m, rho * r.Iy, m, rho * r.Iz, rho * r.I_polar])


def _rail_inverse(stiffness: Reals, mass: Reals, numbers: Reals, newmark: Newmark) -> Reals:
    """Inverses of the operators mode by mode, shape (9, N)."""
    a, base2, sv, sl = (numbers[i] for i in (ARM, BASE2, SMEAR_V, SMEAR_L))
    b2, N = newmark.beta_dt2, stiffness.shape[1]
    vertical, lateral = np.zeros((N, 2, 2)), np.zeros((N, 3, 3))
    vertical[:] = np.diag(mass[:2])
    vertical[:, 0, 0] += b2 * stiffness[WW] + sv
    vertical[:, 0, 1] = vertical[:, 1, 0] = b2 * stiffness[W_THETA]
    vertical[:, 1, 1] += b2 * stiffness[THETA_Y]
    lateral[:] = np.diag(mass[2:])
    lateral[:, 0, 0] += b2 * stiffness[VV] + sl
    lateral[:, 0, 1] = lateral[:, 1, 0] = b2 * stiffness[V_THETA]
    lateral[:, 1, 1] += b2 * stiffness[THETA_Z]
    lateral[:, 0, 2] = lateral[:, 2, 0] = -a * sl
    lateral[:, 2, 2] += b2 * stiffness[TORSION] + a**2 * sl + base2 * sv
    V, H = np.linalg.inv(vertical), np.linalg.inv(lateral)
    upper = [V[:, 0, 0], V[:, 0, 1], V[:, 1, 1]]
    upper += [H[:, i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
    return np.stack(upper)


def _numbers(given: Ingredients, per_mode: float, rear: float, L: float) -> Reals:
    """Entries of ``numbers``."""
    f, r, newmark = given.fastening, given.rail, given.newmark
    out = np.zeros(N_NUMBERS)
    out[KV], out[CV], out[KL], out[CL] = (
        f.vertical_stiffness,
        f.vertical_damping,
        f.lateral_stiffness,
        f.lateral_damping,
    )
    out[ARM], out[BASE2], out[X_REAR], out[RAIL_LENGTH] = r.arm_fastening, r.half_base**2, rear, L
    out[HALF_BETA_DT2], out[HALF_GAMMA_DT] = newmark.predictor[:, 2]
    out[SMEAR_V] = per_mode * (newmark.beta_dt2 * f.vertical_stiffness + newmark.gamma_dt * f.vertical_damping)
    out[SMEAR_L] = per_mode * (newmark.beta_dt2 * f.lateral_stiffness + newmark.gamma_dt * f.lateral_damping)
    return out


def _dims(given: Ingredients) -> NDArray[np.int32]:
    """Dimensions for the shared vehicle and contact kernels; their ``motion`` holds only the vehicle."""
    dims = np.zeros(at.N_DIMS, dtype=np.int32)
    dims[at.TRAINS], dims[at.VEHICLE_DOFS], dims[at.WHEELSETS] = 1, given.train.n, len(given.train.wheelset_x)
    dims[at.BODIES], dims[at.CROSS_LEVEL_ROLLS] = len(given.train.body_names), int(given.cross_level_rolls)
    return dims


def _missing(r: Rail, L: float, modes: int, terms: int = 200_000) -> Reals:
    """Static compliance in w, v, theta_x of the omitted modes, sin^2 averaged: (1/L) sum over i > N."""
    k = np.arange(modes + 1, modes + terms) * np.pi / L
    shear = (np.sum(1.0 / (kappa * r.G * r.A * k**2)) for kappa in (r.kappa_vertical, r.kappa_lateral))
    bending = (np.sum(1.0 / (r.E * inertia * k**4)) for inertia in (r.Iy, r.Iz))
    across = [a + b for a, b in zip(shear, bending, strict=True)]
    return np.array([*across, np.sum(1.0 / (r.GK * k**2))]) / L


def _constants(given: Ingredients, missing: Reals) -> Reals:
    """Constants of step and contact for the shared kernels."""
    c = np.zeros(at.N_CONSTANTS)
    newmark, table = given.newmark, given.contact
    c[at.DT], c[at.BETA_DT2], c[at.GAMMA_DT] = newmark.dt, newmark.beta_dt2, newmark.gamma_dt
    c[at.ARM_HEAD], c[at.FRICTION], c[at.CROWN_OFFSET] = given.rail.arm_head, given.friction, table.crown_offset
    c[at.IRREGULARITY_HALF_BASE], c[at.CONTACT_TOLERANCE] = HALF_BASE, CONTACT_TOLERANCE
    c[at.STATIC_LOAD] = float(np.max(static_wheel_loads(given.train)))
    if given.local_compliance:
        c[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1] = missing
    c[at.TABLE_U0], c[at.TABLE_DU] = table.u_min, table.du
    c[at.TABLE_ALPHA0], c[at.TABLE_DALPHA], c[at.TABLE_ROWS] = table.alpha_min, table.dalpha, len(table.values)
    return c
