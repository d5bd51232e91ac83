"""Second patches of the contact table: found where they are, kept apart by place, handed over without a jump."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tiengine.contact.branches import RAMP, in_slots, split_stations
from tiengine.contact.profile import load_profile
from tiengine.contact.search import DEEPEST, FAR, HIGH_RIDGE, Contacts, SecondContacts
from tiengine.contact.table import ContactSettings, ContactTable, WheelRailPair, build_contact_table
from tiengine.contact.table_cache import contact_table
from validation.cases import manchester as one_patch
from validation.cases import manchester_two_patches as reference

GAP, S_W, TAN, K = 0, 1, 4, 5
SECOND = 10
"""First column of the second slot."""
SMALL = {"alpha_max": 2e-3, "dalpha": 5e-4, "u_min": -3e-3, "u_max": 8e-3}


@cache
def s1002(patches: int = 2) -> tuple[WheelRailPair, ContactTable]:
    """S1002 on 60E1, which touches tread and flange root at once at u = 5.1 mm."""
    settings = ContactSettings(half_spacing=0.75, gauge_depth=0.014, wheel_radius=0.46, patches=patches, **SMALL)
    pair = WheelRailPair(load_profile("S1002", "wheel"), load_profile("60E1", "rail"), settings)
    return pair, contact_table(pair.wheel, pair.rail, settings)


def gap_along(pair: WheelRailPair, u: float, s: np.ndarray) -> np.ndarray:
    """Gap over the stations of an untilted wheel."""
    o = u + pair.settings.half_spacing - pair.crown_offset + s
    return np.asarray(pair.canted_rail.height(o) - pair.wheel.height(s))


def test_second_minimum_is_that_of_a_dense_scan() -> None:
    """Both minima at u = 5.0 and 5.4 mm by brute force: 1 um of station moves the gap by 1e-11 m."""
    pair, _ = s1002()
    u = np.array([5.0e-3, 5.4e-3])
    first = pair.contacts(u, np.zeros(2))
    second = pair.second_contacts(u, np.zeros(2), first)
    assert (second.share > 0.5).all()
    for i in range(2):
        for low, high in ((-25e-3, -10e-3), (-35e-3, -25e-3)):
            s = np.arange(low, high, 1e-6)
            gap = gap_along(pair, float(u[i]), s)
            mine = first if low < first.s_w[i] < high else second.at
            assert mine.s_w[i] == pytest.approx(s[gap.argmin()], abs=1.1e-6)
        level = min(gap_along(pair, float(u[i]), np.arange(-35e-3, -10e-3, 1e-6)))
        apart = second.at.gap[i] - first.gap[i]
        at_second = float(gap_along(pair, float(u[i]), second.at.s_w[i : i + 1])[0])
        assert apart == pytest.approx(at_second - level, abs=1e-10)


def test_shallow_minima_of_a_tread_are_one_patch() -> None:
    """S1002 has two minima 9 mm apart on its tread, 3 um deep, over which CONTACT finds one patch at 10 kN (row 0)."""
    pair, _ = s1002()
    u = np.linspace(-0.5e-3, 0.5e-3, 41)
    first = pair.contacts(u, np.zeros_like(u))
    assert np.ptp(first.s_w) > FAR  # the contact jumps between them
    assert not pair.second_contacts(u, np.zeros_like(u), first).share.any()
    assert one_patch.REFERENCE["npatch"][0] == 1


def test_second_minimum_out_of_reach_is_none() -> None:
    """0.2 mm above the first one no wheel load closes the gap."""
    pair, _ = s1002()
    u = np.linspace(3e-3, 7e-3, 401)
    first = pair.contacts(u, np.zeros_like(u))
    second = pair.second_contacts(u, np.zeros_like(u), first)
    two = second.share > 0.0
    assert two.any()
    assert (second.at.gap - first.gap)[two].max() < DEEPEST
    assert np.abs(second.at.s_w - first.s_w)[two].min() > FAR
    assert HIGH_RIDGE < 26e-6  # the ridge of CONTACT's two patches


def made(s_w: list[float], other: list[float], share: list[float]) -> tuple[Contacts, SecondContacts]:
    """Contacts of which only stations and shares matter."""
    first = Contacts(*(np.array(s_w) for _ in range(5)))
    return first, SecondContacts(np.array(share), Contacts(*(np.array(other) for _ in range(5))))


def test_slots_are_told_apart_by_place() -> None:
    """Tread and root in two slots whichever is lower; a lone contact on its way across is in both, in sum once."""
    first, second = made(
        [-0.018, -0.028, -0.010, -0.040, -0.023, -0.0234], [-0.028, -0.018, 0, 0, 0, 0], [1.0, 0.3, 0, 0, 0, 0]
    )
    splits = split_stations(first, second)
    np.testing.assert_allclose(splits, [-0.023])
    slots = in_slots(first, second, splits)
    np.testing.assert_allclose(slots.share[:, :4], [[1.0, 0.3, 1.0, 0.0], [1.0, 1.0, 0.0, 1.0]])
    np.testing.assert_allclose(slots.share[:, 2:].sum(axis=0), 1.0)
    assert slots.share[0, 4] == pytest.approx(0.5)
    assert 0.0 < slots.share[0, 5] < 0.5 < slots.share[1, 5] < 1.0
    np.testing.assert_allclose(slots.contacts[0].s_w[:2], -0.018)
    np.testing.assert_allclose(slots.contacts[1].s_w[:2], -0.028)


def test_one_split_serves_all_pairs_it_can() -> None:
    """Pairs that share a stretch share a split, others get their own."""
    first, second = made([-0.018, -0.016, 0.02], [-0.028, -0.030, 0.01], [1.0, 1.0, 1.0])
    splits = split_stations(first, second)
    assert len(splits) == 2
    assert splits[0] > splits[1]
    assert 0.01 + RAMP < splits[0] < 0.02 - RAMP
    assert -0.028 + RAMP < splits[1] < -0.018 - RAMP


def test_without_pairs_the_first_slot_is_the_table_of_one_patch() -> None:
    """LMA on CHN60 touches in one place: the same bits, and nothing in the second slot."""
    settings = ContactSettings(alpha_max=1e-3, dalpha=5e-4, u_min=-6e-3, u_max=6e-3)
    wheel, rail = load_profile("LMA", "wheel"), load_profile("CHN60", "rail")
    one = build_contact_table(wheel, rail, settings).values
    two = build_contact_table(wheel, rail, settings.model_copy(update={"patches": 2})).values
    np.testing.assert_array_equal(two[..., :SECOND], one)
    assert (two[..., SECOND + K] < 1e-6 * one[..., K]).all()
    assert (two[..., SECOND + GAP] >= one[..., GAP] + 0.99 * DEEPEST).all()


def test_a_lone_contact_acts_once() -> None:
    """Away from pairs and jumps the stiffness of both slots adds up to that of the table of one patch."""
    _, one = s1002(1)
    _, two = s1002(2)
    for u in (1.5e-3, 3.0e-3, 6.3e-3, 7.5e-3):
        sums = two.lookup(u, 0.0)[[K, SECOND + K]].sum()
        assert sums == pytest.approx(one.lookup(u, 0.0)[K], rel=1e-4)  # 1e-5 of shares are left out as negligible


def test_slope_of_either_gap_is_its_tangent() -> None:
    """Where both patches are whole, tan gamma is -dg/du of each: their normal forces have a potential.

    To a thousandth: the means over the Gaussian leave out places where a patch has no share, 0.3 mm away.
    """
    _, table = s1002()
    h = 1e-6
    for u in np.arange(5.0e-3, 5.3e-3, 0.05e-3):
        slope = (table.lookup(u - h, 0.0) - table.lookup(u + h, 0.0)) / (2.0 * h)
        at = table.lookup(u, 0.0)
        for slot in (0, SECOND):
            assert slope[slot + GAP] == pytest.approx(at[slot + TAN], abs=1e-3)


def load_at(table: ContactTable, u: np.ndarray, alpha: np.ndarray | float, load: float) -> np.ndarray:
    """Normal forces of both slots under a vertical load without friction, shape (n, 2), by bisection."""
    columns = table.lookup(u, alpha)
    gap, tan, stiffness = (columns[:, [c, SECOND + c]] for c in (GAP, TAN, K))
    cos = 1.0 / np.hypot(1.0, tan)
    low = gap.min(axis=1)
    high = low + 1e-3

    def forces(z: np.ndarray) -> np.ndarray:
        return np.asarray(np.maximum(stiffness, 0.0) * np.maximum((z[:, None] - gap) * cos, 0.0) ** 1.5)

    for _ in range(60):
        middle = 0.5 * (low + high)
        heavy = (forces(middle) * cos).sum(axis=1) > load
        low, high = np.where(heavy, low, middle), np.where(heavy, middle, high)
    return forces(high)


@pytest.mark.parametrize(("begin", "end"), [(3.9e-3, 6.0e-3), (6.0e-3, 7.0e-3)])
@pytest.mark.parametrize("load", [10e3, 60e3])
def test_load_passes_without_a_jump(begin: float, end: float, load: float) -> None:
    """From tread to root and on to the flange: halving the step halves the largest change of either patch's force."""
    _, table = s1002()
    changes = []
    for count in (4001, 8001):
        force = load_at(table, np.linspace(begin, end, count), 0.0, load)
        changes.append(np.abs(np.diff(force, axis=0)).max())
    assert changes[1] < 0.55 * changes[0]
    shares = load_at(table, np.array([3.9e-3, 6.0e-3]), 0.0, load)
    assert (shares[[0, 1], [0, 1]] < 1e-3 * load).all() or (shares[[0, 1], [1, 0]] < 1e-3 * load).all()


