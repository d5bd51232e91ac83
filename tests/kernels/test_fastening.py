"""Fastening kernel: against seat-by-seat sums, action and reaction, power, failures, seats entering and leaving."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.sine_state import SineState
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.model.model import Model
from tiengine.track.fastening import seat_count, seat_tables

from ..explicit import Explicit
from ..models import V350, paper_model
from ..reference.seats import Seat, seats

TRAINS = 2


def failed(first: int, count: int) -> NDArray[np.float64]:
    """Left seats 20-22 failed, right seat 31 at 40 %; more of them further on."""
    scale = np.ones((count, 2))
    for number in range(first, first + count):
        if number % 50 in (20, 21, 22):
            scale[number - first, 0] = 0.0
        if number % 50 == 31:
            scale[number - first, 1] = 0.4
    return scale


@pytest.fixture(scope="module")
def model() -> Model:
    """24 modes keep the reference quick; two trains; failed fastenings."""
    return paper_model(modes=24, trains=TRAINS, seat_factors=failed)


class Seated:
    """Kernel and reference at one window position."""

    def __init__(self, model: Model, X: float, V: float = V350) -> None:
        self.model, self.X, self.V = model, X, V
        self.state = SineState.at_rest(model)
        clock = window_clock(model.ingredients.slab, np.array([X]), np.array([V]), np.zeros(1))
        self.clock = clock
        self.first_slab = int(clock[0, at.FIRST_SLAB])
        self.state.enter(int(clock[0, at.FIRST_SEAT]), self.first_slab)
        self.constants = model.constants.copy()

    def randomise(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.state.motion[at.U] = 1e-3 * rng.standard_normal(self.state.motion.shape[1])
        self.state.motion[at.V] = 0.1 * rng.standard_normal(self.state.motion.shape[1])
        self.settle()

    def settle(self) -> None:
        """Let the iterate be the predictor, so that both forces on a slab are one."""
        motion = self.state.motion
        motion[at.U_PREDICTED], motion[at.V_PREDICTED] = motion[at.U], motion[at.V]

    def launch(self) -> None:
        self.explicit = Explicit(self.model, self.state, self.clock, self.constants)
        self.explicit.first()

    def on_rails(self, train: int) -> NDArray[np.float64]:
        return self.explicit.on_rails(train)

    def on_slabs(self, train: int) -> dict[int, NDArray[np.float64]]:
        """Generalised forces by slab index along the track."""
        slots = self.model.ingredients.slots
        q = self.explicit.on_slots(train)
        return {i: q[i % slots] for i in range(self.first_slab, self.first_slab + slots)}

    def rails(self, row: int, train: int) -> NDArray[np.float64]:
        """One row as (2, 5, N): w, theta_y, v, theta_z, theta_x."""
        n = self.model.ingredients.modes
        v, l = self.state.view(row, "vertical")[train], self.state.view(row, "lateral")[train]
        return np.concatenate([v.reshape(2, 2, n), l.reshape(2, 3, n)], axis=1)

    def slabs(self, row: int, train: int) -> dict[int, NDArray[np.float64]]:
        """One row by slab index along the track."""
        q, slots = self.state.view(row, "slabs")[train], self.model.ingredients.slots
        return {i: q[i % slots] for i in range(self.first_slab, self.first_slab + slots)}

    def expected(
        self, train: int, factor: Callable[[int, int], float]
    ) -> tuple[list[Seat], NDArray[np.float64], dict[int, NDArray[np.float64]]]:
        g = self.model.ingredients
        u, v = self.slabs(at.U, train), self.slabs(at.V, train)
        return seats(
            self.X,
            self.V,
            g.length,
            g.rail,
            g.fastening,
            g.slab,
            g.designs.matrices[0],
            np.stack([self.rails(at.U, train), self.rails(at.V, train)]),
            {i: np.stack([u[i], v[i]]) for i in u},
            factor,
        )


def by_number(number: int, side: int) -> float:
    return float(failed(number, 1)[0, side])


def test_seat_table() -> None:
    """Angle addition with the table gives sin(k_i (s0 + j d))."""
    n, length, d, s0 = 30, 36.0, 0.63, 0.2345
    table, k = seat_tables(n, length, d), np.arange(1, 31) * np.pi / length
    s = s0 + d * np.arange(seat_count(length, d))
    found = (np.sin(k * s0) * table[:n].T) + np.cos(k * s0) * table[n:].T
    np.testing.assert_allclose(found, np.sin(np.multiply.outer(s, k)), atol=1e-13)  # phases up to 100 rad
    assert seat_count(36.0, 0.63) == 59  # 36/0.63 = 57.1: 58 seats at most, one for the count's rounding


@pytest.mark.parametrize("seed", range(6))
def test_against_seat_by_seat(model: Model, seed: int) -> None:
    """Random motion of rails and slabs, random window position, failed fastenings, two trains."""
    X = float(np.random.default_rng(100 + seed).uniform(0.0, 600.0)) if seed else 0.0
    case = Seated(model, X)
    case.randomise(seed)
    case.launch()
    for train in range(TRAINS):
        found, on_rails, on_slabs = case.expected(train, by_number)
        largest = max(np.abs(seat.force).max() for seat in found)
        # k u of 1e5 N summed over 57 seats, phases of 1e2 rad from chainages of 1e2 m: 1e-12 relative
        np.testing.assert_allclose(case.on_rails(train), on_rails, atol=1e-11 * largest)
        for i, force in case.on_slabs(train).items():
            np.testing.assert_allclose(force, on_slabs[i], atol=1e-11 * largest)


def test_slab_motion_enters_twice(model: Model) -> None:
    """The force on the slab has its motion at the predictor, that on the rail at the iterate: see the kernel."""
    case = Seated(model, 33.3)
    case.randomise(7)
    case.launch()
    slabs = slice(int(model.dims[at.SLABS]), int(model.dims[at.VEHICLES]))
    rng = np.random.default_rng(8)
    case.state.motion[at.U, slabs] += 1e-3 * rng.standard_normal(slabs.stop - slabs.start)
    case.explicit.second()
    _, on_rails, _ = case.expected(0, by_number)
    largest = np.abs(on_rails).max()
    np.testing.assert_allclose(case.on_rails(0), on_rails, atol=1e-11 * largest)
    case.state.motion[at.U, slabs] = case.state.motion[at.U_PREDICTED, slabs]
    _, _, on_slabs = case.expected(0, by_number)
    for i, force in case.on_slabs(0).items():
        np.testing.assert_allclose(force, on_slabs[i], atol=1e-11 * largest)


def test_action_equals_reaction(model: Model) -> None:
    """Forces of the seats on rails and slabs cancel: total vertical and lateral force, and roll moment.

    The moment is taken about the seat: on the slab M_b, on the rail -M_b + a F_L, whose F_L acts the arm a lower.
    """
    case = Seated(model, 210.0)
    case.randomise(9)
    case.launch()
    g = model.ingredients
    plate = g.designs.matrices[0]
    w = np.zeros(plate.n)
    w[: plate.n - 2 : 3] = 1.0  # rigid translation of the plate: nodal w
    roll = np.zeros(plate.n)
    y = np.linspace(-g.slab.width / 2, g.slab.width / 2, g.slab.elements_y + 1)
    roll[0 : plate.n - 2 : 3], roll[2 : plate.n - 2 : 3] = np.tile(y, g.slab.elements_x + 1), 1.0
    arm = g.slab.seat_half_spacing * np.array([-1.0, 1.0])
    for train in range(TRAINS):
        force = case.state.seat_force[train]  # F_V, F_L, M_b - a F_L, on the slab
        scale = np.abs(force).sum()
        slabs = np.sum(list(case.on_slabs(train).values()), axis=0)
        assert abs(slabs @ w - force[:, 0].sum()) < 1e-12 * scale
        assert abs(slabs[-2] - force[:, 1].sum()) < 1e-12 * scale
        moment = np.sum(force[:, 2] + g.rail.arm_fastening * force[:, 1]) + arm @ force[:, 0].sum(axis=1)
        assert abs(slabs @ roll - moment) < 1e-12 * scale
        # on the rails the same forces, spread over the trial functions
        s = case.clock[0, at.FIRST_SEAT_S] + g.slab.fastening_pitch * np.arange(force.shape[2])
        shape = model.window.shape(s)
        rails = case.on_rails(train)
        for component, field in enumerate((0, 2, 4)):
            np.testing.assert_allclose(rails[:, field], -force[:, component] @ shape, atol=1e-12 * scale)
        assert not rails[:, [1, 3]].any()  # seats carry no bending moment


def test_rigid_translation_is_free(model: Model) -> None:
    """Rails and slabs that move together strain no fastening where the rails' sine series has converged."""
    case = Seated(model, 12.0)
    n = model.ingredients.modes
    series = np.array([4.0 / (i * np.pi) if i % 2 else 0.0 for i in range(1, n + 1)])
    # Fejer means of the series of 1 do not overshoot; the error in the middle falls with 1/N
    series = series * (1.0 - np.arange(1, n + 1) / (n + 1.0))
    case.state.view(at.U, "vertical")[:, :, :n] = 1e-3 * series
    case.state.view(at.U, "lateral")[:, :, :n] = 2e-3 * series
    plate = case.state.view(at.U, "slabs")
    plate[..., : plate.shape[-1] - 2 : 3], plate[..., -2] = 1e-3, 2e-3
    case.settle()
    case.launch()
    force = case.state.seat_force[0][:, :, 25:33]
    error = np.abs(model.window.shape(np.linspace(15.0, 21.0, 61)) @ series - 1.0).max()
    assert error < 0.04
    k = model.ingredients.fastening
    assert np.abs(force[:, 0]).max() < 1e-3 * k.vertical_stiffness * error * 1.001 + 1e-3 * 1e4 * error
    # a rail running over a ground-fixed shape has no material rate in the middle but that of the series' ripple
    assert np.abs(force[:, 1]).max() < 2e-3 * k.lateral_stiffness * error * 1.5 + 20.0


