"""Rail window: modes, convective terms, energy, the moving load on a bed, the kernel against the host."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
from numpy.typing import NDArray

from tiengine.engine.sine_state import SineState
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset
from tiengine.parameters.quantity import build
from tiengine.track.rail import Rail, RailWindow
from tiengine.track.sines import sine_products

from ..explicit import Explicit
from ..models import V350, paper_model
from ..reference.moving_load import Bed, deflection

V_RATE = -3.0  # m/s^2: an emergency brake doubled
COSINE = (False, True, False, True, False)  # w, theta_y, v, theta_z, theta_x


def chn60(**changes: float) -> Rail:
    return build(Rail, {**load_toml(find_preset("rails", "CHN60")), **changes}, "rail")


def timoshenko(EI: float, S: float, m: float, rotary: float, k: NDArray[np.float64]) -> NDArray[np.float64]:
    """Circular frequencies of both branches at wave numbers k, ascending: roots of the biquadratic."""
    b = m * (S + EI * k**2) + rotary * S * k**2
    c = m * rotary * S * EI * k**4
    upper = (b + np.sqrt(b**2 - 4.0 * c)) / (2.0 * m * rotary)
    lower = S * EI * k**4 / (m * rotary * upper)  # product of the roots: no cancellation
    return np.sort(np.sqrt(np.concatenate([lower, upper])))


def frequencies(K: NDArray[np.float64], M: NDArray[np.float64]) -> NDArray[np.float64]:
    """Circular frequencies, ascending; the lower half from M against K: squares are known to 1e-16 of the largest."""
    high = np.sqrt(la.eigh(K, M, eigvals_only=True))
    low = 1.0 / np.sqrt(la.eigh(M, K, eigvals_only=True)[::-1])
    half = len(high) // 2
    return np.concatenate([low[:half], high[half:]])


def test_pinned_modes() -> None:
    """At V = 0 the window is a pinned Timoshenko beam: bending and shear branch, both planes, and torsion."""
    r, window = chn60(), RailWindow(chn60(), 36.0, 60)
    k, n2 = window.wave_numbers, 120
    S = r.G * r.A
    M, C, K = (x.toarray() for x in window.vertical(0.0))
    assert not C.any()
    expected = timoshenko(r.E * r.Iy, r.kappa_vertical * S, r.mass_per_length, r.rho * r.Iy, k)
    np.testing.assert_allclose(frequencies(K, M), expected, rtol=1e-9)
    M, C, K = (x.toarray() for x in window.lateral(0.0))
    assert not C.any()
    expected = timoshenko(r.E * r.Iz, r.kappa_lateral * S, r.mass_per_length, r.rho * r.Iz, k)
    np.testing.assert_allclose(frequencies(K[:n2, :n2], M[:n2, :n2]), expected, rtol=1e-9)
    torsion = np.sqrt(np.diag(K)[n2:] / np.diag(M)[n2:])
    np.testing.assert_allclose(torsion, k * np.sqrt(r.GK / (r.rho * r.I_polar)), rtol=1e-12)
    assert not K[:n2, n2:].any()
    assert not K[n2:, :n2].any()


def test_frequencies_of_the_shortest_wave() -> None:
    """Highest of 60 modes in 36 m: 1129 Hz vertical, 549 lateral, 681 torsion (FACTS 3.6)."""
    r, k = chn60(), np.array([60 * np.pi / 36.0])
    S = r.G * r.A
    vertical = timoshenko(r.E * r.Iy, r.kappa_vertical * S, r.mass_per_length, r.rho * r.Iy, k)[0]
    lateral = timoshenko(r.E * r.Iz, r.kappa_lateral * S, r.mass_per_length, r.rho * r.Iz, k)[0]
    torsion = k[0] * np.sqrt(r.GK / (r.rho * r.I_polar))
    hertz = np.array([vertical, lateral, torsion]) / (2.0 * np.pi)
    np.testing.assert_allclose(hertz, [1129.0, 549.0, 681.0], atol=0.6)  # printed without decimals


def quadrature(length: float, modes: int) -> tuple[NDArray[np.float64], ...]:
    """Gauss points and weights that integrate products of the trial functions to rounding."""
    x, weight = np.polynomial.legendre.leggauss(4 * modes + 30)
    return (x + 1.0) * length / 2.0, weight * length / 2.0


def trial(window: RailWindow, s: NDArray[np.float64], cosine: bool) -> list[NDArray[np.float64]]:
    """Trial functions and two derivatives, (len(s), N) each."""
    k, phase = window.wave_numbers, np.multiply.outer(s, window.wave_numbers)
    if cosine:
        return [np.cos(phase), -k * np.sin(phase), -(k**2) * np.cos(phase)]
    return [np.sin(phase), k * np.cos(phase), -(k**2) * np.sin(phase)]


@pytest.mark.parametrize("cosine", [False, True])
def test_products(cosine: bool) -> None:
    """int W_i W_j' by quadrature."""
    window = RailWindow(chn60(), 7.3, 13)
    s, weight = quadrature(7.3, 13)
    W, slope, _ = trial(window, s, cosine)
    expected = np.einsum("q,qi,qj->ij", weight, W, slope)
    np.testing.assert_allclose(sine_products(13)[int(cosine)], expected, atol=1e-12)  # sums of numbers up to 100


