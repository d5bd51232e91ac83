"""Contact kinematics and law: virtual work, rolling without slip, action and reaction, symmetry, creep forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.contact_geometry import ContactTable
from tiengine.hertz import hertz
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.model import Model
from tiengine.start import ContactForces, evaluate_contact

from .models import V350, paper_model
from .reference.contact_kernels import laws
from .reference.creep import creep_force

SIGMA = np.array([-1.0, 1.0])
Y, Z, ROLL, PITCH, YAW = range(5)
W_, V_, TX, DW, DV, DTX, RW, RV, RTX = range(9)  # rail: values, slopes, rates at constant s
SINKING = 8e-5  # m: about 70 kN


@pytest.fixture(scope="module")
def model() -> Model:
    return paper_model()


def with_friction(model: Model, friction: float) -> Model:
    constants = model.constants.copy()
    constants[at.FRICTION] = friction
    return replace(model, constants=constants)


class Wheelsets:
    """Motions of B wheelsets on their rails; wheelset 0 of each train is looked at, the others stand by."""

    def __init__(self, count: int) -> None:
        self.u, self.v = np.zeros((count, 4, 5)), np.zeros((count, 4, 5))
        self.rail = np.zeros((count, 4, 2, 9))
        self.track = np.zeros((count, 4, at.N_IRREGULARITY))

    def evaluate(self, model: Model, V: float = V350) -> ContactForces:
        return evaluate_contact(model, V, self.track, self.u, self.v, self.rail)

    def penetration(self, model: Model) -> NDArray[np.float64]:
        """Vertical penetration p = delta / cos gamma, shape (B, 2)."""
        contact = self.evaluate(model).contact[:, 0]
        return contact[..., wr.DELTA] / np.cos(self.gamma(contact))

    def gamma(self, contact: NDArray[np.float64]) -> NDArray[np.float64]:
        """Contact angle in the rail's frame from that in the track's."""
        turned = self.rail[:, 0, :, TX] + self.track[:, 0, at.CROSS_LEVEL, None]
        return np.arctan2(contact[..., wr.SIN], contact[..., wr.COS]) + SIGMA * turned

    def sink(self, model: Model, depth: float) -> None:
        """Press each wheelset down until its deeper wheel penetrates by ``depth`` vertically."""
        self.u[:, 0, Z] += depth - self.penetration(model).max(axis=1)


def scattered(seed: int, count: int) -> Wheelsets:
    """Random but possible motions: both rails, wheelset and track, every coordinate and rate."""
    rng = np.random.default_rng(seed)
    x = Wheelsets(count)
    x.u[:, 0] = rng.uniform(-1, 1, (count, 5)) * [6e-3, 0, 2e-3, 0.1, 5e-3]
    x.v[:, 0] = rng.uniform(-1, 1, (count, 5)) * [0.1, 0.1, 0.05, 0.5, 0.1]
    x.rail[:, 0] = rng.uniform(-1, 1, (count, 2, 9)) * [
        1e-3, 5e-4, 2e-3, 1e-3, 1e-3, 2e-3, 0.05, 0.05, 0.2
    ]  # fmt: skip
    x.track[:, 0] = rng.uniform(-1, 1, (count, 8)) * [3e-3, 2e-3, 1.5e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3]
    return x


# --- geometry -------------------------------------------------------------------------------------------------


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
    table: ContactTable = model.given.contact
    expected = table.lookup(np.clip(u, -16e-3, 13e-3), np.clip(alpha, -6e-3, 6e-3))
    # beyond its range the kernel goes on to the outermost cell's far node, one step further
    inside = (np.abs(alpha) <= 6e-3) & (u >= -16e-3) & (u <= 13e-3)
    columns = [wr.S_W, wr.S_R, wr.R_C, wr.KH, wr.K11, wr.K22, wr.K23, wr.K33]
    theirs = [at.S_WHEEL, at.S_RAIL, at.RADIUS, at.HERTZ, at.C11, at.C22, at.C23, at.C33]
    np.testing.assert_allclose(contact[inside][:, columns], expected[inside][:, theirs], rtol=1e-11, atol=1e-16)
    np.testing.assert_allclose(contact[inside][:, wr.SHIFT], u[inside], atol=1e-16)
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


# --- rolling --------------------------------------------------------------------------------------------------


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
        # height that keeps the penetration, up to what a contact sits beside the line of table and crown (0.1 mm)
        lever = SHIFTS * SIGMA[side] - model.constants[at.CROWN_OFFSET]
        x.v[:, 0, Z] = SIGMA[side] * lever * V350 * rate
        h_c = h_r - (contact[:, side, wr.R_C] - r0)
        x.u[:, 0, YAW] = rate * h_c  # along the path of the head under this wheel
        slip = creepages(x, model)[:, side, 1]
        assert np.all(np.abs(slip) < rate * 1e-4 * np.abs(contact[:, side, wr.SIN]) + NOTHING)


def test_following_a_cross_level(model: Model) -> None:
    """Wheelset rolling with the track's twist.

    What is left comes from the height and the place of the contact beside tape circle and rail top.
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
    assert np.all(slip < 1e-6 + 1e-5 * (np.abs(contact[..., wr.SIN]) > 0.1))  # nothing beside the 1e-3 of running


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


