"""Contact kinematics: table lookup, virtual work of the normal force, rolling without slip."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.contact.table import ContactTable
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.model.model import Model

from ..models import V350, paper_model
from ..wheelsets import (
    DTX,
    DV,
    DW,
    PITCH,
    ROLL,
    RTX,
    RV,
    RW,
    SIGMA,
    SINKING,
    TX,
    V_,
    W_,
    YAW,
    Wheelsets,
    Y,
    Z,
    with_friction,
)


@pytest.fixture(scope="module")
def model() -> Model:
    return paper_model()


def test_lookup_is_the_tables(model: Model) -> None:
    """Kernel and host interpolate alike, and hold the table's end beyond it."""
    rng = np.random.default_rng(1)
    u = np.concatenate([rng.uniform(-16e-3, 13e-3, 400), [-30e-3, -16.04e-3, 13.04e-3, 30e-3]])
    alpha = np.concatenate([rng.uniform(-6e-3, 6e-3, 400), [0.0, 1e-3, -20e-3, 20e-3]])
    x = Wheelsets(len(u))
    r0 = model.wheel[0, 0]
    x.u[:, 0, ROLL] = alpha
    x.u[:, 0, Y] = u + r0 * alpha  # right wheel: u = y - r0 phi
    contact = x.evaluate(model).contact[:, 0, 1]
    table: ContactTable = model.ingredients.contact
    expected = table.lookup(np.clip(u, -16e-3, 13e-3), np.clip(alpha, -6e-3, 6e-3))
    # beyond its range the kernel goes on to the outermost cell's far node, one step further
    inside = (np.abs(alpha) <= 6e-3) & (u >= -16e-3) & (u <= 13e-3)
    columns = [wr.S_W, wr.S_R, wr.R_C, wr.KH, wr.K11, wr.K22, wr.K23, wr.K33]
    theirs = [at.S_WHEEL, at.S_RAIL, at.RADIUS, at.HERTZ, at.C11, at.C22, at.C23, at.C33]
    np.testing.assert_allclose(contact[inside][:, columns], expected[inside][:, theirs], rtol=1e-11, atol=1e-16)
    np.testing.assert_allclose(contact[inside][:, wr.SHIFT], u[inside], atol=1e-16)
    np.testing.assert_allclose(contact[:, wr.TILT], alpha, atol=1e-16)
    assert np.isfinite(contact).all()
    tangent = contact[inside][:, wr.SIN] / contact[inside][:, wr.COS]
    np.testing.assert_allclose(tangent, expected[inside][:, at.TAN_GAMMA], atol=1e-13)
    p = model.wheel[0, 1] * alpha - expected[:, at.GAP]
    cosine = np.cos(np.arctan(expected[:, at.TAN_GAMMA]))
    np.testing.assert_allclose(contact[inside][:, wr.DELTA], (p * cosine)[inside], atol=1e-15)


def over_the_flange() -> Wheelsets:
    """Shifts from -14 to +11.5 mm of the right wheel, with roll, torsion and cross level."""
    shifts = np.linspace(-14e-3, 11.5e-3, 511)
    rng = np.random.default_rng(2)
    x = Wheelsets(len(shifts))
    x.u[:, 0, ROLL] = rng.uniform(-2e-3, 2e-3, len(shifts))
    x.rail[:, 0, :, :3] = rng.uniform(-1, 1, (len(shifts), 2, 3)) * [1e-3, 3e-4, 2e-3]
    x.track[:, 0, : at.GAUGE + 1] = rng.uniform(-1, 1, (len(shifts), 4)) * [3e-3, 2e-3, 1.5e-3, 1e-3]
    x.u[:, 0, Y] = shifts
    return x


def place_right(x: Wheelsets, model: Model) -> None:
    """Move each wheelset so that the right wheel's relative shift is what ``u[Y]`` holds."""
    wanted = x.u[:, 0, Y].copy()
    x.u[:, 0, Y] += wanted - x.evaluate(model).contact[:, 0, 1, wr.SHIFT]