@pytest.mark.parametrize("seed", range(5))
def test_dampers_only_take_power(model: Model, seed: int) -> None:
    """Springs off: force times relative material rate is a loss at every seat, and none is fed to the whole."""
    case = Seated(model, float(np.random.default_rng(seed).uniform(0.0, 300.0)))
    case.randomise(20 + seed)
    case.constants[[at.K_VERTICAL, at.K_LATERAL]] = 0.0
    case.launch()
    found, _, _ = case.expected(0, by_number)
    kernel = case.state.seat_force[0]
    first = int(case.clock[0, at.FIRST_SEAT])
    a = model.ingredients.rail.arm_fastening
    on_slabs = lost = 0.0
    for seat in found:
        F_V, F_L, M = kernel[seat.side, :, seat.number - first]
        force = np.array([F_V, F_L, M + a * F_L])  # the last is M_b
        rate, under = seat.rail[1], seat.slab[1]
        power = force @ (under - [rate[0], rate[1] - a * rate[2], rate[2]])
        assert power <= 0.0
        assert power < 0.0 or by_number(seat.number, seat.side) == 0.0
        on_slabs += force @ under
        lost -= power
    generalised = sum(case.on_slabs(0)[i] @ rate for i, rate in case.slabs(at.V, 0).items())
    assert abs(generalised - on_slabs) < 1e-11 * lost  # the slabs' share through their shape functions


