"""Contact geometry: closed forms for arcs, the table's smoothness, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.conicity import wheelset_position
from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.search import find_contacts
from tiengine.contact.table import ContactSettings, ContactTable, WheelRailPair, build_contact_table
from tiengine.parameters.errors import InputError

DRAWN = 1e-8  # m: arcs printed to 1e-5 mm, points to 1e-6 mm, five such numbers in a gap
NAMES = list(ContactTable.COLUMNS)


@pytest.fixture(scope="module")
def pair() -> WheelRailPair:
    """LMA on CHN60, 1:40, the default settings."""
    return WheelRailPair(load_profile("LMA", "wheel"), load_profile("CHN60", "rail"), ContactSettings())


@pytest.fixture(scope="module")
def table(pair: WheelRailPair) -> ContactTable:
    """The table of that pair."""
    return build_contact_table(pair.wheel, pair.rail, pair.settings)


def raw_contacts(pair: WheelRailPair, u: np.ndarray, alpha: np.ndarray):
    """Contacts with the gap left absolute."""
    offset = pair.settings.half_spacing - pair.crown_offset
    return offset, find_contacts(pair.wheel, pair.canted_rail, offset, u, alpha)


def canted_centre(y: float, z: float) -> tuple[float, float]:
    """An arc centre of CHN60, turned by 1:40 [m]."""
    c, s = np.cos(np.arctan(0.025)), np.sin(np.arctan(0.025))
    return y * c + z * s, z * c - y * s


def test_hollow_tread_on_crown(pair: WheelRailPair) -> None:
    """R450 hollow on R300 crown touch on the line of their centres, 150 mm apart."""
    u, alpha = (g.ravel() for g in np.meshgrid(np.linspace(3e-3, 5e-3, 9), np.linspace(-1e-3, 1e-3, 5)))
    offset, found = raw_contacts(pair, u, alpha)
    o_w = u + offset + 15.49889e-3 * np.cos(alpha) - 449.73301e-3 * np.sin(alpha)
    z_w = 15.49889e-3 * np.sin(alpha) + 449.73301e-3 * np.cos(alpha)
    o_r, z_r = canted_centre(0.0, 0.3)
    across = (o_w - o_r) / 0.15  # sine of the angle of the line of centres
    np.testing.assert_allclose(found.gap, 0.15 * np.sqrt(1.0 - across**2) - (z_w - z_r), atol=DRAWN)
    # the contact on the line of centres, found from slopes known to 1e-5 on a relative curvature of 1.1/m
    np.testing.assert_allclose(found.s_r, o_r - 0.3 * across, atol=1e-5 / 1.1)
    np.testing.assert_allclose(found.tan_gamma, across / np.sqrt(1.0 - across**2), atol=4e-5)


def test_flank_on_gauge_corner(pair: WheelRailPair) -> None:
    """The 70 deg flank touches R13 where its normal passes through the centre; tilt takes from the angle."""
    u, alpha = (g.ravel() for g in np.meshgrid(np.linspace(10.3e-3, 11.7e-3, 8), np.linspace(-5e-3, 5e-3, 5)))
    offset, found = raw_contacts(pair, u, alpha)
    gamma = np.radians(70.0) - alpha
    o_r, z_r = canted_centre(-22.40885e-3, 14.83429e-3)
    s_r = o_r - 13e-3 * np.sin(gamma)
    np.testing.assert_allclose(found.s_r, s_r, atol=1e-6)  # slope to 1e-5 on 1/13 mm curvature, over cos gamma
    np.testing.assert_allclose(found.tan_gamma, np.tan(gamma), rtol=1e-4)
    # a point of the flank's line, its joint to R14
    o_w = u + offset - 38.02522e-3 * np.cos(alpha) - 12.06763e-3 * np.sin(alpha)
    z_w = -38.02522e-3 * np.sin(alpha) + 12.06763e-3 * np.cos(alpha)
    gap = z_r - 13e-3 * np.cos(gamma) - (z_w - np.tan(gamma) * (s_r - o_w))
    np.testing.assert_allclose(found.gap, gap, atol=3.0 * DRAWN)  # tan 70 deg = 2.75 times lateral rounding


def test_gap_slopes(pair: WheelRailPair) -> None:
    """-dg/du is tan gamma and dg/dalpha the contact's own motion, by the envelope theorem."""
    u, alpha = np.linspace(-15e-3, 12.8e-3, 311)[:, None], np.array([-5e-3, -1.3e-3, 0.0, 2e-3])
    h = 5e-7
    at = pair.contacts(u, alpha)
    by_u = (pair.contacts(u - h, alpha).gap - pair.contacts(u + h, alpha).gap) / (2.0 * h)
    by_alpha = (pair.contacts(u, alpha - h).gap - pair.contacts(u, alpha + h).gap) / (2.0 * h)
    c, s = np.cos(alpha), np.sin(alpha)
    motion = at.s_w * c - at.dz_w * s - at.tan_gamma * (at.s_w * s + at.dz_w * c)
    # within h of a jump of the contact the difference straddles it: of 1244 points a few may
    error = np.sort(np.abs(by_u - at.tan_gamma).ravel())
    assert error[-6] < 2e-4  # h^2/6 g''' = 4e-14 * 5e9/m^2 at the flange root's joint
    assert np.sort(np.abs(by_alpha - motion).ravel())[-6] < 1e-7