def field_blocks(window: RailWindow, V: float, V_rate: float) -> list[tuple[NDArray[np.float64], ...]]:
    """Convective C and K of the five fields, elastic stiffness taken off."""
    n = window.modes
    blocks = []
    for whole, rest, fields in (
        (window.vertical(V, V_rate), window.vertical(0.0), 2),
        (window.lateral(V, V_rate), window.lateral(0.0), 3),
    ):
        C, K = whole[1].toarray(), (whole[2] - rest[2]).toarray()
        for field in range(fields):
            rows = slice(field * n, (field + 1) * n)
            blocks.append((C[rows, rows].copy(), K[rows, rows].copy()))
            C[rows, rows], K[rows, rows] = 0.0, 0.0
        assert not C.any()  # no field is convected into another
        assert not K.any()
    return blocks


def test_convective_matrices_are_lagrange_plus_flow() -> None:
    """Each field: Galerkin on the strong form = Lagrange's equation with the flow force through the ends."""
    window, V = RailWindow(chn60(), 7.3, 13), V350
    s, weight = quadrature(7.3, 13)
    for mu, cosine, (C, K) in zip(window.rail.densities, COSINE, field_blocks(window, V, V_RATE), strict=True):
        W, slope, _ = trial(window, s, cosine)
        cross = np.einsum("q,qi,qj->ij", weight, W, slope)
        straight = np.einsum("q,qi,qj->ij", weight, slope, slope)
        (W0, Wl), (slope0, slopel) = (f[:2] for f in trial(window, np.array([0.0, 7.3]), cosine)[:2])
        flow_C = np.outer(Wl, Wl) - np.outer(W0, W0)
        flow_K = np.outer(Wl, slopel) - np.outer(W0, slope0)
        lagrange_C = mu * V * (cross.T - cross)
        lagrange_K = -mu * V**2 * straight - mu * V_RATE * cross
        # moved to the left, the flow force mu V [W^T (dq/dt W - V q W')] is taken off
        np.testing.assert_allclose(C, lagrange_C - mu * V * flow_C, atol=1e-12 * np.abs(C).max())
        scale = mu * V**2 * np.abs(straight).max()
        np.testing.assert_allclose(K, lagrange_K + mu * V**2 * flow_K, atol=1e-12 * scale)
        if not cosine:
            np.testing.assert_array_equal(C, -C.T)


def test_convective_power_is_the_flux_through_the_ends() -> None:
    """dq/dt C dq/dt = -mu V [rate^2] between the ends: nothing for sines, the boundary flux for cosines."""
    window, V = RailWindow(chn60(), 36.0, 60), V350
    rate = np.random.default_rng(1).standard_normal(60)
    for mu, cosine, (C, K) in zip(window.rail.densities, COSINE, field_blocks(window, V, 0.0), strict=True):
        W0, Wl = trial(window, np.array([0.0, 36.0]), cosine)[0]
        flux = -mu * V * ((Wl @ rate) ** 2 - (W0 @ rate) ** 2)
        scale = np.abs(rate) @ np.abs(C) @ np.abs(rate)
        assert abs(rate @ C @ rate - flux) < 1e-14 * scale
        assert cosine or abs(rate @ C @ rate) < 1e-14 * scale
        np.testing.assert_array_equal(K, K.T)  # the rest is a potential


