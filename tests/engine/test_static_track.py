"""Track under steady loads: published deflections, and the kernels' balance of the host's solution."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.sine_state import SineState
from tiengine.engine.static_track import StaticTrack
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.model.sine_model import SineModel as Model

from ..explicit import Explicit
from ..models import V350, paper_model

SEAT, MIDSPAN = 28.5 * 0.63, 29.0 * 0.63  # m from the rear end, seats at (j + 1/2) d: nearest to the middle of 36 m
RIGID_GROUND = -1000  # rear slab: all slabs lie far behind the window

# FACTS 3.6: 70 kN, seats 4e7 N/m at 0.63 m, rigid slab; mm over a seat and at mid-span
PUBLISHED = {
    ("euler", 60): (0.67808, 0.67852),
    ("euler", 120): (0.68298, 0.68859),
    ("euler", 240): (0.68338, 0.69015),
    ("timoshenko", 60): (0.69702, 0.69778),
    ("timoshenko", 120): (0.70551, 0.72013),
    ("timoshenko", 240): (0.70745, 0.72637),
}


@pytest.mark.parametrize(("beam", "modes"), PUBLISHED)
def test_published_deflection(beam: str, modes: int) -> None:
    """Static deflection under 70 kN, all printed digits; the Euler rows with shear made 1e-5 of what it is."""
    model = paper_model(modes=modes)
    if beam == "euler":
        section = model.ingredients.rail
        model = paper_model(modes=modes, rail=section.model_copy(update={"G": 1e5 * section.G}))
    state = SineState.at_rest(model)
    state.enter(0, 0)
    state.first_slab = RIGID_GROUND
    track = StaticTrack(model, state, 0.315, 0.0)
    for place, printed in zip((SEAT, MIDSPAN), PUBLISHED[beam, modes], strict=True):
        shape = model.window.shape(np.array([place]))[0]
        load = np.zeros(10 * modes)
        load[:modes] = 70e3 * shape
        vertical, _, _ = track.respond(load)
        assert abs(1e3 * shape @ vertical[0, :modes] - printed) < 0.6e-5  # half a digit, and the shear left: 3e-7
        assert not vertical[1].any()  # on rigid ground the other rail rests


def balance(model: Model, state: SineState, X: float, V: float) -> NDArray[np.float64]:
    """Forces out of balance on the slabs, shape (slots, dofs), at the state's displacements, at rest in the frame.

    Those on the rails are left in row F.
    """
    state.motion[at.U_PREDICTED], state.motion[at.V_PREDICTED] = state.motion[at.U], state.motion[at.V]
    clock = window_clock(model.ingredients.slab, np.array([X]), np.array([V]), np.zeros(1))
    explicit = Explicit(model, state, clock)
    explicit.first()
    out = explicit.on_slots(0)
    for slot, design in enumerate(state.design[0]):
        own: NDArray[np.float64] = state.view(at.LINEAR, "slabs")[0, slot]
        out[slot] += np.linalg.solve(model.slab_inverse[design].T, own)
    return out


DEFECTS = (
    'track.failed_fastenings=[{rail="left", seats=[20, 22]}, {rail="both", seats=[40, 40], factor=0.3}]',
    "track.mortar_voids=[{slab=3, x=[1.0, 1.65], y=[-1.25, 1.25]}]",
)


@pytest.mark.parametrize(("X", "V", "overrides"), [(101.35, V350, ()), (0.0, V350, DEFECTS), (7.77, 1e-9, DEFECTS)])
def test_kernels_balance_the_static_solution(X: float, V: float, overrides: tuple[str, ...]) -> None:
    """Loads on both rails: the kernels find host-made displacements in balance, defects and convection included."""
    model = paper_model(*overrides, V=V350)
    state = SineState.at_rest(model)
    clock = window_clock(model.ingredients.slab, np.array([X]), np.array([V]), np.zeros(1))[0]
    state.enter(int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB]))
    track = StaticTrack(model, state, float(clock[at.FIRST_SEAT_S]), V)
    rng = np.random.default_rng(5)
    force = rng.standard_normal((4, 2, 3)) * [70e3, 20e3, 2e3]
    vertical, lateral, slabs = track.motion(force)
    n = model.ingredients.modes
    state.view(at.U, "vertical")[0], state.view(at.U, "lateral")[0] = vertical, lateral
    state.view(at.U, "slabs")[0] = slabs
    on_slabs = balance(model, state, X, V)
    shape = model.wheel_shape[0]
    for side in range(2):
        for block, field, component in (("vertical", 0, 0), ("lateral", 0, 1), ("lateral", 2, 2)):
            rows = slice(field * n, (field + 1) * n)
            state.view(at.F, block)[0, side, rows] += force[:, side, component] @ shape
    # shear forces of 1e7 N cancel in the rail, plate forces of 1e7 N in the slabs: 1e-10 of them
    assert np.abs(state.motion[at.F, : int(model.dims[at.SLABS])]).max() < 2e-3
    assert np.abs(on_slabs).max() < 2e-3
    moved = track.under_wheels(force[None])[0]
    np.testing.assert_allclose(moved[:, :, 0], (shape @ vertical[:, :n].T), rtol=1e-9, atol=1e-12)
    assert not moved[:, :, 6:].any()  # at rest in the moving frame


def test_compliance_is_symmetric_at_rest() -> None:
    """Maxwell and Betti: at V = 0 the compliance between wheels is symmetric; convection and dampers break it."""
    model = paper_model()
    state = SineState.at_rest(model)
    state.enter(0, 0)

    def compliance(V: float) -> NDArray[np.float64]:
        track = StaticTrack(model, state, 0.315, V)
        unit = np.eye(24).reshape(24, 4, 2, 3)
        return track.under_wheels(unit)[..., :3].reshape(24, 24)

    still, moving = compliance(0.0), compliance(V350)
    np.testing.assert_allclose(still, still.T, atol=1e-12 * still.max())
    assert np.all(np.linalg.eigvalsh(still) > 0.0)
    assert np.abs(moving - moving.T).max() > 1e-4 * moving.max()


def test_local_compliance_stands_in_for_the_modes_left_out() -> None:
    """Rail under the wheels' own loads: 72 modes with and without the correction against 288."""
    V = V350
    found = {}
    for modes, local in ((72, False), (72, True), (288, True)):
        model = paper_model(modes=modes, local_compliance=local)
        state = SineState.at_rest(model)
        state.enter(0, 0)
        load = np.zeros((1, 4, 2, 3))
        load[..., 0], load[..., 1], load[..., 2] = 69e3, 3e3, 300.0
        found[modes, local] = StaticTrack(model, state, 0.315, V).under_wheels(load)[0]
    exact = found[288, True]
    without, with_it = (np.abs(found[72, local] - exact).max(axis=(0, 1)) for local in (False, True))
    # a half is required: the contrast of seats under short waves is not in the correction, nor the phase of sin^2;
    # the lateral deflection comes from bending and torsion, whose long waves are all there: it may only not be worse
    assert np.all(with_it[[0, 2]] < 0.5 * without[[0, 2]])
    assert with_it[1] <= without[1]
