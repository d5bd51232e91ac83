"""Contact forces: action and reaction, mirror symmetry, lift-off, Hertz and creep laws, their derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.contact.hertz import hertz
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.model.model import Model

from ..models import paper_model
from ..reference.contact_kernels import laws
from ..reference.creep import creep_force
from ..wheelsets import (
    PITCH,
    ROLL,
    SIGMA,
    YAW,
    Wheelsets,
    Y,
    Z,
    scattered,
)


@pytest.fixture(scope="module")
def model() -> Model:
    return paper_model()


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


# A 1:20 cone, r = 0.43 m, on a rail head of R = 300 mm: FACTS 7.1; Kalker's table at nu = 0.25 next to a/b = 1.25.
E, NU, SHEAR = 2.059e11, 0.25, 2.059e11 / 2.5
C_KALKER = (4.41, 4.02, 1.77, 0.97)


def constant_table(model: Model, tangent: float) -> tuple[Model, tuple[float, float, float]]:
    """A wheel whose contact is the same everywhere but for its gap -tan gamma u."""
    table = model.ingredients.contact
    a1, b1, G = (float(q) for q in hertz(0.5 / 0.43, 0.5 / 0.3, E, NU))
    values = np.zeros_like(table.values)
    u = table.u_min + table.du * np.arange(values.shape[0])
    values[..., at.GAP] = -tangent * u[:, None]
    values[..., at.RADIUS], values[..., at.TAN_GAMMA] = 0.43, tangent
    values[..., at.HERTZ] = G**-1.5
    ab = a1 * b1
    values[..., at.C11], values[..., at.C22] = SHEAR * ab * C_KALKER[0], SHEAR * ab * C_KALKER[1]
    values[..., at.C23], values[..., at.C33] = SHEAR * ab**1.5 * C_KALKER[2], SHEAR * ab**2 * C_KALKER[3]
    ingredients = replace(model.ingredients, contact=replace(table, values=values))
    return replace(model, ingredients=ingredients), (G, a1, b1)


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
