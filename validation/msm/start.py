r"""Start of the full-length model: the engine's steady rolling, transferred to a rail that is fixed to the ground.

The equilibrium comes from the engine's own solver in a window so long that its ends have no effect, with as many
modes per metre. A field of the window that does not change in the moving frame is a travelling wave to the ground,

    q_i = (2/L) int W_i u ds,   q_i' = -V (2/L) int W_i u_s ds,   q_i'' = -V^2 k_i^2 q_i,

W_i the full rail's modes. From rest instead of this velocity, the rails would vibrate by 3 kN. Slabs are at rest,
loaded by the seats.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.sine_state import SineState
from tiengine.kernels import layout as at
from tiengine.model.ingredients import Ingredients
from tiengine.model.sine_model import build_sine_model
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import Scenario
from validation.msm.model import FullTrack
from validation.msm.step import FullState

__all__ = ["steady_rolling"]

MARGIN = 20.0
"""Window beyond the outer wheels for the start [m]: the deflection at its ends is exp(-20 m / 1 m)."""
SINE = (True, False, True, False, True)
"""Kind of the fields w, theta_y, v, theta_z, theta_x."""


def steady_rolling(track: FullTrack, state: FullState, scenario: Scenario, given: Ingredients, V: float) -> None:
    """Fill a state with steady rolling at speed V [m/s].

    Args:
        track: Constant data.
        state: State to fill.
        scenario: Source of the train's position at t = 0.
        given: Parts of the engine.
        V: Speed [m/s].
    """
    length = float(np.ptp(given.train.wheelset_x)) + 2.0 * MARGIN
    modes = round(track.modes / track.rail_length * length)
    model = build_sine_model(replace(given, grading=None, length=length, modes=modes), V)
    rolling = SineState.at_rest(model)
    rear = scenario.rear + scenario.centre_in_window - model.ingredients.centre_s
    equilibrium(model, rolling, rear, V)
    state.motion[: at.A + 1] = [rolling.view(row, "vehicles")[0] for row in (at.U, at.V, at.A)]
    state.contact[:], state.force[:] = rolling.contact, rolling.force
    state.wheelset_force[:], state.rail_force[:] = rolling.wheelset_force, rolling.rail_force
    fields = np.hstack([rolling.view(at.U, "vertical")[0], rolling.view(at.U, "lateral")[0]]).reshape(2, 5, modes)
    _carry_rails(track, state, fields, length, rear, V)
    _press_slabs(track, state)


def _carry_rails(track: FullTrack, state: FullState, fields: Reals, length: float, rear: float, V: float) -> None:
    """Project the window's fields, shape (2, 5, modes), onto the modes of the full rail."""
    modes = fields.shape[2]
    node, weight = np.polynomial.legendre.leggauss(8)
    cell = length / (2 * modes)  # two cells per half wave of the shortest mode
    s = (cell * (np.arange(2 * modes)[:, None] + 0.5 * (node + 1.0))).ravel()
    weights = np.tile(0.5 * cell * weight, 2 * modes) * 2.0 / track.rail_length
    kappa = np.arange(1, modes + 1) * np.pi / length
    k = np.arange(1, track.modes + 1) * np.pi / track.rail_length
    own = np.outer(s, kappa)
    along = np.outer(k, s + rear - track.rear)
    window = {True: (np.sin(own), kappa * np.cos(own)), False: (np.cos(own), -kappa * np.sin(own))}
    full = {True: np.sin(along) * weights, False: np.cos(along) * weights}
    for field, sine in enumerate(SINE):
        value, slope = window[sine]
        for rail in range(2):
            u = full[sine] @ (value @ fields[rail, field])
            state.rails[at.U, 5 * rail + field] = u
            state.rails[at.V, 5 * rail + field] = -V * (full[sine] @ (slope @ fields[rail, field]))
            state.rails[at.A, 5 * rail + field] = -(V**2) * k**2 * u


def _press_slabs(track: FullTrack, state: FullState) -> None:
    """Set the slabs in equilibrium with the rails' forces at the seats."""
    f, target, sign = track.fastening, track.transform.target, track.transform.sign
    base2, arm, m = track.half_base**2, track.rail.arm_fastening, track.slab_modes
    folded = np.zeros((6, track.transform.seats))
    u, v = (state.rails[row].reshape(2, 5, -1) for row in (at.U, at.V))
    vertical = f.vertical_stiffness * u + f.vertical_damping * v
    lateral = f.lateral_stiffness * u + f.lateral_damping * v
    for rail in range(2):
        rows = (vertical[rail, 0], base2 * vertical[rail, 4], lateral[rail, 2] - arm * lateral[rail, 4])
        for kind, row in enumerate(rows):
            np.add.at(folded[2 * kind + rail], target, sign * row)
    slabs, per_slab = track.seat_scale.shape[1:]
    pull = np.zeros((6, slabs * per_slab))
    pull[:, : track.transform.seats] = track.transform.to_seats(folded)
    pull = track.seat_scale * pull.reshape(3, 2, slabs, per_slab)
    across = np.stack([np.ones(per_slab), track.groups[0].slab.seat_x])
    for group in track.groups:
        for i in group.index:
            K, load = group.slab.stiffness.copy(), np.zeros(m + 2)
            for side in range(2):
                scale = track.seat_scale[side, i]
                w, slope = track.seat[side], track.seat[2 + side]
                K[:m, :m] += f.vertical_stiffness * ((w * scale) @ w.T + base2 * (slope * scale) @ slope.T)
                K[m:, m:] += f.lateral_stiffness * (across * scale) @ across.T
                load[:m] += w @ pull[0, side, i] + slope @ pull[1, side, i]
                load[m:] += across @ pull[2, side, i]
            state.slabs[0, i] = np.linalg.solve(K, load)