def test_energy_of_free_motion() -> None:
    """Free vibration at V: T_rel - V^2 part + strain energy changes by the flux only (exact flow, 2 ms)."""
    window, V = RailWindow(chn60(), 6.0, 10), V350
    M, C, K = (x.toarray() for x in window.vertical(V))
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-la.solve(M, K), -la.solve(M, C)]])
    rng = np.random.default_rng(2)
    x0 = np.concatenate([1e-4 * rng.standard_normal(n), 0.1 * rng.standard_normal(n)])
    t, weight = np.polynomial.legendre.leggauss(80)  # at most 30 rad of the fastest mode
    duration = 2e-3
    states = np.array([la.expm(A * duration * (x + 1.0) / 2.0) @ x0 for x in t])
    mu = window.rail.densities[1]
    W0, Wl = trial(window, np.array([0.0, 6.0]), True)[0]
    rate = states[:, n + 10 :]
    flux = mu * V * ((rate @ Wl) ** 2 - (rate @ W0) ** 2)
    gained = float(np.sum(weight * flux)) * duration / 2.0
    x1 = la.expm(A * duration) @ x0
    before, after = (0.5 * (x[n:] @ M @ x[n:] + x[:n] @ K @ x[:n]) for x in (x0, x1))
    assert abs(after - before - gained) < 1e-10 * before
    assert abs(gained) > 1e-5 * before  # the balance is not empty


def test_step_against_host() -> None:
    """C v + K u of the step equals that of the sparse matrices; two trains, speed changing.

    Rails: the force. Slabs and trains: the acceleration, that is after the implicit operator.
    """
    model = paper_model(modes=24, trains=2)
    state, g = SineState.at_rest(model), model.ingredients
    clock = window_clock(model.ingredients.slab, np.array([33.3]), np.array([V350]), np.array([V_RATE]))
    state.enter(int(clock[0, at.FIRST_SEAT]), int(clock[0, at.FIRST_SLAB]))
    rng = np.random.default_rng(3)
    state.motion[at.U_PREDICTED] = 1e-3 * rng.standard_normal(state.motion.shape[1])
    state.motion[at.V_PREDICTED] = rng.standard_normal(state.motion.shape[1])
    Explicit(model, state, clock).first()

    def rows(block: str) -> list[NDArray[np.float64]]:
        views = (state.view(row, block) for row in (at.U_PREDICTED, at.V_PREDICTED, at.LINEAR))
        return [view.reshape(-1, view.shape[-1]) for view in views]

    for block, (_, C, K) in (
        ("vertical", model.window.vertical(V350, V_RATE)),
        ("lateral", model.window.lateral(V350, V_RATE)),
    ):
        for u, v, found in zip(*rows(block), strict=True):
            scale = abs(C) @ np.abs(v) + abs(K) @ np.abs(u)
            assert np.all(np.abs(found + C @ v + K @ u) < 1e-13 * scale)
    slab, train = g.designs.matrices[0], g.train
    own = [
        ("slabs", model.slab_inverse[0].T, slab.K_plate + slab.K_bed, slab.C_bed),
        ("vehicles", model.blocks.vehicle.T, train.K, train.C + V350 * train.C_speed),
    ]
    for block, inverse, K, C in own:
        for u, v, found in zip(*rows(block), strict=True):
            force = -(K @ u + C @ v)
            scale = np.abs(inverse) @ (np.abs(K) @ np.abs(u) + np.abs(C) @ np.abs(v))
            assert np.all(np.abs(found - inverse @ force) <= 1e-12 * scale)


BED = {"k": 4e7 / 0.63, "c": 5e4 / 0.63}  # fastenings smeared (FACTS 3.6)
P = 70e3