# --- forces ---------------------------------------------------------------------------------------------------


def test_action_equals_reaction(model: Model) -> None:
    """Translation, and roll moment by the arms of one and the same contact point; Fx and Mz stay with the wheelset."""
    r0, b0 = model.wheel[0, :2]
    x = scattered(3, 200)
    x.sink(model, 1.2e-4)
    found = x.evaluate(model)
    wheelset, rail, contact = found.wheelset[:, 0], found.rail[:, 0], found.contact[:, 0]
    scale = np.abs(rail[..., :2]).sum(axis=(1, 2))
    assert np.all(scale > 1e4)
    assert np.all(np.abs(wheelset[:, Y] + rail[..., 1].sum(axis=1)) < 1e-12 * scale)
    assert np.all(np.abs(wheelset[:, Z] + rail[..., 0].sum(axis=1)) < 1e-12 * scale)
    arm, r = SIGMA * (b0 + contact[..., wr.S_W]), contact[..., wr.R_C]
    roll = np.sum(-arm * rail[..., 0] + r * rail[..., 1], axis=1)
    assert np.all(np.abs(wheelset[:, ROLL] - roll) < 1e-12 * scale)
    h_c = model.constants[at.ARM_HEAD] - (r - r0)
    torsion = SIGMA * contact[..., wr.S_R] * rail[..., 0] + h_c * rail[..., 1]
    np.testing.assert_allclose(rail[..., 2], torsion, atol=1e-8)  # N m of 1e4
    Fx, Mz = found.local[:, 0, :, 1], found.local[:, 0, :, 3]
    yaw = np.sum(-arm * Fx + Mz * contact[..., wr.COS], axis=1)
    pitch = np.sum(r * Fx + SIGMA * Mz * contact[..., wr.SIN], axis=1)
    np.testing.assert_allclose(wheelset[:, [YAW, PITCH]], np.stack([yaw, pitch], axis=1), atol=1e-8)
    # resultant across the contact plane: the force on the rail is N and Fy turned by gamma_t
    N, Fy = found.local[:, 0, :, 0], found.local[:, 0, :, 2]
    c, s = contact[..., wr.COS], contact[..., wr.SIN]
    np.testing.assert_allclose(rail[..., 0] * c + SIGMA * rail[..., 1] * s, N, atol=1e-8)
    np.testing.assert_allclose(-rail[..., 1] * c + SIGMA * rail[..., 0] * s, Fy, atol=1e-8)


def test_mirror_symmetry(model: Model) -> None:
    """Sides swapped and lateral signs turned: the same forces, to the bit."""
    x, m = scattered(4, 200), Wheelsets(200)
    x.sink(model, 1.2e-4)
    flip = np.array([-1.0, 1.0, -1.0, 1.0, -1.0])
    m.u, m.v = x.u * flip, x.v * flip
    m.rail = x.rail[:, :, ::-1] * np.array([1.0, -1.0, -1.0] * 3)
    m.track = x.track.copy()
    m.track[..., [at.Y_A, at.CROSS_LEVEL, at.Y_A_SLOPE, at.CROSS_LEVEL_SLOPE]] *= -1.0
    here, there = x.evaluate(model), m.evaluate(model)
    size = np.abs(here.local[:, 0]).max(axis=(0, 1))
    np.testing.assert_allclose(
        there.local[:, 0], here.local[:, 0, ::-1] * [1.0, 1.0, -1.0, -1.0], atol=1e-9 * size.max()
    )
    np.testing.assert_allclose(there.wheelset[:, 0], here.wheelset[:, 0] * flip, atol=1e-9 * size.max())
    np.testing.assert_allclose(there.rail[:, 0], here.rail[:, 0, ::-1] * [1.0, -1.0, -1.0], atol=1e-9 * size.max())


def test_lifted_wheel_carries_nothing(model: Model) -> None:
    """Exactly zero, all components."""
    x = scattered(5, 50)
    x.sink(model, 1e-4)
    x.u[:, 0, Z] -= 1.0001e-4
    found = x.evaluate(model)
    assert not found.local[:, 0].any()
    assert not found.wheelset[:, 0].any()
    assert not found.rail[:, 0].any()
    assert np.isfinite(found.contact).all()


# A 1:20 cone, r = 0.43 m, on a rail head of R = 300 mm: FACTS 7.1; Kalker's table at nu = 0.25 beside a/b = 1.25.
E, NU, SHEAR = 2.059e11, 0.25, 2.059e11 / 2.5
C_KALKER = (4.41, 4.02, 1.77, 0.97)


