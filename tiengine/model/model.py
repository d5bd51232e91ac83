"""Constant data of a group of trains that are advanced together.

All trains of a group move with the same window along the same track at the same speed; they differ in the realisation
of the irregularity. Arrays have the shapes that the kernels of :mod:`tiengine.kernels.step` read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.contact.table import ContactTable
from tiengine.irregularity.irregularity import HALF_BASE
from tiengine.kernels import layout as at
from tiengine.model.implicit_seats import seat_inverse_terms, seat_shapes, smeared_fastening
from tiengine.model.newmark import Newmark, inverse
from tiengine.model.speed_blocks import Blocks
from tiengine.track.fastening import Fastening, seat_count, seat_tables
from tiengine.track.mortar import Mortar
from tiengine.track.rail import Rail, RailWindow, sine_products
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices
from tiengine.vehicle.train import TrainModel, centre_in_window, static_wheel_loads

__all__ = ["Ingredients", "Model", "SlabDesigns", "build_model"]

CONTACT_TOLERANCE = 1e-6  # of the static wheel load: below single precision of the recorded forces


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
        contact: Contact geometry of wheel and rail.
        friction: Coefficient of friction.
        cross_level_rolls: Whether a cross level turns the railheads.
        length: Window l [m].
        modes: N.
        newmark: Step and coefficients.
        passes: Passes per step.
        cover: Enough slabs for every seat of the window, or the paper's count.
        explicit_mortar: Treat the bed explicitly.
        local_compliance: Add the static compliance of the truncated modes under the wheels.
        absorbing_zone: Length of the zones at the window's ends with additional springs to the ground [m]; 0 for none.
        trains: Trains advanced together.
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
    passes: int = 2
    cover: bool = True
    explicit_mortar: bool = False
    local_compliance: bool = False
    absorbing_zone: float = 0.0
    trains: int = 1

    @property
    def slots(self) -> int:
        """Slabs in memory."""
        return self.slab.slots(self.length, self.cover)

    @property
    def seats(self) -> int:
        """Most seats in the window at once."""
        return seat_count(self.length, self.slab.fastening_pitch)

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
        vehicles, rails = self.train.n_dof, 2 * 5 * self.modes
        slabs = self.slots * self.designs.matrices[0].n
        return {
            "vehicles": vehicles,
            "rails": rails,
            "slabs": slabs,
            "total": vehicles + rails + slabs,
            "internal_states": self.train.n - self.train.n_dof,
        }


@dataclass(frozen=True, eq=False)
class Model:
    """Constant arrays of the step.

    Attributes:
        ingredients: Track, train and numerics.
        window: Rail matrices.
        dims: Sizes and offsets (``layout``).
        constants: Numbers (``layout``).
        stiffness: Elastic coefficients of the rails by mode, shape (N, 8).
        flow_sine, flow_cosine: G of the sine and cosine fields, transposed, shape (N, N).
        seat_table: cos and sin of k_i j d, shape (2N, seats).
        slab_seats: Slab coordinates to the seats: w left and right, dw/dy left and right, y; shape (dofs, 5 seats).
        slab_linear: Matrices from a slab's u, and from its v, to its acceleration by its own stiffness and damping,
            shape (2, designs, dofs, dofs).
        slab_push: Matrices from the forces of the seats (as ``slab_seats``) to the slab's acceleration, shape
            (designs, 5 seats, dofs).
        slab_inverse: Inverses of the slab blocks, transposed, shape (designs, dofs, dofs).
        bed_index, bed_shape, bed_weight: Quadrature of the bed.
        bed_points: Slab coordinates to w at all quadrature points, shape (dofs, points).
        bed_factor, bed_rest: Factors and pressures at rest by design.
        bed_lateral_K, bed_lateral_C: Lateral bed by design, shape (designs, 2, 2).
        bed_numbers: k_m, c_m, explicit, no tension.
        vehicle_load: Gravity, and force per unit rate of speed, shape (2, n).
        wheel: r0, b0, spin inertia, shape (W, 3).
        wheel_shape: sin(k_i s) and its slope under the wheels, shape (2, W, N).
        blocks: Inverses that depend on the speed.
    """

    ingredients: Ingredients
    window: RailWindow
    dims: NDArray[np.int32]
    constants: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    flow_sine: NDArray[np.float64]
    flow_cosine: NDArray[np.float64]
    seat_table: NDArray[np.float64]
    slab_seats: NDArray[np.float64]
    slab_linear: NDArray[np.float64]
    slab_push: NDArray[np.float64]
    slab_inverse: NDArray[np.float64]
    bed_index: NDArray[np.int32]
    bed_shape: NDArray[np.float64]
    bed_weight: NDArray[np.float64]
    bed_points: NDArray[np.float64]
    bed_factor: NDArray[np.float64]
    bed_rest: NDArray[np.float64]
    bed_lateral_K: NDArray[np.float64]
    bed_lateral_C: NDArray[np.float64]
    bed_numbers: NDArray[np.float64]
    vehicle_load: NDArray[np.float64]
    wheel: NDArray[np.float64]
    wheel_shape: NDArray[np.float64]
    blocks: Blocks

    def refactor(self, V: float) -> None:
        """Fill the blocks that depend on the speed V [m/s]."""
        g = self.ingredients
        self.blocks.fill(self.window, g.fastening, g.slab.fastening_pitch, g.train, g.newmark, V, self.wheel_shape)


def build_model(ingredients: Ingredients, V: float) -> Model:
    """Assemble and factorise everything for a speed V [m/s]."""
    window = RailWindow(ingredients.rail, ingredients.length, ingredients.modes)
    train, wheel_s = ingredients.train, ingredients.wheel_s
    first = ingredients.designs.matrices[0]
    sine, cosine = sine_products(ingredients.modes)
    model = Model(
        ingredients=ingredients,
        window=window,
        dims=_dims(ingredients, first),
        constants=_constants(ingredients, window),
        stiffness=window.modal_stiffness,
        flow_sine=np.ascontiguousarray(sine.T),
        flow_cosine=np.ascontiguousarray(cosine.T),
        seat_table=seat_tables(ingredients.modes, ingredients.length, ingredients.slab.fastening_pitch),
        **_slab_arrays(ingredients),
        vehicle_load=np.stack([train.gravity, train.acceleration_force]),
        wheel=np.stack([train.wheel_radius, train.half_spacing, train.wheelset_spin_inertia], axis=1),
        wheel_shape=np.stack([window.shape(wheel_s), window.shape_slope(wheel_s)]),
        blocks=Blocks.empty(ingredients.modes, len(wheel_s), train.n),
    )
    model.refactor(V)
    return model


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


def _constants(ingredients: Ingredients, window: RailWindow) -> NDArray[np.float64]:
    """Numbers, see ``layout``."""
    c = np.zeros(at.N_CONSTANTS)
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
    smeared = smeared_fastening(window, fastening, ingredients.slab.fastening_pitch, newmark)
    c[at.SMEARED_VERTICAL], c[at.SMEARED_LATERAL] = smeared
    if ingredients.local_compliance:
        c[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1] = window.missing_compliance
    c[at.ABSORBING_ZONE] = ingredients.absorbing_zone
    c[at.TABLE_U0], c[at.TABLE_DU] = table.u_min, table.du
    c[at.TABLE_ALPHA0], c[at.TABLE_DALPHA] = table.alpha_min, table.dalpha
    return c


def _slab_arrays(ingredients: Ingredients) -> dict[str, Any]:
    """Products, inverses and bed tables of every slab design."""
    designs, mortar = ingredients.designs.matrices, ingredients.mortar
    first = designs[0]
    seats = seat_shapes(first)
    linear, push, inverses = [], [], []
    for slab, scale in zip(designs, ingredients.designs.seat_scale, strict=True):
        K = slab.K_plate if ingredients.explicit_mortar else slab.K_plate + slab.K_bed
        C = np.zeros_like(K) if ingredients.explicit_mortar else slab.C_bed
        own_K, own_C = seat_inverse_terms(seats, scale, ingredients.fastening, ingredients.rail.half_base)
        A = ingredients.newmark.operator(sp.csr_array(slab.M), sp.csr_array(C + own_C), sp.csr_array(K + own_K))
        inverses.append(inverse(A, "slab").T)
        linear.append(-np.stack([K.T, C.T]) @ inverses[-1])
        push.append(seats.T @ inverses[-1])
    return {
        "slab_seats": seats,
        "slab_linear": np.stack(linear, axis=1),
        "slab_push": np.stack(push),
        "slab_inverse": np.stack(inverses),
        "bed_index": first.bed_index,
        "bed_shape": first.bed_shape,
        "bed_weight": first.bed_weight,
        "bed_points": _bed_points(first),
        "bed_factor": np.stack([slab.bed_factor for slab in designs]),
        "bed_rest": np.stack([slab.bed_weight_pressure for slab in designs]),
        "bed_lateral_K": np.stack([slab.K_bed[-2:, -2:] for slab in designs]),
        "bed_lateral_C": np.stack([slab.C_bed[-2:, -2:] for slab in designs]),
        "bed_numbers": np.array(
            [mortar.stiffness, mortar.damping, float(ingredients.explicit_mortar), float(mortar.no_tension)]
        ),
    }


def _bed_points(slab: SlabMatrices) -> NDArray[np.float64]:
    """Slab coordinates to w at the quadrature points of all elements, shape (dofs, points)."""
    elements, points = len(slab.bed_index), len(slab.bed_shape)
    shapes = np.zeros((slab.n, elements, points))
    for e, index in enumerate(slab.bed_index):
        shapes[index, e] = slab.bed_shape.T
    return shapes.reshape(slab.n, -1)
