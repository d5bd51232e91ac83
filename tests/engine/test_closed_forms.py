"""Closed forms of validation/ for rails on seats: each against a second way to the same number."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.parameters.arrays import Reals
from validation.closed_forms.floquet import (
    Seats,
    deflection_under_load,
    free_rail,
    jump,
    load_transfer,
    seat_force,
)
from validation.closed_forms.receptance import receptance
from validation.closed_forms.timoshenko import Beam, moving_load_deflection
from validation.closed_forms.winkler import critical_speed, damped_deflection, undamped_deflection

CHN60 = Beam(EI=2.059e11 * 3.217e-5, kGA=0.5329 * 7.9e10 * 7.745e-3, m=60.64, rho_I=7830.0 * 3.217e-5)
SEATS = Seats(pitch=0.65, stiffness=4e7, damping=5e4)
P, V350 = 70e3, 350.0 / 3.6


def pinned_flexibility(length: float, a: Reals, b: Reals) -> Reals:
    """Deflection at a under a unit load at b of a pinned Timoshenko beam, textbook formula [m/N], (len(a), len(b))."""
    a, b = np.meshgrid(a, b, indexing="ij")
    low, high = np.minimum(a, b), length - np.maximum(a, b)
    bending = low * high * (length**2 - low**2 - high**2) / (6.0 * CHN60.EI * length)
    found: Reals = bending + low * high / (length * CHN60.kGA)
    return found


def on_springs(x: float) -> tuple[float, float]:
    """Deflection under a load at rest x behind the middle seat of 55, and that seat's force: exact, finite."""
    length = 55 * SEATS.pitch
    seats, load = SEATS.pitch * (np.arange(55) + 0.5), np.array([length / 2.0 + x])
    stiff = pinned_flexibility(length, seats, seats) + np.eye(55) / SEATS.stiffness
    R = np.linalg.solve(stiff, P * pinned_flexibility(length, seats, load))[:, 0]
    w = P * pinned_flexibility(length, load, load)[0, 0] - pinned_flexibility(length, load, seats)[0] @ R
    return float(w), float(R[27])


@pytest.mark.parametrize("x", [0.0, 0.1, 0.325])
def test_slow_load_is_a_static_one(x: float) -> None:
    """V to zero: the endless rail is the long one; at 1 m/s the damper still carries c V / (k L), 1.5e-3 of w' L."""
    w, R = on_springs(x)
    V, place = 0.05, np.array([x])
    assert deflection_under_load(CHN60, SEATS, V, P, place)[0] == pytest.approx(w, rel=1e-4)
    assert seat_force(CHN60, SEATS, V, P, place)[0] == pytest.approx(R, rel=2e-4)


@pytest.mark.parametrize("V", [10.0, V350])
def test_seats_carry_the_load(V: float) -> None:
    """All seats together carry P on the average: int R dx / d = P."""
    x = np.linspace(-25.0, 25.0, 100001)
    assert np.trapezoid(seat_force(CHN60, SEATS, V, P, x), x) / SEATS.pitch == pytest.approx(P, rel=1e-5)


def test_sum_over_seats_by_poisson() -> None:
    """sum g(n d) exp(-i phase n) = 1/d sum H((phase + 2 pi m) / d): waves against wave numbers."""
    omega = np.array([300.0, 2000.0, 8000.0]) - 6.0j
    phase = omega * SEATS.pitch / V350
    harmonics = (phase + 2.0 * np.pi * np.arange(-20000, 20001)[:, None]) / SEATS.pitch
    by_wave_numbers = load_transfer(CHN60, harmonics, omega).sum(axis=0) / SEATS.pitch
    # left out: 2 / (S d) (d / 2 pi)^2 / 20000
    left_out = SEATS.pitch / (2.0 * np.pi**2 * CHN60.kGA * 20000)
    error = np.abs(free_rail(CHN60, SEATS, omega, phase, 0.0) - by_wave_numbers)
    assert np.all(error < 1.2 * left_out)


def test_jump_as_the_load_crosses_a_seat() -> None:
    """2 mm before and after, less the slope on either side; the transform itself resolves 0.6 mm."""
    before, after = (np.array([0.002, 0.004, 0.006]) * sign for sign in (-1.0, 1.0))
    ends = [np.polyval(np.polyfit(x, seat_force(CHN60, SEATS, V350, P, x), 1), 0.0) for x in (before, after)]
    assert ends[0] - ends[1] == pytest.approx(jump(CHN60, SEATS, V350, P), rel=0.1)  # Gibbs at the ends of 4 mm