@pytest.mark.parametrize("side", [0, 1])
def test_normal_forces_are_virtual_work(model: Model, side: int) -> None:
    """Without friction the generalised forces are -N cos gamma dp/dq: within 0.3 % of N, moments within N 3 mm."""
    frictionless = with_friction(model, 1e-12)
    x = over_the_flange()
    place_right(x, model)
    if side == 0:  # mirror
        x.u[:, 0, [Y, ROLL]] *= -1.0
        x.rail[:, 0] = x.rail[:, 0, ::-1]
        x.rail[:, 0, :, [V_, TX]] *= -1.0
        x.track[:, 0, [at.Y_A, at.CROSS_LEVEL]] *= -1.0
    # only this side carries: the other rail is let down
    x.u[:, 0, Z] += SINKING - x.penetration(model)[:, side]
    x.rail[:, 0, 1 - side, W_] += 0.05
    found = x.evaluate(frictionless)
    contact = found.contact[:, 0, side]
    np.testing.assert_allclose(contact[:, wr.SHIFT], np.linspace(-14e-3, 11.5e-3, 511), atol=1e-12)
    assert not found.local[:, 0, 1 - side].any()
    N = found.local[:, 0, side, 0]
    assert np.all(N > 0.0)
    cosine = np.cos(x.gamma(found.contact[:, 0])[:, side])
    h = 1e-8
    worst = {}
    for kind, q in (("u", Y), ("u", Z), ("u", ROLL), ("rail", W_), ("rail", V_), ("rail", TX)):
        forces = found.wheelset[:, 0, q] if kind == "u" else found.rail[:, 0, side, q]
        p = []
        for sign in (1.0, -1.0):
            array = x.u[:, 0] if kind == "u" else x.rail[:, 0, side]
            array[:, q] += sign * h
            p.append(x.penetration(model)[:, side])
            array[:, q] -= sign * h
        expected = -N * cosine * (p[0] - p[1]) / (2.0 * h)
        worst[kind, q] = np.abs(forces / N - expected / N).max()
    for place in (("u", Y), ("u", Z), ("rail", W_), ("rail", V_)):
        assert worst[place] < 3e-3, worst
    for place in (("u", ROLL), ("rail", TX)):
        assert worst[place] < 3e-3, worst  # metres


def creepages(x: Wheelsets, model: Model, V: float = V350) -> NDArray[np.float64]:
    """Longitudinal less 1 - r_c/r0, lateral, spin less its geometric part; (B, 2, 3)."""
    x.sink(model, SINKING)
    contact = x.evaluate(model, V).contact[:, 0]
    r0 = model.wheel[0, 0]
    turned = x.rail[:, 0, :, TX] + x.track[:, 0, at.CROSS_LEVEL, None]
    alpha = SIGMA * (x.u[:, 0, ROLL, None] - turned)
    xi = contact[..., wr.XI_X : wr.XI_S + 1].copy()
    xi[..., 0] -= 1.0 - contact[..., wr.R_C] / r0
    xi[..., 2] += SIGMA / r0 * np.sin(x.gamma(contact) + alpha)
    return xi


SHIFTS = np.array([-7e-3, -3e-3, 0.0, 1.5e-3, 4e-3, 7e-3])  # the last two on the flange root of one side
NOTHING = 1e-15  # rounding of speeds of 1 m/s over 97 m/s


def test_following_a_vertical_shape(model: Model) -> None:
    """A shape of the rail over the ground, of the moving deflection, or of the track: the wheel rolls along it."""
    slope = 2e-3
    for kind in ("ground", "moving", "track"):
        x = Wheelsets(len(SHIFTS))
        x.u[:, 0, Y] = SHIFTS
        if kind == "ground":  # w(X + s): at constant s the rate is V w', and the wheel has it
            x.rail[:, 0, :, DW] = slope
            x.rail[:, 0, :, RW] = V350 * slope
            x.v[:, 0, Z] = V350 * slope
        elif kind == "moving":  # w(s) travels with the wheel, which keeps its height
            x.rail[:, 0, :, DW] = slope
        else:
            x.track[:, 0, at.Z_V_SLOPE] = slope
            x.v[:, 0, Z] = V350 * slope
        assert np.abs(creepages(x, model)).max() < NOTHING, kind


def test_following_a_lateral_shape(model: Model) -> None:
    """Rail bent over the ground, or an alignment: a wheelset that follows with its yaw has no creepage.

    At an inflection, since a curved path gives the outer wheel further to go.
    """
    slope = 1e-3
    for kind in ("ground", "moving", "track"):
        x = Wheelsets(len(SHIFTS))
        x.u[:, 0, Y] = SHIFTS
        x.u[:, 0, YAW] = slope
        if kind == "ground":  # v(X + s): at constant s the rate is V v', and the wheel has it
            x.rail[:, 0, :, DV] = slope
            x.rail[:, 0, :, RV] = V350 * slope
            x.v[:, 0, Y] = V350 * slope
        elif kind == "moving":  # v(s) travels along: the rail comes sideways at -V v', as the yawed wheel's rim does
            x.rail[:, 0, :, DV] = slope
        else:
            x.track[:, 0, at.Y_A_SLOPE] = slope
            x.v[:, 0, Y] = V350 * slope
        assert np.abs(creepages(x, model)).max() < NOTHING, kind