def test_failed_fastening_is_not_there(model: Model) -> None:
    """Zero factor, zero force, and nothing on the slab below it."""
    case = Seated(model, 0.0)
    case.randomise(30)
    case.state.seat_scale[:] = 0.0
    case.launch()
    assert not case.on_rails(0).any()
    assert not case.explicit.on_slots(0).any()
    assert not case.state.seat_force.any()
    case.state.seat_scale[:, 21, 0] = 1.0
    case.launch()
    used = np.flatnonzero(np.abs(case.state.seat_force[0]).max(axis=(0, 1)))
    np.testing.assert_array_equal(used, [21])
    assert not case.on_rails(0)[1].any()  # right rail
    moved = [i for i, f in case.on_slabs(0).items() if f.any()]
    assert moved == [21 // 9]


@pytest.mark.parametrize("edge", [0.0, 36.0])
def test_seats_enter_and_leave_without_a_jump(model: Model, edge: float) -> None:
    """The force on the rails is continuous while a seat passes the window's end."""
    # a seat passes s = 0 at X = (j + 1/2) d and s = l at X = (j + 1/2) d - l
    X = (100.5 * 0.63) if edge == 0.0 else (160.5 * 0.63 - 36.0)
    forces = []
    for shift in (-1e-9, 1e-9):
        case = Seated(model, X + shift)
        case.randomise(40)
        case.state.view(at.U, "slabs")[:] = 0.0  # else the slabs' own motion would act beyond the end
        case.state.view(at.V, "slabs")[:] = 0.0
        case.settle()
        case.constants[[at.C_VERTICAL, at.C_LATERAL]] = 0.0  # -V w' is not zero at the end; its force's share is
        case.launch()
        forces.append(case.on_rails(0))
    scale = np.abs(forces[0]).max()
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-6 * scale)  # 2 nm of 36 m/24 modes


