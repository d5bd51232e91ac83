"""A spline step on the parts of the scenario ``paper``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from tiengine.engine.aligned import aligned_zeros
from tiengine.engine.banded import BandedBlock
from tiengine.engine.load_rows import LoadRows
from tiengine.engine.spline_arrays import SplineArrays
from tiengine.engine.spline_step import Bed as SlabBed
from tiengine.engine.spline_step import Contact, SplineStep, Suspension
from tiengine.engine.spline_tables import CarTables, RailTables, SeatTables, SlabTables, Spans, spans_of
from tiengine.engine.vector_mode import lanes_for
from tiengine.kernels import layout as at
from tiengine.kernels import spline_layout as sl
from tiengine.kernels.wheel_rail import COS, N_CONTACT
from tiengine.model.implicit_seats import seat_inverse_terms
from tiengine.model.sine_model import SineModel as Model
from tiengine.track.slab_matrices import seat_shapes
from tiengine.vehicle.train import TrainModel

Floats = NDArray[np.float64]
SINK = 2e-4
"""m: presses the wheels on the rails."""


def graded_knots(length: float, wheels: Floats, fine: float, coarse: float) -> Floats:
    """Clamped knots, ``fine`` within 0.5 m of a wheel, growing by a fifth of the distance up to ``coarse``."""
    s, inner = 0.0, [0.0]
    while s < length:
        away = max(0.0, float(np.abs(wheels - s).min()) - 0.5)
        s += min(coarse, fine + 0.2 * away)
        inner.append(s)
    inner = list(np.array(inner) * (length / inner[-1]))
    return np.array([0.0] * 3 + inner + [length] * 3)


@dataclass(frozen=True, eq=False)
class SplineRail:
    """Matrices of a rail on clamped knots, pinned by holding the end functions of w, v, theta_x."""

    knots: Floats
    n: int
    vertical: BandedBlock
    lateral: BandedBlock


def spline_rail(model: Model, knots: Floats, V: float) -> SplineRail:
    """Galerkin matrices in their weak form; A_s smears the fastenings."""
    rail, c = model.ingredients.rail, model.constants
    n = len(knots) - 4
    breaks = knots[3 : n + 1]
    x, weight = np.polynomial.legendre.leggauss(5)
    half = 0.5 * np.diff(breaks)[:, None]
    points, weights = ((breaks[:-1, None] + half) + half * x).ravel(), (half * weight).ravel()
    spline = BSpline(knots, np.eye(n), 3)
    N, D = sp.csr_array(spline(points)), sp.csr_array(spline.derivative()(points))
    N.data[np.abs(N.data) < 1e-15] = 0.0
    W = sp.diags_array(weights)
    nn, nd, dd = N.T @ W @ N, N.T @ W @ D, D.T @ W @ D
    mw, mty, mv, mtz, mtx = rail.densities
    shear_w, shear_v = rail.kappa_vertical * rail.G * rail.A, rail.kappa_lateral * rail.G * rail.A
    smeared_v = (c[at.BETA_DT2] * c[at.K_VERTICAL] + c[at.GAMMA_DT] * c[at.C_VERTICAL]) / c[at.SPACING]
    smeared_l = (c[at.BETA_DT2] * c[at.K_LATERAL] + c[at.GAMMA_DT] * c[at.C_LATERAL]) / c[at.SPACING]
    a, b2 = rail.arm_fastening, rail.half_base**2
    ends = np.array([0, n - 1])
    vertical = BandedBlock(
        M=_interleave([[mw * nn, None], [None, mty * nn]]),
        C=_interleave([[-2 * V * mw * nd, None], [None, -2 * V * mty * nd]]),
        K=_interleave(
            [
                [(shear_w - V**2 * mw) * dd, -shear_w * nd.T],
                [-shear_w * nd, shear_w * nn + (rail.E * rail.Iy - V**2 * mty) * dd],
            ]
        ),
        A_s=_interleave([[smeared_v * nn, None], [None, 0.0 * nn]]),
        held=2 * ends,
    )
    lateral = BandedBlock(
        M=_interleave([[mv * nn, None, None], [None, mtz * nn, None], [None, None, mtx * nn]]),
        C=_interleave([[-2 * V * m * nd if i == j else None for j, m in enumerate((mv, mtz, mtx))] for i in range(3)]),
        K=_interleave(
            [
                [(shear_v - V**2 * mv) * dd, -shear_v * nd.T, None],
                [-shear_v * nd, shear_v * nn + (rail.E * rail.Iz - V**2 * mtz) * dd, None],
                [None, None, (rail.GK - V**2 * mtx) * dd],
            ]
        ),
        A_s=_interleave(
            [
                [smeared_l * nn, None, -a * smeared_l * nn],
                [None, 0.0 * nn, None],
                [-a * smeared_l * nn, None, (a**2 * smeared_l + b2 * smeared_v) * nn],
            ]
        ),
        held=np.concatenate([3 * ends, 3 * ends + 2]),
    )
    return SplineRail(knots, n, vertical, lateral)


def _interleave(blocks: list[list[Any]]) -> sp.csr_array:
    """Fields of a function side by side."""
    fields, total = len(blocks), None
    for f, row in enumerate(blocks):
        for g, block in enumerate(row):
            if block is not None:
                unit = np.zeros((fields, fields))
                unit[f, g] = 1.0
                term = sp.csr_array(sp.kron(block, unit))
                total = term if total is None else total + term
    total.eliminate_zeros()
    return sp.csr_array(total)


def cars_of(train: TrainModel) -> list[NDArray[np.intp]]:
    """Coordinates that hang together."""
    linked = sp.csr_array((train.K != 0.0) | (train.C != 0.0) | (train.M != 0.0))
    row = np.repeat(train.element_index[:, :1], train.element_index.shape[1], axis=1)
    used = train.element_row != 0.0
    elements = sp.coo_array((np.ones(used.sum()), (row[used], train.element_index[used])), shape=linked.shape)
    count, number = sp.csgraph.connected_components(linked + elements.tocsr(), directed=False)
    big = [np.flatnonzero(number == k) for k in range(count)]
    # coordinates without any coupling (a wheelset's pitch) go with their body
    cars = [list(part) for part in big if len(part) > 5]
    for part in big:
        if len(part) <= 5:
            body = part[0] // 5 * 5
            next(car for car in cars if any(body <= dof < body + 5 for dof in car)).extend(part)
    return [np.array(sorted(car)) for car in cars]


@dataclass(eq=False)
class Bed:
    """A bound step with all its parts."""

    model: Model
    rail: SplineRail
    spans: Spans
    wheel_s: Floats
    V: float
    state: SplineArrays
    seats: SeatTables
    slabs: SlabTables
    rails: RailTables
    contact: Contact
    clock: Floats
    irregularity: Floats
    record: Floats
    body_record: Floats
    slab_bed: SlabBed
    step: SplineStep
    designs: list[tuple[Floats, Floats, Floats]]

    def start(self, seed: int, kick: float = 1.0) -> None:
        """Every coordinate of every train a small number of its own; the same for train b in any batch."""
        s = self.state
        rails = {row: np.zeros((s.trains, 2, s.functions, 5)) for row in (sl.U, sl.V, sl.A)}
        cars = {row: np.zeros((s.trains, self.model.ingredients.train.n)) for row in (sl.U, sl.V, sl.A)}
        for b in range(s.trains):
            rng = np.random.default_rng((seed, b))
            for row, size in ((sl.U, 1e-4), (sl.V, 1e-2), (sl.A, 1.0)):
                rails[row][b] = kick * size * rng.standard_normal((2, s.functions, 5))
                for field in (0, 2, 4):
                    rails[row][b][:, [0, -1], field] = 0.0
                cars[row][b] = kick * 0.1 * size * rng.standard_normal(self.model.ingredients.train.n)
                view = s.slabs(row)[b]
                view[...] = kick * 0.1 * size * rng.standard_normal(view.shape)
        for row in (sl.U, sl.V, sl.A):
            s.set_rails(row, rails[row])
            s.set_vehicles(row, cars[row])
            z = cars[sl.U]
        z[:, self.model.ingredients.train.wheelset_dof[:, 1]] += SINK
        s.set_vehicles(sl.U, z)


def _slab_designs(model: Model) -> list[tuple[Floats, Floats, Floats]]:
    """A, K, C of every design, as ``tiengine.model`` makes them."""
    given = model.ingredients
    seats = seat_shapes(given.designs.matrices[0])
    out = []
    for slab, scale in zip(given.designs.matrices, given.designs.seat_scale, strict=True):
        K = slab.K_plate if given.explicit_mortar else slab.K_plate + slab.K_bed
        C = np.zeros_like(K) if given.explicit_mortar else slab.C_bed
        own_K, own_C = seat_inverse_terms(seats, scale, given.fastening, given.rail.half_base)
        A = given.newmark.operator(sp.csr_array(slab.M), sp.csr_array(C + own_C), sp.csr_array(K + own_K)).toarray()
        out.append((A, K, C))
    return out


def make_bed(
    model: Model, V: float, lanes: int | None = None, fine: float = 0.3, coarse: float = 1.0, steps: int = 8,
    passes: int = 2, pad: float = 0.15, X: float = 0.0,
    absorbing: float = 0.0, residual: float = 0.0, soft: tuple[int, ...] = (), factors: bool = False,
    tolerance: float | None = None,
) -> Bed:  # fmt: skip
    """Everything for ``model.ingredients.trains`` trains.

    Args:
        model: Parts other than the rails.
        V: Speed [m/s].
        lanes: Of the rails' vectors; as many as the step takes by itself if None.
        fine: Knots at the wheels [m].
        coarse: Knots far away [m].
        steps: Rows of the chunk.
        passes: Passes a step.
        pad: Length of a seat [m].
        X: Chainage of the window's rear end [m].
        absorbing: Length of the absorbing zones [m].
        residual: Compliance under the wheels [m/N].
        soft: Slots whose slab stands on half the bed, a design of its own.
        factors: Fastenings with factors of their own, one failed.
        tolerance: Of the contact in the last pass, relative to the static load; the model's if None.
    """
    given, train = model.ingredients, model.ingredients.train
    c = model.constants.copy()
    c[at.ABSORBING_ZONE] = absorbing
    c[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1] = residual
    c[at.CONTACT_TOLERANCE] = c[at.CONTACT_TOLERANCE] if tolerance is None else tolerance
    model = replace(model, constants=c)
    B, W = given.trains, len(train.wheelset_x)
    knots = graded_knots(given.length, given.wheel_s, fine, coarse)
    rail = spline_rail(model, knots, V)
    spans = spans_of(knots)
    beta_dt2, gamma_dt = given.newmark.beta_dt2, given.newmark.gamma_dt
    rails = RailTables.of(rail.vertical, rail.lateral, spans, given.wheel_s, beta_dt2, gamma_dt)
    first = given.designs.matrices[0]
    designs = _slab_designs(model)
    A, K, C = designs[0]
    designs.append((A - 0.5 * (beta_dt2 * K + gamma_dt * C), 0.5 * K, 0.5 * C))
    slabs = SlabTables.of(designs, first.seat_index, first.seat_w, first.seat_slope, first.seat_x)
    cars = CarTables.of(
        train.M, train.C + V * train.C_speed, train.K, cars_of(train), train.wheelset_dof, train.element_index,
        beta_dt2, gamma_dt,
    )  # fmt: skip
    seat_count = int(np.ceil((given.length + pad) / c[at.SPACING])) + 1
    seats = SeatTables.of(seat_count, pad, spans)
    state = SplineArrays.at_rest(B, lanes or lanes_for(B), rail.n, seat_count, W, given.slots, slabs, cars)
    state.slab_design.reshape(state._whole, -1)[:, list(soft)] = len(designs) - 1
    if factors:
        given_factors = np.random.default_rng(3).uniform(0.5, 1.0, (B, seat_count, 2))
        given_factors[:, seat_count // 2] = 0.0
        state.set_seat_factors(given_factors)
    rows = at.CONTACT_ROWS[given.contact.patches]
    contact = Contact(
        wheel=model.wheel, table=given.contact.values, contact=np.zeros((B, W, rows, N_CONTACT)),
        force=np.zeros((B, W, rows, 4)), wheelset_force=np.zeros((B, W, 5)), rail_force=np.zeros((B, W, 2, 3)),
        iterations=np.zeros((B, W), dtype=np.int32),
    )  # fmt: skip
    contact.contact[..., COS] = 1.0
    clock = np.zeros((steps, at.N_CLOCK))
    x = X + V * given.newmark.dt * np.arange(1, steps + 1)
    rear = np.maximum(np.floor((x - pad / 2) / c[at.SPACING] - 0.5).astype(int) + 1, 0)
    clock[:, at.POSITION], clock[:, at.SPEED], clock[:, at.FIRST_SEAT] = x, V, rear
    clock[:, at.FIRST_SEAT_S] = (rear + 0.5) * c[at.SPACING] - x
    clock[:, at.FIRST_SLAB] = np.floor(x / given.slab.pitch)
    irregularity = np.zeros((B, steps, W, at.N_IRREGULARITY))
    for b in range(B):
        irregularity[b] = 1e-4 * np.random.default_rng((7, b)).standard_normal((steps, W, at.N_IRREGULARITY))
    record = np.zeros((B, steps, W, 2, at.N_WHEEL_RECORD[given.contact.patches]))
    body_record = np.zeros((B, steps, 3, train.n_dof))
    slab_record = aligned_zeros((B * steps * state.groups * state.slab_dofs * 3, 8))
    factor, lateral_K, lateral_C = (
        np.concatenate([f, f[:1]]) for f in (model.bed_factor, model.bed_lateral_K, model.bed_lateral_C)
    )
    rest = np.repeat(model.bed_rest[:1], given.slots, axis=0)
    slab_bed = SlabBed(
        model.bed_index, model.bed_shape, model.bed_weight, factor, rest, lateral_K, lateral_C, model.bed_numbers,
        np.zeros((B, given.slots, 2)),
    )  # fmt: skip
    step = SplineStep(
        state, model.dims, c, passes, rails, spans, seats, slabs,
        Suspension(train.element_row, train.element_kind, train.element_linear, train.element_table), contact, clock,
        irregularity, record, body_record, slab_record, slab_bed,
        LoadRows(given, model.vehicle_load, cars.load_place, 8 * cars.blocks * len(cars.car), 8, steps),
    )  # fmt: skip
    return Bed(
        model, rail, spans, given.wheel_s, V, state, seats, slabs, rails, contact, clock, irregularity, record,
        body_record, slab_bed, step, designs,
    )  # fmt: skip


def with_trains(model: Model, trains: int) -> Model:
    """The same model for another number of trains (dims only)."""
    dims = model.dims.copy()
    dims[at.TRAINS] = trains
    return replace(model, ingredients=replace(model.ingredients, trains=trains), dims=dims)
