"""Quasi-static wheelset geometry against stations and conicities of another program, and a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.conicity import equivalent_conicity, rolling_radius_difference, wheelset_position
from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair

EUROPE = {"gauge_depth": 0.014, "half_spacing": 0.75, "wheel_radius": 0.46}


def make_pair(wheel: str, rail: str, **settings: float) -> WheelRailPair:
    """A pair of the library."""
    return WheelRailPair(load_profile(wheel, "wheel"), load_profile(rail, "rail"), ContactSettings(**settings))


def test_lma_chn60_stations() -> None:
    """Roll, contact stations, radii and angles at 0, 3, 6, 8 mm, computed by another program.

    Its digits are 0.01 mm, 0.001 mm and 0.01 deg; where a 1 um shift of the wheel moves the contact by 3 to
    12 um (s at 6 and 8 mm, and with it r and the angle) twice that is allowed.
    """
    position = wheelset_position(make_pair("LMA", "CHN60"), np.array([0.0, 3e-3, 6e-3, 8e-3]))
    np.testing.assert_allclose(position.roll * 1e3, [0.0, -0.1048, -0.2455, -0.4323], atol=6e-5)
    right, left = position.right, position.left
    np.testing.assert_allclose(right.s_w * 1e3, [6.05, 0.41, -8.90, -23.80], atol=0.012)
    np.testing.assert_allclose(left.s_w * 1e3, [6.05, 9.12, 12.23, 14.36], atol=0.006)
    np.testing.assert_allclose(right.dz_w * 1e3, [-0.171, -0.014, 0.395, 2.225], atol=0.0015)
    np.testing.assert_allclose(left.dz_w * 1e3, [-0.171, -0.248, -0.326, -0.379], atol=6e-4)
    gamma_t = np.degrees(np.arctan(right.tan_gamma)), np.degrees(np.arctan(left.tan_gamma))
    np.testing.assert_allclose(gamma_t[0], [1.43, 1.92, 3.11, 11.73], atol=0.03)
    np.testing.assert_allclose(gamma_t[1], [1.43, 1.43, 1.43, 1.43], atol=0.03)


# Another program's values at 1 ... 7 mm. They come out when the rolling-radius difference is sampled every
# 0.25 mm and interpolated linearly, which counts where the contact jumps (S1002/60E1: at 0.2, 4.99, 6.25 mm).
CONICITIES = [
    ("LMA", "CHN60", {}, (0.0256, 0.0270, 0.0350, 0.0420, 0.0482, 0.0539, 0.0631)),
    ("LMA", "60E1", {"gauge_depth": 0.014}, (0.0256, 0.0256, 0.0300, 0.0366, 0.0428, 0.0485, 0.0539)),
    ("S1002", "60E1", EUROPE, (0.3652, 0.2245, 0.1788, 0.1597, 0.2124, 0.3100, 0.8332)),
    ("S1002", "CHN60", {}, (0.0173, 0.0189, 0.0231, 0.0715, 0.0775, 0.0796, 0.0822)),
]
AMPLITUDES = np.arange(1.0, 8.0) * 1e-3


@pytest.mark.parametrize(("wheel", "rail", "settings", "printed"), CONICITIES)
def test_conicities_sampled_alike(wheel, rail, settings, printed) -> None:
    """All 28 values when the difference is sampled as in their source, every 0.25 mm.

    Half a printed digit (0.5e-4) and 0.2 %, what the crown moves by when gauge is measured 0.1 mm less deep
    (below the crown instead of the top) does to S1002/60E1.
    """
    y = np.arange(0.0, 7.3, 0.25) * 1e-3
    difference = rolling_radius_difference(make_pair(wheel, rail, **settings), y)
    t = (np.arange(4000) + 0.5) * np.pi / 8000.0
    for amplitude, expected in zip(AMPLITUDES, printed, strict=True):
        found = (np.interp(amplitude * np.sin(t), y, difference) * np.sin(t)).mean() / amplitude
        assert found == pytest.approx(expected, abs=1e-4 + 2e-3 * expected), f"{amplitude * 1e3:g} mm"


@pytest.mark.parametrize(("wheel", "rail", "settings", "printed"), CONICITIES)
def test_equivalent_conicity(wheel, rail, settings, printed) -> None:
    """Finely integrated: 0.7 % where no jump of contact lies within 0.25 mm of the sweep's ends.

    0.7 % is the curvature of the difference over the source's 0.25 mm samples, plus half a printed digit.
    Left out: amplitudes whose quarter sine passes a jump (S1002 beyond 4 mm; on 60E1 also at 0.2 mm, which
    counts at 1 mm).
    """
    smooth = slice(0, 6) if wheel == "LMA" else slice(1, 4) if rail == "60E1" else slice(0, 3)
    found = equivalent_conicity(make_pair(wheel, rail, **settings), AMPLITUDES[smooth])
    np.testing.assert_allclose(found, printed[smooth], rtol=7e-3)


def test_cones_have_their_own_conicity() -> None:
    """A 1:20 cone on the R300 crown, first order in the shift; tangents squared are neglected.

    A cone keeps its slope where it touches: the contact moves along the crown by R phi only, so that
    d s_w = R phi - (y - r0 phi) on the right. Both wheels touch: b_c phi = -tan (y - r0 phi), b_c the half
    distance of the contacts.
    """
    y = np.linspace(-70e-3, 60e-3, 261)
    tangent, b0, r0 = 0.05, 0.7465, 0.43
    cone = Profile("cone", "wheel", y, -tangent * y)
    pair = WheelRailPair(cone, load_profile("CHN60", "rail"), ContactSettings())
    b_c = b0 + wheelset_position(pair, 0.0).right.s_w[0]
    small = 0.5e-3
    roll = -tangent * small / (b_c - tangent * r0)
    radius = tangent * ((small - r0 * roll) - 0.3 * roll)
    found = rolling_radius_difference(pair, [small])[0]
    assert found == pytest.approx(2.0 * radius, rel=2.0 * tangent**2)
    assert equivalent_conicity(pair, [small])[0] == pytest.approx(radius / small, rel=2.0 * tangent**2)