def test_seats_beyond_the_slabs_stand_on_rigid_ground() -> None:
    """With the paper's count of slabs the window can touch one more: those seats feel a slab that does not move."""
    model = paper_model(modes=24, cover=False)
    X = 5.67 * 4 - 0.4  # 36 m from here touch slabs 3..10, seven of them are modelled
    case = Seated(model, X)
    case.randomise(50)
    case.launch()
    found, on_rails, on_slabs = case.expected(0, lambda number, side: 1.0)
    assert model.ingredients.slots == 7
    assert any(not seat.slab.any() for seat in found)
    largest = max(np.abs(seat.force).max() for seat in found)
    np.testing.assert_allclose(case.on_rails(0), on_rails, atol=1e-11 * largest)
    for i, force in case.on_slabs(0).items():
        np.testing.assert_allclose(force, on_slabs[i], atol=1e-11 * largest)


def test_smeared_part_is_the_mean_of_the_seats(model: Model) -> None:
    """Averaged over where they stand, the seats are l/(2 d) k on each mode: the stand-in in the rail's block."""
    d, length, n = 0.63, 36.0, 24
    k = np.arange(1, n + 1) * np.pi / length
    starts = (np.arange(200) + 0.5) / 200 * d
    mean = np.zeros((n, n))
    for s0 in starts:
        s = np.arange(s0, length, d)
        shape = np.sin(np.multiply.outer(s, k))
        mean += shape.T @ shape / len(starts)
    np.testing.assert_allclose(mean, length / (2.0 * d) * np.eye(n), atol=2e-4 * length / (2.0 * d))


def test_absorbing_zone_is_more_fastening_to_the_ground(model: Model) -> None:
    """Against springs and dampers to the ground written out seat by seat; the slabs do not feel it."""
    zone, X = 6.0, 33.3
    case, plain = Seated(model, X), Seated(model, X)
    case.constants[at.ABSORBING_ZONE] = zone
    for each in (case, plain):
        each.randomise(3)
        each.launch()
    g = model.ingredients
    k, a, b2 = g.fastening, g.rail.arm_fastening, g.rail.half_base**2
    first, inside = int(case.clock[0, at.FIRST_SEAT]), 0
    difference = (case.state.seat_force - plain.state.seat_force)[0]
    largest = np.abs(plain.state.seat_force).max()
    for seat in case.expected(0, by_number)[0]:
        depth = max(0.0, zone - min(seat.s, g.length - seat.s)) / zone
        (w, v, roll), (dw, dv, droll) = seat.rail
        F_V = k.vertical_stiffness * w + k.vertical_damping * dw
        F_L = k.lateral_stiffness * (v - a * roll) + k.lateral_damping * (dv - a * droll)
        M = b2 * (k.vertical_stiffness * roll + k.vertical_damping * droll)
        expected = depth**2 * np.array([F_V, F_L, M - a * F_L])
        found = difference[seat.side, :, seat.number - first]
        np.testing.assert_allclose(found, expected, atol=1e-11 * largest)  # as seat by seat above
        inside += depth == 0.0
        assert depth > 0.0 or not found.any()
    assert 0 < inside < 2 * len(difference[0, 0])
    np.testing.assert_array_equal(case.explicit.on_slots(0), plain.explicit.on_slots(0))
