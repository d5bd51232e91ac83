"""Speed programme against closed forms of uniform and uniformly braked motion."""

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.vehicle.speed_programme import SpeedProfile

BRAKING = SpeedProfile.table([0.0, 200.0, 350.0, 600.0], [97.2, 90.0, 92.0, 80.0])


def uniformly_braked(V0, a, nodes):
    """Table whose kinetic energy falls linearly: V^2 = V0^2 + 2 a x."""
    return SpeedProfile.table(nodes, np.sqrt(V0**2 + 2 * a * nodes))


def test_constant_speed_is_exact():
    """x0 + V t to half a unit in the last place from zero, 5e-9 m from anywhere (lattice of step/2^20)."""
    V, dt, n = 350 / 3.6, 1e-4, 61700
    x, speed, acceleration = SpeedProfile.constant(V).advance(0.0, dt, n)
    exact = V * dt * np.arange(n + 1)
    assert np.abs(x - exact).max() <= np.spacing(600.0)
    assert (speed == V).all()
    assert not acceleration.any()
    x, _, _ = SpeedProfile.constant(V).advance(1e6 + 0.123, dt, 100)
    assert x[0] == 1e6 + 0.123
    assert np.abs(x - (1e6 + 0.123 + exact[:101])).max() < 5e-9


@pytest.mark.parametrize("profile", [SpeedProfile.constant(97.2222222), SpeedProfile.constant(1.7), BRAKING])
@pytest.mark.parametrize("x0", [0.0, 17.3, 123456.789, -40.1])
def test_chunks_do_not_matter(profile, x0):
    """advance(2 n) is advance(n) twice, bit for bit, as is advance(1) many times."""
    dt, n = 1.3e-4, 300
    whole = np.array(profile.advance(x0, dt, 2 * n))
    first = np.array(profile.advance(x0, dt, n))
    second = np.array(profile.advance(first[0, -1], dt, n))
    assert np.array_equal(whole, np.concatenate([first, second[:, 1:]], axis=1))
    x = x0
    for i in range(20):
        x = profile.advance(x, dt, 1)[0][-1]
        assert x == whole[0, i + 1]


@pytest.mark.parametrize("dt", [1e-4, 1e-2])
def test_uniform_braking(dt):
    """Between the end pieces of the table the motion is x = V0 t + a t^2/2, within 1e-6 m over 600 m."""
    V0, a = 97.2, -1.1
    profile = uniformly_braked(V0, a, np.linspace(-100.0, 800.0, 10))
    n = round(6.4 / dt)
    t = dt * np.arange(n + 1)
    x, V, Vdot = profile.advance(0.0, dt, n)
    exact = V0 * t + 0.5 * a * t**2
    assert exact[-1] > 598.0
    assert np.abs(x - exact).max() < 1e-6  # the requirement
    assert np.abs(V - (V0 + a * t)).max() < 1e-8  # 1e-6 m times dV/dx = a/V
    assert pytest.approx(a, rel=1e-9) == Vdot  # rounding of the cubic's coefficients


def test_march_converges_with_fourth_order():
    """Steps over a smooth stretch of the table: halving them divides the error by 16."""
    profile = SpeedProfile.table([0.0, 600.0], [97.2, 50.0])
    T = 4.0

    def end(n):
        return profile.advance(50.0, T / n, n)[0][-1]

    errors = [abs(end(n) - end(4096)) for n in (8, 16)]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.25)  # next order's share at the coarser step


def test_acceleration_is_the_rate_of_speed_and_continuous():
    """dV/dt by central differences; between steps it changes by no more than its own rate allows."""
    dt = 1e-3
    x, V, Vdot = BRAKING.advance(-20.0, dt, 7200)
    assert x[-1] > 600.0
    rate = (V[2:] - V[:-2]) / (2 * dt)
    # the rate of Vdot is V T'', and |T''| <= 12 rise/h for a cubic with end slopes of 0 to 3 times its rise
    h, rise = np.diff(BRAKING.chainage), np.diff(0.5 * BRAKING.speed**2) / np.diff(BRAKING.chainage)
    jerk = np.abs(np.diff(Vdot)).max() / dt
    assert jerk < BRAKING.fastest * (12 * np.abs(rise) / h).max()
    assert np.abs(rate - Vdot[1:-1]).max() < 0.5 * jerk * dt


def test_table_is_met_and_constant_beyond():
    """V at the points; constant before and behind; monotone between two points."""
    for x, V in zip(BRAKING.chainage, BRAKING.speed, strict=True):
        assert BRAKING.at(x)[0] == pytest.approx(V, rel=1e-14)
    assert BRAKING.at(-1e4) == (pytest.approx(97.2), 0.0)
    assert BRAKING.at(1e6) == (pytest.approx(80.0), 0.0)
    V = np.array([BRAKING.at(x)[0] for x in np.linspace(0.0, 200.0, 400)])
    assert (np.diff(V) <= 0.0).all()
    assert BRAKING.fastest == 97.2


@pytest.mark.parametrize(
    ("chainage", "speed", "message"),
    [
        ([0.0], [0.0], r"^train.speed_kmh = 0: must be > 0$"),
        ([0.0], [-10 / 3.6], r"^train.speed_kmh = -10: must be > 0$"),
        ([0.0, 9.0], [90.0, np.nan], r"^train.speed_kmh\[1\] = nan: must be > 0$"),
        ([0.0, 0.0], [90.0, 80.0], r"^train.speed_kmh\[1\]: chainage = 0: must be finite and increase$"),
        ([], [], "must be a number or rows"),
        ([0.0, 1.0], [90.0], "must be a number or rows"),
    ],
)
def test_bad_tables_are_refused(chainage, speed, message):
    """One line that names row, value and rule."""
    with pytest.raises(InputError, match=message):
        SpeedProfile(chainage, speed)


def test_largest_acceleration():
    """Inside uniform braking; of two points 1.5 times the mean (a cubic with level ends); none at constant speed."""
    inside = uniformly_braked(97.2, -0.87, np.arange(0.0, 601.0, 50.0))
    assert inside.largest_acceleration(100.0, 500.0) == pytest.approx(0.87, rel=1e-9)
    mean = (97.2**2 - 50.0**2) / 2.0 / 600.0
    two = SpeedProfile.table([0.0, 600.0], [97.2, 50.0])
    assert two.largest_acceleration(-50.0, 700.0) == pytest.approx(1.5 * mean, rel=1e-12)
    assert two.largest_acceleration(0.0, 150.0) == pytest.approx(-two.at(150.0)[1], rel=1e-12)
    assert two.largest_acceleration(601.0, 700.0) == SpeedProfile.constant(80.0).largest_acceleration(0.0, 9.0) == 0.0
    rates = [abs(BRAKING.at(x)[1]) for x in np.linspace(-10.0, 610.0, 20001)]
    # the grid misses the vertex by 0.016 m at most
    assert BRAKING.largest_acceleration(-10.0, 610.0) == pytest.approx(max(rates), rel=1e-6)
