"""Gauges: what a scenario may ask for, and the kinematics of a place that the window passes."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tiengine.engine.sine_state import SineState
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError
from tiengine.recording.gauge_samples import GaugeSamples, RailPlace, SlabPlace
from tiengine.scenario.gauges import nearest_seat, slab_under
from tiengine.scenario.scenario import load_scenario, to_toml
from tiengine.simulation import simulate

from ..models import paper_model

RAIL = {"name": "a", "on": "rail", "chainage": 20.0, "side": "left"}
SLAB = {"name": "b", "on": "slab", "chainage": 20.0, "y": 0.5}
SEAT = {"name": "c", "on": "fastening", "chainage": 20.0, "side": "right"}


@pytest.mark.parametrize(
    ("gauges", "message"),
    [
        ([RAIL, RAIL | {"side": "right"}], r"gauges\[1\].name = 'a': gauges\[0\] already has this name"),
        ([RAIL | {"name": "a b"}], r"gauges\[0\].name = 'a b': must be made of letters, digits, _ and -"),
        ([RAIL | {"name": ""}], r"gauges\[0\].name = '': must be made of"),
        ([RAIL | {"name": "../x"}], r"gauges\[0\].name = '../x': must be made of"),
        ([RAIL | {"on": "sleeper"}], r"gauges\[0\].on = 'sleeper': must be 'rail', 'slab', 'fastening' or 'gap'"),
        ([RAIL | {"chainage": -1.0}], r"gauges\[0\].chainage = -1.0: must be greater than or equal to 0 m"),
        ([RAIL | {"chainage": 1e3}], r"gauges\[0\].chainage = 1000: must be between 0 and 46 m"),
        ([RAIL | {"side": None}], r"gauges\[0\].side: missing; a gauge on a rail needs 'left' or 'right'"),
        ([RAIL | {"y": 0.1}], r"gauges\[0\].y = 0.1: only for a gauge on a slab"),
        ([SEAT | {"side": "up"}], r"gauges\[0\].side = 'up': must be 'left' or 'right'"),
        ([SLAB | {"side": "left"}], r"gauges\[0\].side = 'left': a gauge on a slab has y instead"),
        ([SLAB | {"y": None}], r"gauges\[0\].y: missing; a gauge on a slab needs its distance"),
        ([SLAB | {"y": 1.3}], r"gauges\[0\].y = 1.3: must be within half the slab's width, 1.25 m"),
        ([SLAB | {"y": float("nan")}], r"gauges\[0\].y = nan: must be a finite number"),
        ([SLAB | {"chainage": 17.02}], r"gauges\[0\].chainage = 17.02: lies in a joint; must be on a slab, number 3"),
    ],
)
def test_a_gauge_that_cannot_be_is_refused(gauges, message):
    """Entry, value and rule; the window of 28 m starts at chainage 0 and goes 10 m."""
    tables = [{key: value for key, value in gauge.items() if value is not None} for gauge in gauges]
    with pytest.raises(InputError, match=message):
        load_scenario("default", {"train.distance": 10.0, "gauges": tables})


def test_gauges_load_back_equal():
    scenario = load_scenario("default", {"train.distance": 10.0, "gauges": [RAIL, SLAB, SEAT]})
    assert [gauge.name for gauge in scenario.gauges] == ["a", "b", "c"]
    assert load_scenario(tomllib.loads(to_toml(scenario))) == scenario


def test_gauges_are_those_of_all_trains():
    """They are part of the file, so may not vary."""
    with pytest.raises(InputError, match="'gauges' cannot vary"):
        load_scenario("default", {"ensemble.size": 2, "ensemble.vary": {"gauges": [[RAIL], []]}})


def test_places_of_seats_and_slabs():
    """Seat j at (j + 1/2) d is the nearest from j d to (j + 1) d; slab K lies over K p < x < (K + 1) p."""
    slab = load_scenario("default").parts.slab
    assert (slab.fastening_pitch, slab.pitch) == (0.63, pytest.approx(5.67))
    assert [nearest_seat(x, slab) for x in (0.0, 0.62, 0.64, 6.3 + 0.315)] == [0, 0, 1, 10]
    index, x = slab_under(8.505 + 1.0, slab)
    assert (index, x) == (1, pytest.approx(1.0))


def test_a_place_of_the_rail_moves_with_the_material():
    """With q(t) = a + b t + c t^2 / 2 the field is known in closed form; central differences of the place's own motion.

    Their error is h^2 w^2 / 6 of the terms, w = 50 rad/s being what the shortest of the 25 waves makes of V: 4e-8 for
    h = 1e-5 s; rounding of the second difference is 1e-16 / h^2 = 1e-6 of displacements a ten thousandth of the
    accelerations. Braking is a thousand times what trains can do, so that its term counts.
    """
    model = paper_model()
    n, V, V_rate = 25, 20.0, -2000.0
    state, chainage, start = SineState.at_rest(model), 12.3, 1.7
    random = np.random.default_rng(5)
    motion = random.standard_normal((3, 2, n)) * np.array([1.0, 30.0, 900.0])[:, None, None]
    for row, values in zip((at.U, at.V, at.A), motion, strict=True):
        for block, field in zip(("lateral", "vertical"), values, strict=True):
            state.view(row, block)[0, 1, :n] = field
    k = model.window.wave_numbers[:n]

    def displacement(t: float) -> np.ndarray:
        q = motion[0] + motion[1] * t + motion[2] * t**2 / 2.0
        return q @ np.sin(k * (chainage - start - V * t - V_rate * t**2 / 2.0))

    found = RailPlace(state, model.ingredients.length, chainage, 1).read(start, V, V_rate)
    assert found is not None
    h = 1e-5
    behind, now, ahead = (displacement(t) for t in (-h, 0.0, h))
    np.testing.assert_allclose(found[0, 0], now, rtol=1e-12)
    np.testing.assert_allclose(found[1, 0], (ahead - behind) / (2.0 * h), rtol=1e-6)
    np.testing.assert_allclose(found[2, 0], (ahead - 2.0 * now + behind) / h**2, rtol=1e-6)
    other = RailPlace(state, model.ingredients.length, chainage, 0).read(start, V, V_rate)
    assert other is not None
    assert not other.any()


def test_a_rail_place_is_read_inside_the_window_only():
    model = paper_model()
    state, length = SineState.at_rest(model), model.ingredients.length
    place = RailPlace(state, length, 40.0, 0)
    assert place.read(40.0 - length - 1e-6, 90.0, 0.0) is None
    assert place.read(40.0 - length + 1e-6, 90.0, 0.0) is not None
    assert place.read(40.0 - 1e-6, 90.0, 0.0) is not None
    assert place.read(40.0 + 1e-6, 90.0, 0.0) is None


def test_a_place_of_a_slab_moves_with_its_plate_and_its_rigid_motion():
    """A plane w = 1 + 2 x + 3 y is in the element's shapes; laterally y + psi x, x from the slab's centre."""
    model = paper_model()
    slab, state = model.ingredients.slab, SineState.at_rest(model)
    state.first_slab = 3
    x, y = 1.1, -0.4
    chainage = 4.5 * slab.pitch + x  # on slab 4
    nodes = np.meshgrid(
        np.linspace(-slab.length / 2, slab.length / 2, slab.elements_x + 1),
        np.linspace(-slab.width / 2, slab.width / 2, slab.elements_y + 1),
        indexing="ij",
    )
    w = 1.0 + 2.0 * nodes[0] + 3.0 * nodes[1]
    plane = np.stack([w, np.full_like(w, 2.0), np.full_like(w, 3.0)], axis=-1).ravel()
    for row, factor in ((at.U, 1.0), (at.V, 10.0), (at.A, 100.0)):
        state.view(row, "slabs")[0, 4 % model.ingredients.slots] = factor * np.append(plane, [0.5, 0.25])
    place = SlabPlace(state, model.ingredients, chainage, y)
    found = place.read(chainage - 10.0, 90.0, 0.0)
    assert found is not None
    expected = np.array([0.5 + 0.25 * x, 1.0 + 2.0 * x + 3.0 * y])
    np.testing.assert_allclose(found[:, 0], np.outer([1.0, 10.0, 100.0], expected), rtol=1e-12)
    assert place.read(chainage + 1e-6, 90.0, 0.0) is None  # behind the window, still in memory
    state.first_slab = 5
    assert place.read(chainage - 10.0, 90.0, 0.0) is None


def test_only_steps_with_the_window_over_a_gauge_end_a_launch(monkeypatch: pytest.MonkeyPatch):
    """A gauge that is left and two that are reached have the samples that asking after every step gives."""
    gauges = (
        {"name": "left", "on": "fastening", "chainage": 14.5, "side": "right"},
        {"name": "rail", "on": "rail", "chainage": 52.0, "side": "left"},
        {"name": "slab", "on": "slab", "chainage": 50.0, "y": 0.0},
    )
    scenario = load_scenario("default", {"train.distance": 8.0, "train.start": 30.0, "gauges": list(gauges)})
    found, asked = [], []
    watch = GaugeSamples.watch

    def counted(self: GaugeSamples) -> None:
        asked[-1] += 1
        watch(self)

    monkeypatch.setattr(GaugeSamples, "watch", counted)
    for sparing in (True, False):
        asked.append(0)
        if not sparing:
            monkeypatch.setattr(GaugeSamples, "due", lambda self, plan: plan.wheel >= 0)
        with simulate.run(scenario) as result:
            groups = {gauge["name"]: result.group(f"gauges/{gauge['name']}") for gauge in gauges}
            found.append({name: {key: np.array(group[key]) for key in group} for name, group in groups.items()})
    for name, group in found[0].items():
        assert len(group["time"]) > 0
        for channel, values in group.items():
            np.testing.assert_array_equal(values, found[1][name][channel])
    assert asked[0] < 0.8 * asked[1]