def test_table_shape_and_origin(table: ContactTable) -> None:
    """Nodes are multiples of the steps, one beyond the range at each end; the gap at (0, 0) is zero."""
    assert table.values.shape == (1163, 99, 10)
    assert table.values.flags.c_contiguous
    assert table.values.dtype == np.float64
    assert table.u_min == pytest.approx(-16.025e-3)
    assert table.alpha_min == pytest.approx(-12.25e-3)
    assert np.isfinite(table.values).all()
    assert table.lookup(0.0, 0.0)[0] == 0.0


def test_nominal_contact(table: ContactTable) -> None:
    """At (0, 0) LMA's 1:40 part stands on the crown: s_r = 0, s_w = y_r - b0, tan gamma = 1/40."""
    gap, s_w, s_r, r_c, tan_gamma = table.lookup(0.0, 0.0)[:5]
    assert gap == 0.0
    assert s_w == pytest.approx(table.crown_offset - 0.7465, abs=1e-6)
    assert s_r == pytest.approx(0.0, abs=1e-6)
    assert r_c == pytest.approx(0.4298267, abs=5e-6)  # a public code's constant from its own table of LMA
    assert tan_gamma == pytest.approx(0.025, abs=1e-6)


def test_hertz_stiffness_on_arcs(table: ContactTable) -> None:
    """K away from joints: cone on R300 at u = -10 mm, R450 hollow on R300 at u = 3.5 mm, E = 2.059e11.

    The printed G (4.954e-8, 4.102e-8) are for r_c = 0.43 m, E = 2.06e11: 0.1 % from these.
    """
    for u, printed in ((-10e-3, 4.954e-8), (3.5e-3, 4.102e-8)):
        assert table.lookup(u, 0.0)[5] ** (-2.0 / 3.0) == pytest.approx(printed, rel=2e-3)


def test_stiffness_is_smooth_across_arc_joints(table: ContactTable) -> None:
    """Point curvatures jump by a third in K at u = 1.7 mm; over a patch of 8 mm K drifts there instead.

    A drift of 33 % spread over 8 mm of wheel, 1.5 mm of u, is 1 % per node; twice that is allowed.
    """
    u = np.arange(-5e-3, 6.5e-3, 0.05e-3)
    K = table.lookup(u[:, None], np.array([-3e-3, 0.0, 3e-3]))[..., 5]
    assert np.abs(np.diff(np.log(K), axis=0)).max() < 0.02


def test_tan_gamma_is_the_slope_of_the_tabulated_gap(table: ContactTable) -> None:
    """The interpolated gap's slope and the interpolated tan gamma differ by the interpolation only."""
    u, h = np.arange(-15.9e-3, 12.9e-3, 7e-6)[:, None], 1e-7
    alpha = np.array([-6e-3, -2.9e-3, 0.0, 1.13e-3, 6e-3])
    slope = (table.lookup(u - h, alpha)[..., 0] - table.lookup(u + h, alpha)[..., 0]) / (2.0 * h)
    error = np.abs(slope - table.lookup(u, alpha)[..., 4])
    # Catmull-Rom's slope at a node is off by du^2/6 g'''. At the flange root tan gamma rises by 0.30 a node,
    # which is the Gaussian of a jump by 1.5: |g'''| <= 1.5 * 0.242/sigma^2, so 0.06 (du/sigma)^2
    assert error.max() < 0.06 * 0.25
    # before it at most a joint of arcs: tan gamma bends by 0.1/mm, |g'''| <= 0.1/mm * 0.4/sigma
    assert error[u[:, 0] < 6.5e-3].max() < 2e-4