def test_following_a_twisted_rail(model: Model) -> None:
    """Torsion of each rail along the ground; one wheel at a time follows with roll, shift, height and yaw."""
    rate = 1e-3  # rad/m
    r0, _b0 = model.wheel[0, :2]
    h_r = model.constants[at.ARM_HEAD]
    x = Wheelsets(len(SHIFTS))
    x.u[:, 0, Y] = SHIFTS
    x.rail[:, 0, :, DTX], x.rail[:, 0, :, RTX] = rate, V350 * rate
    x.v[:, 0, ROLL] = V350 * rate
    x.v[:, 0, Y] = (r0 + h_r) * V350 * rate
    contact = x.evaluate(model).contact[:, 0]
    for side in range(2):
        # height that keeps the penetration, up to the distance of a contact from the line of table and crown (0.1 mm)
        lever = SHIFTS * SIGMA[side] - model.constants[at.CROWN_OFFSET]
        x.v[:, 0, Z] = SIGMA[side] * lever * V350 * rate
        h_c = h_r - (contact[:, side, wr.R_C] - r0)
        x.u[:, 0, YAW] = rate * h_c  # along the path of the head under this wheel
        slip = creepages(x, model)[:, side, 1]
        assert np.all(np.abs(slip) < rate * 1e-4 * np.abs(contact[:, side, wr.SIN]) + NOTHING)


def test_following_a_cross_level(model: Model) -> None:
    """Wheelset rolling with the track's twist.

    The remainder comes from the height and the place of the contact off tape circle and rail top.
    """
    rate = 1e-3  # rad/m
    r0 = model.wheel[0, 0]
    x = Wheelsets(len(SHIFTS))
    x.u[:, 0, Y] = SHIFTS
    x.track[:, 0, at.CROSS_LEVEL_SLOPE] = rate
    x.v[:, 0, ROLL] = V350 * rate
    x.v[:, 0, Y] = r0 * V350 * rate  # about an axis at the rails' top, as the track's channels turn
    x.v[:, 0, Z] = SHIFTS * V350 * rate
    contact = x.evaluate(model).contact[:, 0]
    slip = np.abs(creepages(x, model)[..., 1])
    lever = np.abs(contact[..., wr.R_C] - r0) * contact[..., wr.COS]
    lever += np.abs(contact[..., wr.S_W]) * np.abs(contact[..., wr.SIN])
    assert np.all(slip < rate * lever * (1.0 + 1e-9) + NOTHING)
    assert np.all(slip < 1e-6 + 1e-5 * (np.abs(contact[..., wr.SIN]) > 0.1))  # nothing against the 1e-3 of running


def test_creep_of_a_still_rail(model: Model) -> None:
    """Single motions: yaw gives -psi/cos gamma, y rate over V, pitch rate r/V, yaw rate the arms, roll rate r_c."""
    r0, b0 = model.wheel[0, :2]
    x = Wheelsets(1)
    x.u[:, 0, Y] = 2e-3
    base = x.evaluate(model).contact[0, 0]
    c, s = base[:, wr.COS], base[:, wr.SIN]
    r, arm = base[:, wr.R_C], b0 + base[:, wr.S_W]
    zero = np.zeros(2)
    cases = [
        ("u", YAW, 1e-3, (zero, -1e-3 / c, zero)),
        ("v", Y, 0.05, (zero, 0.05 / V350 * c, zero)),
        ("v", Z, 0.05, (zero, -SIGMA * 0.05 / V350 * s, zero)),
        ("v", ROLL, 0.01, (zero, -0.01 / V350 * (r * c + arm * s), zero)),
        ("v", PITCH, 0.1, (0.1 / V350 * r, zero, zero)),
        ("v", YAW, 0.01, (-SIGMA * 0.01 / V350 * arm, zero, 0.01 / V350 * c)),
    ]
    for kind, q, value, expected in cases:
        x = Wheelsets(1)
        x.u[:, 0, Y] = 2e-3
        getattr(x, kind)[:, 0, q] = value
        found = x.evaluate(model).contact[0, 0, :, wr.XI_X : wr.XI_S + 1] - base[:, wr.XI_X : wr.XI_S + 1]
        np.testing.assert_allclose(found.T, expected, atol=1e-15, err_msg=f"{kind} {q}")
    assert abs(base[0, wr.XI_X] - (1.0 - r[0] / r0)) < 1e-15
