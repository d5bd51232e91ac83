"""Openings in a result: extremes of slabs, events, a gauge in a gap; and going on after a break."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import h5py
import numpy as np
import pytest

from tiengine import result as results
from tiengine.indices.key_figures import key_figures
from tiengine.indices.train_record import Train
from tiengine.model.from_scenario import ingredients
from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate

SLAB, HANGING, GAP = 13, 121, 5e-5
CASE = {
    "train.distance": 28.0, "train.start": 60.0, "irregularity.spectrum": "none", "irregularity.taper": 1.0,
    "output.run_in": 0.0, "output.precision": "double", "output.body_interval": "step", "numerics.time_step": 2e-4,
    "track.mortar_no_tension": True,
    "track.mortar_voids": [{"slab": SLAB, "x": [0.0, 1.8666667], "y": [-1.25, 1.25], "gap": GAP}],
    "track.failed_fastenings": [{"rail": "left", "seats": [HANGING, HANGING], "gap": 2e-4}],
    "gauges": [{"name": "gap", "on": "gap", "chainage": 75.4, "y": 0.1}],
}  # fmt: skip


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run without a break; two chunks."""
    path = tmp_path_factory.mktemp("gaps") / "run.h5"
    simulate.run(load_scenario("default", CASE), path).close()
    return path


def test_extremes_of_a_slab_over_a_gap(path: Path) -> None:
    with results.open(path) as result:
        slabs = {name: data[:] for name, data in result["trains/000/slabs"].items()}
        figures = {each.name: each.value for each in key_figures(Train(result, 0))}
    here = int(np.flatnonzero(slabs["slab"] == SLAB)[0])
    assert 0.5 * GAP < slabs["opening_at_rest"][here] < GAP  # the rest is used up by the slab's weight
    assert slabs["largest_opening"][here] > slabs["opening_at_rest"][here]
    assert slabs["smallest_opening"][here] == 0.0
    assert 1 <= slabs["closings"][here] <= 8
    far = np.abs(slabs["slab"] - SLAB) > 3
    assert slabs["largest_opening"][far].max() < 0.1 * GAP
    assert slabs["mortar_factor"][here] == 0.0
    assert figures["largest opening under a slab at rest"] == pytest.approx(1e3 * slabs["opening_at_rest"][here])
    assert figures["most closings of the gap under a slab"] == slabs["closings"][here]


def test_closing_gaps_are_events_once_each(path: Path) -> None:
    with results.open(path) as result:
        events = result["trains/000/events"]
        kinds, words = events["kind"].asstr()[:].tolist(), events["message"].asstr()[:].tolist()
        seats = {name: data[:] for name, data in result["trains/000/seats"].items()}
    assert kinds == ["gap_closes", "gap_closes"]
    assert sum(f"slab {SLAB}" in each for each in words) == 1
    assert sum(f"seat {HANGING} left" in each for each in words) == 1
    assert seats["factor"][seats["seat"] == HANGING].tolist() == [[0.0, 1.0]]


def test_a_gauge_follows_the_opening(path: Path) -> None:
    """It begins at rest, closes under the wheels, and never goes below zero."""
    with results.open(path) as result:
        opening = result["trains/000/gauges/gap/opening"][:]
        slabs = result["trains/000/slabs"]
        largest = slabs["largest_opening"][:][slabs["slab"][:] == SLAB][0]
    assert opening.min() == 0.0
    assert 0.3 * GAP < opening[0] <= opening.max() <= largest + 1e-15
    assert np.abs(np.diff(opening[:20])).max() < 0.01 * GAP  # far ahead of the train


def test_a_run_over_gaps_goes_on_with_the_same_bits(path: Path, tmp_path: Path) -> None:
    broken, calls = tmp_path / "run.h5", count(1)
    with pytest.raises(RunStoppedError):
        simulate.run(load_scenario("default", CASE), broken, stop=lambda: next(calls) >= 1)
    simulate.resume(broken).close()
    with h5py.File(path) as whole, h5py.File(broken) as file:
        for name in (
            "wheel/normal_force",
            "slabs/largest_opening",
            "slabs/closings",
            "gauges/gap/opening",
            "events/time",
        ):
            assert whole[f"trains/000/{name}"][()].tobytes() == file[f"trains/000/{name}"][()].tobytes(), name


def test_a_gauge_in_a_gap_needs_a_bed_that_lets_go() -> None:
    with pytest.raises(InputError, match=r"gauges\[0\]\.on = 'gap': needs a bed that transmits no tension"):
        load_scenario("default", {"gauges": CASE["gauges"], "train.distance": 40.0, "train.start": 60.0})


def test_a_hanging_seat_carries_by_its_law() -> None:
    """Force of a hanging seat, as recorded, from the motion of rail and slab there, seats being points.

    Its spring holds e - k g beyond its play, e = k (w - w_P) + k u at rest, and damping counts by the same share.
    Within 1 % of the largest: forces are those of the last pass, motions those after it.
    """
    where = {"chainage": (HANGING + 0.5) * 0.63}
    points = {"fastening.length": 0.0, "fastening.baseplate_length": 0.0, "fastening.baseplate_width": 0.0}
    gauges = [
        {"name": "seat", "on": "fastening", "side": "left", **where},
        {"name": "rail", "on": "rail", "side": "left", **where},
        {"name": "slab", "on": "slab", "y": -0.7465, **where},
    ]
    more = {"train.distance": 14.0, "train.start": 68.0, "gauges": gauges}
    scenario = load_scenario("default", CASE | more | {f"track.{key}": value for key, value in points.items()})
    with simulate.run(scenario) as result:
        group = result["trains/000/gauges"]
        force = group["seat/vertical_force"][:]
        time = group["seat/time"][:]
        motion = {}
        for name in ("rail", "slab"):
            here = np.isin(group[f"{name}/time"][:], time)
            motion[name] = [group[f"{name}/{kind}"][here, 1] for kind in ("displacement", "velocity")]
    (w, v), (w_P, v_P) = motion["rail"], motion["slab"]
    g = ingredients(scenario, 2e-4)
    slab, seat = divmod(HANGING, g.slab.fastenings)
    rest = g.dead.seat_force[g.dead.of(slab), seat, 0]
    k, c = g.fastening.vertical_stiffness, g.fastening.vertical_damping
    e = k * w - (k * w_P + c * v_P) + rest
    share = np.maximum(np.abs(e) - k * 2e-4, 0.0) / np.abs(e)
    law = share * (k * (w - w_P) + c * (v - v_P) + rest)
    assert 300.0 < rest < 0.5 * k * 2e-4  # the weight of about a seat pitch of rail, and the gap is open
    assert force.max() > 5e3
    assert np.abs(force - law).max() < 0.01 * force.max()
    assert np.count_nonzero(force == 0.0) > 0.3 * len(force)
