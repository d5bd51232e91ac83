"""Constant data that every kind of step shares.

All trains of a group move with the same window along the same track at the same speed; they differ in the realisation
of the irregularity.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.irregularity.irregularity import HALF_BASE
from tiengine.kernels import layout as at
from tiengine.model.implicit_seats import seat_inverse_terms
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.track.slab_matrices import SlabMatrices, bed_points, seat_shapes
from tiengine.vehicle.train import static_wheel_loads

__all__ = ["CONTACT_TOLERANCE", "MassAndStiffness", "Model", "SlabOperators", "shared_arrays", "slab_operators"]

CONTACT_TOLERANCE = 1e-6  # of the static wheel load: below single precision of the recorded forces

MassAndStiffness: TypeAlias = "tuple[sp.sparray, sp.sparray]"
SlabOperators: TypeAlias = "tuple[Reals, Reals, Reals]"


@dataclass(frozen=True, eq=False)
class Model(ABC):
    """Constant arrays of a step; a derived class adds those of its trial functions.

    Attributes:
        ingredients: Track, train and numerics.
        dims: Sizes and offsets (``layout``).
        constants: Numbers (``layout``), then the tables of wheels out of round.
        bed_index, bed_shape, bed_weight: Quadrature of the bed.
        bed_points: Slab coordinates to w at all quadrature points, shape (dofs, points).
        bed_factor, bed_rest: Factors and pressures at rest by design.
        bed_lateral_K, bed_lateral_C: Lateral bed by design, shape (designs, 2, 2).
        bed_numbers: k_m, c_m, explicit, no tension.
        vehicle_load: Gravity, and force per unit rate of speed, shape (2, n).
        wheel: Numbers of each wheelset (``layout``), shape (W, N_WHEEL_NUMBERS).
    """

    ingredients: Ingredients
    dims: NDArray[np.int32]
    constants: Reals
    bed_index: NDArray[np.int32]
    bed_shape: Reals
    bed_weight: Reals
    bed_points: Reals
    bed_factor: Reals
    bed_rest: Reals
    bed_lateral_K: Reals
    bed_lateral_C: Reals
    bed_numbers: Reals
    vehicle_load: Reals
    wheel: Reals

    @property
    @abstractmethod
    def rails_at_rest(self) -> tuple[MassAndStiffness, MassAndStiffness]:
        """M and K at V = 0 of a rail's vertical and of its lateral coordinates, in the order of the state's parts."""


def shared_arrays(ingredients: Ingredients) -> dict[str, Any]:
    """Arrays of :class:`Model` by name."""
    designs, mortar, train = ingredients.designs.matrices, ingredients.mortar, ingredients.train
    first = designs[0]
    return {
        "ingredients": ingredients,
        "dims": _dims(ingredients, first),
        "constants": _constants(ingredients),
        "bed_index": first.bed_index,
        "bed_shape": first.bed_shape,
        "bed_weight": first.bed_weight,
        "bed_points": bed_points(first),
        "bed_factor": np.stack([slab.bed_factor for slab in designs]),
        "bed_rest": np.stack([slab.bed_weight_pressure for slab in designs]),
        "bed_lateral_K": np.stack([slab.K_bed[-2:, -2:] for slab in designs]),
        "bed_lateral_C": np.stack([slab.C_bed[-2:, -2:] for slab in designs]),
        "bed_numbers": np.array(
            [mortar.stiffness, mortar.damping, float(ingredients.explicit_mortar), float(mortar.no_tension)]
        ),
        "vehicle_load": np.stack([train.gravity, train.acceleration_force]),
        "wheel": _wheels(ingredients),
    }


def slab_operators(ingredients: Ingredients) -> list[SlabOperators]:
    """A of every slab design with its own fastenings, K and C of its implicit part; shape (dofs, dofs) each."""
    designs = ingredients.designs
    seats = seat_shapes(designs.matrices[0])
    found = []
    for slab, scale in zip(designs.matrices, designs.seat_scale, strict=True):
        K = slab.K_plate if ingredients.explicit_mortar else slab.K_plate + slab.K_bed
        C = np.zeros_like(K) if ingredients.explicit_mortar else slab.C_bed
        own_K, own_C = seat_inverse_terms(seats, scale, ingredients.fastening, ingredients.rail.half_base)
        A = ingredients.newmark.operator(sp.csr_array(slab.M), sp.csr_array(C + own_C), sp.csr_array(K + own_K))
        found.append((A.toarray(), K, C))
    return found


def _wheels(ingredients: Ingredients) -> Reals:
    """Numbers of each wheelset, shape (W, N_WHEEL_NUMBERS)."""
    train, tables = ingredients.train, ingredients.out_of_round
    wheel = np.full((len(train.wheel_radius), at.N_WHEEL_NUMBERS), -1.0)
    wheel[:, at.NOMINAL_RADIUS], wheel[:, at.HALF_SPACING] = train.wheel_radius, train.half_spacing
    wheel[:, at.SPIN_INERTIA] = train.wheelset_spin_inertia
    if tables is not None:
        wheel[:, at.ROUND_LEFT : at.ROUND_RIGHT + 1] = tables.number
    if ingredients.contacts is not None:
        wheel[:, at.RADIUS_LEFT :] = ingredients.contacts.numbers
    return wheel


def _dims(ingredients: Ingredients, first: SlabMatrices) -> NDArray[np.int32]:
    """Sizes and offsets, see ``layout``."""
    dims = np.zeros(at.N_DIMS, dtype=np.int32)
    n, B = ingredients.modes, ingredients.trains
    explicit, no_tension = ingredients.explicit_mortar, ingredients.mortar.no_tension
    dims[at.TRAINS], dims[at.MODES], dims[at.SLOTS], dims[at.SLAB_DOFS] = B, n, ingredients.slots, first.n
    dims[at.SEATS] = ingredients.seats
    dims[at.VEHICLE_DOFS], dims[at.WHEELSETS] = ingredients.train.n, len(ingredients.train.wheelset_x)
    dims[at.SEATS_PER_SLAB] = ingredients.slab.fastenings
    dims[at.LATERAL] = B * 4 * n
    dims[at.SLABS] = B * 10 * n
    dims[at.VEHICLES] = B * (10 * n + ingredients.slots * first.n)
    dims[at.BODIES] = len(ingredients.train.body_names)
    dims[at.MORTAR_MODE] = 2 if explicit else 1 if no_tension else 0
    dims[at.CROSS_LEVEL_ROLLS] = int(ingredients.cross_level_rolls)
    return dims


def _constants(ingredients: Ingredients) -> Reals:
    """Numbers, see ``layout``; those of the trial functions are added by the derived class."""
    tables = ingredients.out_of_round
    c = np.zeros(at.N_CONSTANTS + (0 if tables is None else tables.values.size))
    if tables is not None:
        c[at.N_CONSTANTS :] = tables.values.ravel()
    newmark, fastening, rail, table = ingredients.newmark, ingredients.fastening, ingredients.rail, ingredients.contact
    dt = newmark.dt
    c[at.DT], c[at.BETA_DT2], c[at.GAMMA_DT] = dt, newmark.beta_dt2, newmark.gamma_dt
    c[at.MASS], c[at.INERTIA_Y], _, c[at.INERTIA_Z], c[at.INERTIA_X] = rail.densities
    c[at.LENGTH], c[at.SPACING] = ingredients.length, ingredients.slab.fastening_pitch
    c[at.K_VERTICAL], c[at.C_VERTICAL] = fastening.vertical_stiffness, fastening.vertical_damping
    c[at.K_LATERAL], c[at.C_LATERAL] = fastening.lateral_stiffness, fastening.lateral_damping
    c[at.ARM_FASTENING], c[at.HALF_BASE], c[at.ARM_HEAD] = rail.arm_fastening, rail.half_base, rail.arm_head
    c[at.FRICTION], c[at.CROWN_OFFSET] = ingredients.friction, table.crown_offset
    c[at.IRREGULARITY_HALF_BASE], c[at.CONTACT_TOLERANCE] = HALF_BASE, CONTACT_TOLERANCE
    c[at.STATIC_LOAD] = float(np.max(static_wheel_loads(ingredients.train)))
    c[at.ABSORBING_ZONE] = ingredients.absorbing_zone
    c[at.TABLE_U0], c[at.TABLE_DU] = table.u_min, table.du
    c[at.TABLE_ALPHA0], c[at.TABLE_DALPHA], c[at.TABLE_ROWS] = table.alpha_min, table.dalpha, len(table.values)
    return c