def test_lookup_hits_nodes_and_reproduces_quadratics(table: ContactTable) -> None:
    """Catmull-Rom passes through its nodes and is exact for parabolas in each direction."""
    u = table.u_min + table.du * np.arange(table.values.shape[0])
    alpha = table.alpha_min + table.dalpha * np.arange(table.values.shape[1])
    inner = table.lookup(u[1:-1, None], alpha[None, 1:-1])
    # a node's position is known to 1e-16 * 16 mm, 1e-13 of a cell; neighbours differ by up to half the value
    np.testing.assert_allclose(inner, table.values[1:-1, 1:-1], rtol=1e-11, atol=1e-13)
    parabola = (1.0 + 3.0 * u + 50.0 * u**2)[:, None, None] * (2.0 - alpha + 70.0 * alpha**2)[None, :, None]
    made = ContactTable(table.u_min, table.du, table.alpha_min, table.dalpha, parabola, 0.0, table.settings)
    x, y = np.array([-0.0131, 0.0002, 0.0127]), np.array([-0.0059, 0.0011, 0.0060])
    expected = (1.0 + 3.0 * x + 50.0 * x**2) * (2.0 - y + 70.0 * y**2)
    np.testing.assert_allclose(made.lookup(x, y)[:, 0], expected, rtol=1e-13)


@pytest.mark.parametrize("direction", ["u", "alpha"])
def test_lookup_is_continuously_differentiable(table: ContactTable, direction: str) -> None:
    """Value and slope agree from both sides of nodes."""
    start, cell = (table.u_min, table.du) if direction == "u" else (table.alpha_min, table.dalpha)
    step = cell * 1e-5
    x = start + cell * np.arange(5, table.values.shape[0 if direction == "u" else 1] - 5)

    def at(t: np.ndarray) -> np.ndarray:
        return table.lookup(t, 0.3e-3) if direction == "u" else table.lookup(1.234e-3, t)

    below, above = (at(x) - at(x - step)) / step, (at(x + step) - at(x)) / step
    # over 1e-5 of a cell the slope changes by 1e-5 of what it does over a cell (at most 6 times the largest
    # slope); rounding of values over the step: 1e-15 * value / step
    scale = np.abs(above).max(axis=0)
    rounding = 1e-15 * np.abs(at(x)).max(axis=0) / step
    assert (np.abs(above - below).max(axis=0) < 1e-4 * scale + 4.0 * rounding).all()


def test_beyond_the_range_the_end_is_taken(table: ContactTable) -> None:
    """A wheel past the table sees its last column, not an extrapolated cubic."""
    np.testing.assert_array_equal(table.lookup(0.05, 0.1), table.lookup(13e-3 + 1e-12, 12e-3 + 1e-12))


@pytest.mark.parametrize(("rail", "settings"), [("CHN60", {}), ("60E1", {"gauge_depth": 0.014, "half_spacing": 0.75})])
def test_tilt_of_a_wheel_on_its_flange_is_within_the_table(rail: str, settings: dict[str, float]) -> None:
    """S1002 on straight track, shifted until the table ends in u: the roll stays inside, with 2 mrad to spare.

    On the flange, where roll is steepest (beyond the 6 mrad that the table once held), the gap is that of the search.
    """
    pair = WheelRailPair(load_profile("S1002", "wheel"), load_profile(rail, "rail"), ContactSettings(**settings))
    y = np.arange(0.0, 11e-3, 0.25e-3)
    roll = wheelset_position(pair, y).roll
    u = y - pair.settings.wheel_radius * roll
    within = u < pair.settings.u_max
    assert np.abs(roll[within]).max() < pair.settings.alpha_max - 2e-3
    assert u.max() > pair.settings.u_max


def test_the_table_is_that_of_the_search_at_large_tilt(table: ContactTable, pair: WheelRailPair) -> None:
    """On the flank at 7 to 11 mrad; smoothing by 0.1 mm is linear there, the grid of 0.25 mrad leaves 1 um."""
    u, alpha = np.full(5, 11e-3), -np.linspace(7e-3, 11e-3, 5)
    np.testing.assert_allclose(table.lookup(u, alpha)[:, 0], pair.contacts(u, alpha).gap, atol=1e-6)