def constant_table(model: Model, tangent: float) -> tuple[Model, tuple[float, float, float]]:
    """A wheel whose contact is the same everywhere but for its gap -tan gamma u."""
    table = model.given.contact
    a1, b1, G = (float(q) for q in hertz(0.5 / 0.43, 0.5 / 0.3, E, NU))
    values = np.zeros_like(table.values)
    u = table.u_min + table.du * np.arange(values.shape[0])
    values[..., at.GAP] = -tangent * u[:, None]
    values[..., at.RADIUS], values[..., at.TAN_GAMMA] = 0.43, tangent
    values[..., at.HERTZ] = G**-1.5
    ab = a1 * b1
    values[..., at.C11], values[..., at.C22] = SHEAR * ab * C_KALKER[0], SHEAR * ab * C_KALKER[1]
    values[..., at.C23], values[..., at.C33] = SHEAR * ab**1.5 * C_KALKER[2], SHEAR * ab**2 * C_KALKER[3]
    given = replace(model.given, contact=replace(table, values=values))
    return replace(model, given=given), (G, a1, b1)


def test_forces_against_plain_formulas(model: Model) -> None:
    """Cone on a crown, random motions from no creep to full slip: Hertz, Kalker, Shen-Hedrick-Elkins."""
    cone, (G, a1, b1) = constant_table(model, 0.05)
    # FACTS 7.1 has G 4.954e-8 for nu = 0.3, R = .43 on R300; G goes with (1 - nu^2)^(2/3)
    assert abs(G * (0.91 / 0.9375) ** (2 / 3) / 4.954e-8 - 1.0) < 5e-4
    x = scattered(6, 300)
    scale = 10.0 ** np.random.default_rng(7).uniform(-4, 0, 300)
    for motion in (x.v, x.rail[..., 3:], x.track[..., 4:]):
        motion *= scale.reshape(-1, *[1] * (motion.ndim - 1))
    x.u[:, 0, [YAW, PITCH]] *= scale[:, None]
    x.sink(cone, 1e-4)
    found = x.evaluate(cone)
    friction = float(model.constants[at.FRICTION])
    ratio = []
    for i in range(300):
        for side in range(2):
            contact = found.contact[i, 0, side]
            expected = creep_force(
                contact[wr.DELTA], contact[wr.XI_X : wr.XI_S + 1], G, a1, b1, SHEAR, C_KALKER, friction
            )
            np.testing.assert_allclose(found.local[i, 0, side], expected, rtol=1e-10, atol=1e-9)
            N, Fx, Fy, _ = found.local[i, 0, side]
            if N > 0.0:
                ratio.append(np.hypot(Fx, Fy) / (friction * N))
    assert max(ratio) <= 1.0 + 1e-12
    assert max(ratio) > 1.0 - 1e-9  # full slip is among them
    assert min(ratio) < 0.5


def test_slip_limit(model: Model) -> None:
    """Enormous creepage: friction mu N against the slip, exactly."""
    x = Wheelsets(1)
    x.v[:, 0, Y] = 5.0
    x.sink(model, 1e-4)
    found = x.evaluate(model)
    N, Fx, Fy, Mz = found.local[0, 0].T
    np.testing.assert_allclose(np.hypot(Fx, Fy), 0.3 * N, rtol=1e-10)
    assert np.all(Fy < 0.0)
    assert np.all(np.abs(Mz) < 0.3 * N * 6e-3)  # a moment arm below the patch's size


def test_derivatives_of_the_law(model: Model) -> None:
    """The analytic derivatives against central differences, from little creep to slip, and on both sides of tau = 3."""
    x = scattered(8, 150)
    x.sink(model, 1.2e-4)
    states = x.evaluate(model).contact[:, 0].reshape(-1, wr.N_CONTACT)
    states = states[states[:, wr.DELTA] > 1e-6]
    scale = 10.0 ** np.random.default_rng(9).uniform(-3, 0.5, len(states))
    states[:, wr.XI_X : wr.XI_S + 1] *= scale[:, None]

    def evaluate(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        force, derivative = np.zeros((len(rows), 4)), np.zeros((len(rows), 4, 4))
        laws(0.3, np.ascontiguousarray(rows), force, derivative)
        return force, derivative

    _, D = evaluate(states)
    for n, column in enumerate((wr.DELTA, wr.XI_X, wr.XI_Y, wr.XI_S)):
        h = 1e-5 * np.maximum(np.abs(states[:, column]), 1e-7 if n else 0.0)
        up, down = states.copy(), states.copy()
        up[:, column] += h
        down[:, column] -= h
        difference = (evaluate(up)[0] - evaluate(down)[0]) / (2.0 * h[:, None])
        # h^2 of a third derivative and 1e-16 N/h; compare over the column's range of step
        size = np.abs(difference).max(axis=0) + 1e-30
        np.testing.assert_allclose(D[:, :, n] / size, difference / size, atol=2e-6)
    lifted = states.copy()
    lifted[:, wr.DELTA] = -1e-9
    force, D = evaluate(lifted)
    assert not force.any()
    assert not D.any()
