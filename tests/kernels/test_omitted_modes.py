"""Sines left out, at the seats and under the wheels: the kernel against a solution in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.sine_state import SineState
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.kernels.omitted_modes import BEFORE, EARLIER, NOW
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals

from ..explicit import Explicit
from ..models import V350, paper_model

MODES, TRAINS, DT = 24, 2, 1e-4


def failed(first: int, count: int) -> Reals:
    """Left seats 20 to 22 failed, right seat 31 at 40 %."""
    scale = np.ones((count, 2))
    for number in range(first, first + count):
        if number in (20, 21, 22):
            scale[number - first, 0] = 0.0
        if number == 31:
            scale[number - first, 1] = 0.4
    return scale


class Case:
    """A step's explicit part from random numbers, with and without the sines left out."""

    def __init__(self, X: float, zone: float) -> None:
        self.model: SineModel = paper_model(
            modes=MODES, trains=TRAINS, seat_factors=failed, local_compliance=True, static_compliance=True,
            absorbing_zone=zone,
        )  # fmt: skip
        self.clock = window_clock(self.model.ingredients.slab, np.array([X]), np.array([V350]), np.zeros(1))
        rng = np.random.default_rng(7)
        self.state = self._state(self.model, rng)
        self.plain = self._state(paper_model(modes=MODES, trains=TRAINS, seat_factors=failed, absorbing_zone=zone), rng)
        self.plain.motion[:] = self.state.motion
        self.first = {name: values.copy() for name, values in self.state.arrays().items()}
        self.explicit = Explicit(self.model, self.state, self.clock)
        self.explicit.first()
        self.without = Explicit(self.plain.model, self.plain, self.clock)
        self.without.first()

    def _state(self, model: SineModel, rng: np.random.Generator) -> SineState:
        state = SineState.at_rest(model)
        state.enter(int(self.clock[0, at.FIRST_SEAT]), int(self.clock[0, at.FIRST_SLAB]))
        columns = state.motion.shape[1]
        state.motion[at.U], state.motion[at.V] = 1e-3 * rng.standard_normal(columns), 0.1 * rng.standard_normal(columns)
        state.motion[at.U_PREDICTED], state.motion[at.V_PREDICTED] = state.motion[at.U], state.motion[at.V]
        state.rail_force[:] = rng.standard_normal(state.rail_force.shape) * [7e4, 2e4, 2e3]
        state.seat_force[:] = rng.standard_normal(state.seat_force.shape) * np.array([2e4, 5e3, 5e2])[:, None]
        state.omitted[:] = rng.standard_normal(state.omitted.shape) * np.array([1e-5, 1e-5, 1e-4])[:, None, None]
        return state

    def expected(self, b: int, side: int, j: int) -> tuple[Reals, Reals]:
        """Forces of seat j on w, v, theta_x and the motion of its omitted sines: one 6 by 6 system."""
        model, g, first = self.model, self.model.ingredients, self.first
        modes = model.omitted.modes
        a, b2, f = g.rail.arm_fastening, g.rail.half_base**2, g.fastening
        s = float(self.clock[0, at.FIRST_SEAT_S]) + np.arange(g.seats) * g.slab.fastening_pitch
        from_wheels = modes.compliance(s[j] - g.wheel_s, 1)
        from_seats = modes.compliance(s[j] - s, 2)
        own = from_seats[:, j].copy()
        from_seats[:, j] = 0.0
        free = np.einsum("fw,wf->f", from_wheels, first["rail_force"][b, :, side])
        free -= np.einsum("fi,fi->f", from_seats, first["seat_force"][b, side])
        # rates: (3 r - 4 r_n + r_(n-1)) / (2 dt); what was now is r_n, what was before is r_(n-1)
        known = (first["omitted"][b, side, :, j, BEFORE] - 4.0 * first["omitted"][b, side, :, j, NOW]) / (2.0 * DT)
        arms = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -a], [0.0, 0.0, b2]])  # vertical, lateral, moment by w, v, theta_x
        k = np.array([f.vertical_stiffness, f.lateral_stiffness, f.vertical_stiffness])
        c = np.array([f.vertical_damping, f.lateral_damping, f.vertical_damping])
        factor = first["seat_scale"][b, j, side]
        zone = g.absorbing_zone
        depth = max(0.0, zone - min(s[j], g.length - s[j])) / zone if zone else 0.0
        # force = (factor + depth^2) (pull + k arms r + c arms dr) - factor slab; on the fields (F_V, F_L, M - a F_L)
        pull, slab = self.pulls(b, side, j)
        gain = factor + depth**2
        on_fields = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -a, 1.0]])
        stiff = gain * (k + 1.5 / DT * c)[:, None] * arms
        system = np.block([[np.eye(3), -stiff], [own[:, None] * on_fields, np.eye(3)]])
        load = np.concatenate([gain * (pull + c * (arms @ known)) - factor * slab, free])
        solved = np.linalg.solve(system, load)
        return on_fields @ solved[:3], solved[3:]

    def pulls(self, b: int, side: int, j: int) -> tuple[Reals, Reals]:
        """Forces at seat j by the sines of the rail and by the slab: vertical, lateral, moment, from the plain step."""
        k, g = self.without.stepper.scratch, self.model.ingredients
        slab, seat = np.divmod(int(self.clock[0, at.FIRST_SEAT]) + j, g.slab.fastenings)
        on_slab = k.slab_pull[0, b, slab % g.slots, [side, 4, 2 + side], seat]
        return k.rail_pull[b, side, :, j], on_slab * [1.0, 1.0, g.rail.half_base**2]