def on_bed(rail: Rail, modes: int, V: float, s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Steady deflection of the window on a continuous bed, load in its middle, at s from the load."""
    window = RailWindow(rail, 36.0, modes)
    K = window.vertical(V)[2].toarray()
    K[:modes, :modes] += BED["k"] * 18.0 * np.eye(modes) - V * BED["c"] * sine_products(modes)[0]
    load = np.zeros(2 * modes)
    load[:modes] = P * window.shape(np.array([18.0]))[0]
    return window.shape(18.0 + s) @ la.solve(K, load)[:modes]


def lost(rail: Rail, modes: int, V: float) -> float:
    """Deflection under the load that the modes beyond N would add; bed and damping do not reach such waves."""
    k = np.arange(modes + 1, 200001) * np.pi / 36.0
    k = k[np.arange(modes + 1, 200001) % 2 == 1]  # even ones have a node in the middle
    shear = rail.kappa_vertical * rail.G * rail.A
    return P * 2.0 / 36.0 * float(np.sum(1.0 / (shear * k**2) + 1.0 / (rail.E * rail.Iy * k**4)))


def test_moving_load_timoshenko() -> None:
    """350 km/h on a damped bed: closed form under the load and beside it, converging with N."""
    r = chn60()
    EI, S = r.E * r.Iy, r.kappa_vertical * r.G * r.A
    beam = Bed(EI, S, r.mass_per_length, r.rho * r.Iy, **BED)
    s = np.array([0.0, -3.0, -1.5, -0.6, 0.6, 1.5, 3.0])
    exact = deflection(beam, V350, P, s)
    errors = []
    for modes in (60, 120, 240, 480):
        error = on_bed(r, modes, V350, s) - exact
        # what is missing under the load is the compliance of the waves left out, their bed and inertia apart (2 %)
        np.testing.assert_allclose(-error[0], lost(r, modes, V350), rtol=0.1 if modes == 60 else 0.03)
        errors.append([abs(error[0]), np.abs(error[1:]).max()])
    errors = np.array(errors) / exact[0]
    rate = np.log2(errors[:-1] / errors[1:])
    assert np.all(rate[:, 0] > 0.9)  # shear kink under the load: 1/N
    assert errors[-1, 0] < 4e-3
    assert errors[-1, 1] < 2e-5  # beside the load the tail alternates: 1/N^2
    front, rear = on_bed(r, 240, V350, np.array([0.6, -0.6]))
    assert rear > front * 1.02  # damping drags: the deflection trails


def test_moving_load_euler() -> None:
    """The same for a slender beam (shear and rotary inertia made negligible): 1/N^3 under the load."""
    r = chn60(G=7.9e10 * 1e5, rho=7830.0 * 1e-6)
    beam = Bed(r.E * r.Iy, None, r.mass_per_length, 0.0, **BED)
    s = np.linspace(-4.0, 4.0, 33)
    exact = deflection(beam, V350, P, s)
    sizes = (60, 120, 240)
    errors = np.array([np.abs(on_bed(r, n, V350, s) - exact).max() for n in sizes])
    assert np.all(np.log2(errors[:-1] / errors[1:]) > 2.8)
    # 2e-4 of the deflection at 240; the bed reaches the waves left out by (L kappa)^-4, L = 0.8 m: 3 % at 60
    np.testing.assert_allclose(errors, [lost(r, n, V350) for n in sizes], rtol=0.05)
    assert errors[-1] < 2e-4 * exact.max()


@pytest.mark.parametrize("euler", [False, True])
def test_static_limit_of_the_closed_form(euler: bool) -> None:
    """Reference against the textbook: Winkler beam at rest, w(0) = P/(2 k L), L = (4 EI/k)^(1/4), and balance."""
    r = chn60()
    EI = r.E * r.Iy
    beam = Bed(EI, None if euler else 1e6 * r.G * r.A, r.mass_per_length, 0.0, BED["k"], 0.0)
    L = (4.0 * EI / BED["k"]) ** 0.25
    w0 = deflection(beam, 1e-9, P, np.array([0.0]))[0]
    assert abs(w0 / (P / (2.0 * BED["k"] * L)) - 1.0) < 1e-6  # shear 1e-6
    s, h = np.linspace(-12.0, 12.0, 24001, retstep=True)
    assert abs(np.sum(deflection(beam, V350, P, s)) * h * BED["k"] / P - 1.0) < 1e-4  # step 1 mm: kink squared


def test_missing_compliance_is_the_sum_of_the_modes_left_out() -> None:
    """Half of 1/(kGA k^2) + 1/(EI k^4) of 200 000 modes and the tail's integral; the rest is 1e-10 of it."""
    r, modes, count = chn60(), 72, 200_000
    missing = RailWindow(r, 36.0, modes).missing_compliance
    k = np.arange(modes + 1, modes + count + 1) * np.pi / 36.0
    tail = 36.0 / (np.pi * k[-1])  # integral of 1/k^2 beyond, over the spacing of the k
    for found, stiffness, EI in zip(
        missing, (r.kappa_vertical * r.G * r.A, r.kappa_lateral * r.G * r.A, r.GK), (r.E * r.Iy, r.E * r.Iz, np.inf),
        strict=True,
    ):  # fmt: skip
        expected = (np.sum(k**-2.0) + tail) / stiffness / 36.0 + np.sum(k**-4.0) / EI / 36.0
        assert found == pytest.approx(expected, rel=1e-6)  # the tail's midpoint rule: half a spacing of k