def test_benchmark_from_6_to_6_5_mm() -> None:
    """The yawed wheel of the Manchester benchmark climbs from root to flange: no jump either (issue's case)."""
    settings = one_patch.SETTINGS.model_copy(update={"patches": 2, "u_min": -1e-3, "u_max": 8e-3, "alpha_max": 5e-3})
    wheel = one_patch.envelope(0.015)[0]
    table = build_contact_table(wheel, one_patch.RAIL, settings.model_copy(update={"dalpha": 1e-3}))
    part = np.linspace(0.0, 1.0, 4001)
    roll = -0.0006272 + part * (-0.004376 + 0.0006272)
    shift = 6.0e-3 + 0.5e-3 * part - 0.46 * roll
    largest = []
    for every in (2, 1):
        force = load_at(table, shift[::every], roll[::every], 10e3)
        largest.append(np.abs(np.diff(force, axis=0)).max())
    assert largest[1] < 0.55 * largest[0]


def test_benchmark_patches() -> None:
    """CONTACT's two patches: see ``validation/cases/manchester_two_patches.py``."""
    for case in reference.CASES:
        error = np.abs(np.asarray(case.compute()) - case.reference)
        assert (error <= np.asarray(case.atol)).all(), case.name


def test_table_of_two_patches_is_cached_apart(tmp_path, monkeypatch) -> None:
    """The number of patches is part of the key."""
    monkeypatch.setenv("TIENGINE_CACHE", str(tmp_path))
    wheel, rail = load_profile("LMA", "wheel"), load_profile("CHN60", "rail")
    coarse = ContactSettings(du=5e-5, dalpha=2e-3, alpha_max=2e-3, smoothing=0.0)
    shapes = [
        contact_table(wheel, rail, coarse.model_copy(update={"patches": p})).values.shape[2] for p in (1, 2, 1, 2)
    ]
    assert shapes == [10, 20, 10, 20]
    assert len(list(tmp_path.rglob("contact-*.npz"))) == 2
