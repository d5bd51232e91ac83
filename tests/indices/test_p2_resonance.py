"""P2 resonance against closed forms, Hertz' law by differences, and the independent program of the validation."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.table_cache import contact_table
from tiengine.indices.p2_resonance import contact_stiffness, p2_frequency, p2_of
from tiengine.scenario.contact_settings import contact_settings
from tiengine.scenario.scenario import load_scenario
from tiengine.vehicle.train import assemble, static_wheel_loads
from validation.closed_forms.two_mass import WheelOnTrack, two_mass_frequencies

EI, M, K = 6.0e6, 60.0, 6.0e7


def test_stiff_contact():
    """Both masses as one on k_t: by hand beta = (6e7/2.4e7)^(1/4) = 1.25743, k_t = 9.5434e7, m_r = 71.574 kg."""
    expected = np.sqrt(9.5434e7 / (900.0 + 71.574)) / (2.0 * np.pi)
    assert p2_frequency(900.0, 1e15, EI, M, K) == pytest.approx(expected, rel=1e-4)  # five digits by hand


def test_heavy_wheel_on_a_soft_contact():
    """Rail without mass: springs in series, sqrt(k_H k_t/(k_H + k_t)/m_u)/(2 pi)."""
    k_t = 8.0 * EI * (K / (4.0 * EI)) ** 0.75
    expected = np.sqrt(k_t * k_t / (2.0 * k_t) / 900.0) / (2.0 * np.pi)
    assert p2_frequency(900.0, k_t, EI, 1e-9, K) == pytest.approx(expected, rel=1e-9)


def test_the_paper_track():
    """The validation's eigenvalue problem of the same two masses; contact stiffness as the slope of the table's law."""
    scenario = load_scenario("default")
    parts, train = scenario.parts, assemble(scenario.parts.vehicles)
    settings, load = contact_settings(scenario, train), float(static_wheel_loads(train)[0].mean())
    table = contact_table(parts.wheel, parts.rail_profile, settings)
    hertz = float(table.lookup(0.0, 0.0)[list(table.COLUMNS).index("hertz_K")])
    approach = np.array([load - 1.0, load + 1.0]) / hertz
    slope = 2.0 / np.diff(approach ** (2.0 / 3.0))[0]
    assert contact_stiffness(parts, settings, load) == pytest.approx(slope, rel=1e-3)  # the table is smoothed
    system = WheelOnTrack(
        unsprung=0.5 * float(train.wheelset_mass[0]),
        contact=slope,
        EI=parts.rail.E * parts.rail.Iy,
        m=parts.rail.mass_per_length,
        k=parts.fastening.vertical_stiffness / parts.slab.fastening_pitch,
        c=0.0,
    )
    assert p2_of(parts, settings) == pytest.approx(two_mass_frequencies(system)[0], rel=1e-4)  # its part of 1e-3