def test_seat_force_by_marching_a_fixed_rail() -> None:
    """A load runs over 26 m of rail fixed to the ground: modes (12 a metre), Newmark; no Fourier, no moving frame."""
    length, modes, dt = 40 * SEATS.pitch, 312, 5e-5
    k, half = np.arange(1, modes + 1) * np.pi / length, length / 2.0
    M = np.diag(half * np.repeat([CHN60.m, CHN60.rho_I], modes))
    shear, K = half * CHN60.kGA, np.zeros((2 * modes, 2 * modes))
    w, theta = np.arange(modes), np.arange(modes, 2 * modes)
    K[w, w], K[theta, theta] = shear * k**2, shear + half * CHN60.EI * k**2
    K[w, theta] = K[theta, w] = -shear * k
    seats = SEATS.pitch * (np.arange(40) + 0.5)
    shape = np.sin(np.outer(seats, k))
    C = np.zeros_like(K)
    C[:modes, :modes] = SEATS.damping * shape.T @ shape
    K[:modes, :modes] += SEATS.stiffness * shape.T @ shape
    solve = np.linalg.inv(M + dt / 2.0 * C + dt**2 / 4.0 * K)
    u, v, a = np.zeros((3, 2 * modes))
    steps, middle, distance, force = round(16.0 / (V350 * dt)), 20, [], []
    for step in range(1, steps + 1):
        place = 5.0 + V350 * dt * step
        load = np.zeros(2 * modes)
        load[:modes] = P * (0.5 - 0.5 * np.cos(np.pi * min(1.0, (place - 5.0) / 4.0))) * np.sin(k * place)
        u, v = u + dt * v + dt**2 / 4.0 * a, v + dt / 2.0 * a
        a = solve @ (load - C @ v - K @ u)
        u, v = u + dt**2 / 4.0 * a, v + dt / 2.0 * a
        distance.append(place - seats[middle])
        force.append(shape[middle] @ (SEATS.stiffness * u[:modes] + SEATS.damping * v[:modes]))
    x, computed = np.array(distance), np.array(force)
    exact = seat_force(CHN60, SEATS, V350, P, x)
    smooth = np.abs(x - SEATS.pitch * np.round(x / SEATS.pitch)) > length / (2 * modes)  # away from the jumps
    near = np.abs(x) < 3.0
    assert np.abs(computed - exact)[near & smooth].max() < 5e-3 * exact.max()
    assert np.sqrt(np.mean((computed - exact)[near] ** 2)) < 2e-3 * exact.max()


@pytest.mark.parametrize("loss", [0.0, 0.02])
@pytest.mark.parametrize("hertz", [1.0, 160.0, 800.0, 1400.0])
def test_receptance_by_quasi_periodic_loads(hertz: float, loss: float) -> None:
    """A point force is the mean, over all phases, of forces in every span: spectral way against transfer matrix."""
    x, omega, phases = 0.2, np.array([2.0 * np.pi * hertz + 0j]), 2.0 * np.pi * np.arange(8000) / 8000
    rail = Beam(CHN60.EI * (1.0 + 1j * loss), CHN60.kGA * (1.0 + 1j * loss), CHN60.m, CHN60.rho_I)  # type: ignore[arg-type]
    if loss == 0.0:
        omega = omega - 1e-6j * omega.real  # tells outgoing waves from incoming ones
    Z = SEATS.impedance(omega)
    own = free_rail(rail, SEATS, omega, phases, 0.0)
    across = [free_rail(rail, SEATS, omega, phase, x) for phase in (phases, -phases)]
    spectral = np.mean(own - Z * across[0] * across[1] / (1.0 + Z * own))
    found = receptance(CHN60, SEATS, loss, x, np.array([hertz]))[0]
    assert abs(found / spectral - 1.0) < (1e-9 if loss else 1e-4)


def test_receptance_starts_static() -> None:
    """1e-3 Hz: the finite rail on springs."""
    for x, way in ((0.0, 0.0), (SEATS.pitch / 2.0, 0.325)):
        found = receptance(CHN60, SEATS, 0.0, x, np.array([1e-3]))[0]
        assert found.real == pytest.approx(on_springs(way)[0] / P, rel=1e-7)


@pytest.mark.parametrize("V", [0.01, V350, 300.0, 1000.0])
def test_euler_beam_by_residues(V: float) -> None:
    """Resolvent cubic against the residues of a Timoshenko beam without shear; above the critical speed as well."""
    k, c, s = 6e7, 8e4, np.array([-3.0, -0.5, 0.0, 0.5, 3.0])
    slender = Beam(CHN60.EI, CHN60.kGA * 1e7, CHN60.m, 1e-9)
    expected = moving_load_deflection(slender, k, c, V, P, s)
    found = damped_deflection(CHN60.EI, CHN60.m, k, c, V, P, s)
    np.testing.assert_allclose(found, expected, atol=1e-6 * found.max())  # shear: 1e-7 of 5 %; rounding of its roots


def test_kenney_is_the_limit_of_small_damping() -> None:
    """c to zero below the critical speed; textbook deflection P / (8 EI L^3) at rest."""
    k, s = 6e7, np.linspace(-3.0, 3.0, 7)
    L = (k / (4.0 * CHN60.EI)) ** 0.25
    assert undamped_deflection(CHN60.EI, CHN60.m, k, 0.0, P, np.zeros(1))[0] == pytest.approx(P / (8 * CHN60.EI * L**3))
    for V in (V350, 0.9 * critical_speed(CHN60.EI, CHN60.m, k)):
        exact = undamped_deflection(CHN60.EI, CHN60.m, k, V, P, s)
        found = damped_deflection(CHN60.EI, CHN60.m, k, 1e-2, V, P, s)
        np.testing.assert_allclose(found, exact, atol=1e-6 * exact.max())