@pytest.mark.parametrize(("X", "zone"), [(3.21, 0.0), (4.05, 5.0)])
def test_against_a_system_a_seat(X: float, zone: float) -> None:
    """Every seat of two trains: forces, motion of the omitted sines, and what wheels feel of them."""
    case = Case(X, zone)
    g, modes = case.model.ingredients, case.model.omitted.modes
    s = float(case.clock[0, at.FIRST_SEAT_S]) + np.arange(g.seats) * g.slab.fastening_pitch
    inside = np.flatnonzero(s < g.length)
    change = np.zeros((TRAINS, len(g.wheel_s), 2, 3))
    for b in range(TRAINS):
        for side in range(2):
            for field in range(3):
                others = modes.compliance(np.subtract.outer(g.wheel_s, g.wheel_s), 0)[field] * (1.0 - np.eye(4))
                change[b, :, side, field] = others @ case.first["rail_force"][b, :, side, field]
            for j in inside:
                force, motion = case.expected(b, side, int(j))
                # the table between seats and wheels is linear over 2 mm: (k 2 mm)^2 / 8 of waves of half a metre, 1e-4
                size = np.abs(case.state.omitted[b, side, :, :, NOW]).max(axis=1)
                np.testing.assert_allclose(case.state.omitted[b, side, :, j, NOW] / size, motion / size, atol=1e-4)
                np.testing.assert_allclose(case.state.seat_force[b, side, :, j], force, rtol=1e-5, atol=0.5)
                change[b, :, side] -= (modes.compliance(g.wheel_s - s[j], 1) * force[:, None]).T
    found = (case.explicit.stepper.scratch.rail_predicted - case.without.stepper.scratch.rail_predicted)[..., :3]
    size = np.abs(change).max(axis=(0, 1, 2))
    np.testing.assert_allclose(found / size, change / size, atol=1e-4)
    np.testing.assert_array_equal(case.state.omitted[..., BEFORE], case.first["omitted"][..., NOW])
    np.testing.assert_array_equal(case.state.omitted[..., EARLIER], case.first["omitted"][..., BEFORE])


def test_seats_keep_what_is_known_of_them() -> None:
    """Two seats leave: the histories of the others move on with them, those that enter begin at rest."""
    case = Case(3.21, 0.0)
    before = case.state.omitted.copy(), case.state.seat_force.copy()
    case.state.enter(case.state.first_seat + 2, case.state.first_slab)
    for now, then in zip((case.state.omitted, case.state.seat_force), before, strict=True):
        np.testing.assert_array_equal(now[:, :, :, :-2], then[:, :, :, 2:])
        assert not now[:, :, :, -2:].any()