def test_unsmoothed_table_is_the_pair(pair: WheelRailPair) -> None:
    """smoothing = 0 puts the contacts themselves on the nodes."""
    settings = ContactSettings(smoothing=0.0, u_min=-2e-3, u_max=2e-3, alpha_max=0.5e-3)
    table = build_contact_table(pair.wheel, pair.rail, settings)
    u, alpha = np.array([-2e-3, 0.35e-3, 2e-3]), np.array([-0.5e-3, 0.25e-3, 0.5e-3])
    found = pair.contacts(u, alpha)
    assert table.lookup(u, alpha)[:, 0] == pytest.approx(found.gap, abs=1e-15)
    assert table.lookup(u, alpha)[:, 1] == pytest.approx(found.s_w, abs=1e-9)


def test_smoothing_moves_the_gap_little_on_the_tread(pair: WheelRailPair, table: ContactTable) -> None:
    """A Gaussian moves a function by g''/2 sigma^2; the slope of tan gamma is up to 0.12/mm: 0.6 um."""
    u = np.linspace(-15.5e-3, 7.5e-3, 200)
    moved = table.lookup(u, 0.13e-3)[:, 0] - pair.contacts(u, 0.13e-3).gap
    assert np.abs(moved).max() < 0.6e-6


def test_same_input_same_bits(pair: WheelRailPair) -> None:
    """Building is deterministic."""
    settings = ContactSettings(u_min=-1e-3, u_max=1e-3, alpha_max=0.5e-3)
    first, second = (build_contact_table(pair.wheel, pair.rail, settings).values for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_zhai_stiffness(pair: WheelRailPair) -> None:
    """Zhai's worn-tread law for R = 0.43 m: G = 4.253e-8 everywhere; creep coefficients stay Hertz's."""
    small = {"u_min": -0.5e-3, "u_max": 0.5e-3, "alpha_max": 0.25e-3}
    zhai = build_contact_table(pair.wheel, pair.rail, ContactSettings(hertz="zhai_worn", **small)).values
    exact = build_contact_table(pair.wheel, pair.rail, ContactSettings(**small)).values
    np.testing.assert_allclose(zhai[..., 5] ** (-2.0 / 3.0), 4.253e-8, rtol=1e-4)  # four printed digits
    np.testing.assert_array_equal(zhai[..., 6:], exact[..., 6:])


def test_creep_coefficients_by_hand(table: ContactTable) -> None:
    """u = -10 mm: cone on R300, a/b = 1.27 by Hertz's table, Kalker between a/b = 1.25 and 1.43 by linear nu.

    G a b C11 with a1, b1 of FACTS' 70 kN numbers (6.19, 4.87 mm) and C11 = 4.53 at nu = 0.3: within their
    digits.
    """
    third = 70e3 ** (1.0 / 3.0)
    shear = 2.059e11 / 2.6
    c11, c22, c23, c33 = table.lookup(-10e-3, 0.0)[6:]
    ab = 6.19e-3 * 4.87e-3
    # C at nu = 0.3, a/b = 1.271, between the table's columns b/a = 0.8 and 0.7 (printed to three digits)
    between = (1.0 / (6.19 / 4.87) - 0.7) / 0.1
    C = [
        between * 1.0 / (-0.08 / x[0] + 0.96 / x[1] + 0.12 / x[2])
        + (1.0 - between) / (-0.08 / y[0] + 0.96 / y[1] + 0.12 / y[2])
        for x, y in (
            ((3.65, 4.36, 5.42), (3.82, 4.54, 5.58)),
            ((3.65, 3.99, 4.39), (3.82, 4.21, 4.67)),
            ((1.58, 1.75, 1.94), (1.76, 1.95, 2.18)),
            ((1.10, 1.04, 0.954), (1.05, 0.965, 0.852)),
        )
    ]
    expected = [
        shear * ab * C[0] / third**2,
        shear * ab * C[1] / third**2,
        shear * ab**1.5 * C[2] / third**3,
        shear * ab**2 * C[3] / third**4,
    ]
    np.testing.assert_allclose([c11, c22, c23, c33], expected, rtol=0.01)  # three digits of a, b, C each


def test_refusals(pair: WheelRailPair) -> None:
    """Errors name the profile and the rule."""
    with pytest.raises(InputError, match="'LMA' is that of a wheel; a rail profile expected"):
        WheelRailPair(pair.wheel, pair.wheel, pair.settings)
    short = Profile("narrow", "wheel", pair.wheel.y[500:-500], pair.wheel.z[500:-500])
    with pytest.raises(InputError, match=r"'narrow' on rail 'CHN60': no contact inside both profiles at u = .* mm"):
        build_contact_table(short, pair.rail, pair.settings)
    with pytest.raises(ValueError, match=r"less than or equal to 0\.00005"):
        ContactSettings(du=1e-4)
