"""Envelopes of seats and slabs, gauges, the deflected track in the file: against one another and the wheels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from tiengine import result as results
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.result import Result
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate, time_loop

from ..models import V350

FAILED, VOID = 41, 4
"""Seat of the failed left fastening and slab of the void, both in the window of 28 m from the beginning."""
DT, STEPS = 2e-4, 412
"""A distance of 8 m at 350 km/h, less than half a step more."""
START = 14.0
"""Chainage of the first vehicle's centre, in the middle of the window [m]."""
WHEEL_STEP, SHOT_STEP = 200, 250
"""Steps when the second wheelset stands over the gauge ``rail``, and of the snapshot with ``under`` and ``bent``."""


def chainage_of(step: int) -> float:
    """Chainage of the first vehicle's centre at the end of a step [m]."""
    return START + V350 * DT * step


GAUGES: list[dict[str, Any]] = [
    {"name": "rail", "on": "rail", "chainage": chainage_of(WHEEL_STEP) + 7.5, "side": "right"},
    {"name": "bent", "on": "rail", "chainage": chainage_of(SHOT_STEP) + 1.0, "side": "left"},
    {"name": "under", "on": "slab", "chainage": chainage_of(SHOT_STEP) + 1.0, "y": -0.7465},
    {"name": "seat", "on": "fastening", "chainage": 26.0, "side": "right"},
    {"name": "failed", "on": "fastening", "chainage": (FAILED + 0.5) * 0.63, "side": "left"},
]
FAR = {"name": "far", "on": "rail", "chainage": 35.9, "side": "left"}
CASE = {
    "train.distance": 8.0,
    "numerics.time_step": DT,
    "numerics.window": 28.0,
    "numerics.truncation": "none",  # else wheels feel a compliance that the gauges' rail has not
    "output.precision": "double",
    "output.body_interval": 1e-3,
    "output.deflection_interval": 1e-2,
    "irregularity.taper": 1.0,
    "track.failed_fastenings": [{"rail": "left", "seats": [FAILED, FAILED + 1]}],
    "track.mortar_voids": [{"slab": VOID, "x": [2.0, 3.0], "y": [-1.25, 0.0]}],
    "gauges": GAUGES,
}
GROUPS = ("seats", "slabs", "deflection", *(f"gauges/{gauge['name']}" for gauge in (*GAUGES, FAR)))


def result_of(**changes: Any) -> Result:
    """A run over 8 m, in memory; two underscores stand for a dot."""
    return simulate.run(load_scenario("default", CASE | {k.replace("__", "."): v for k, v in changes.items()}))


@pytest.fixture(scope="module")
def result() -> Result:
    return result_of(gauges=[*GAUGES, FAR])


# --- the file ---------------------------------------------------------------------------------------------------------


def test_envelope_of_a_seat_is_its_gauges_extreme(result):
    """Bit for bit: both take every step."""
    gauges, seats = result.gauges(), result.seats()
    for name, seat, side in (("seat", 41, 1), ("failed", FAILED, 0)):
        facts = dict(result[f"trains/000/gauges/{name}"].attrs)
        assert (facts["seat"], facts["on"], facts["side"]) == (seat, "fastening", ("left", "right")[side])
        assert facts["chainage"] == pytest.approx((seat + 0.5) * 0.63)
        here = np.flatnonzero(seats["seat"] == seat)[0]
        for kind in ("vertical", "lateral"):
            force = gauges[name][f"{kind}_force"]
            assert force.shape == (len(gauges[name]["time"]),)
            assert seats[f"largest_{kind}_force"][here, side] == force.max()
            assert seats[f"smallest_{kind}_force"][here, side] == force.min()


def test_a_failed_fastening_carries_nothing_and_its_neighbours_more(result):
    """Its factor is in the file; the neighbours' share is beyond that of the other rail's seats."""
    seats = result.seats()
    rows = [list(seats["seat"]).index(seat) for seat in (FAILED - 1, FAILED, FAILED + 1, FAILED + 2)]
    np.testing.assert_array_equal(seats["factor"][rows], [[1, 1], [0, 1], [0, 1], [1, 1]])
    assert seats["factor"].sum() == seats["factor"].size - 2
    for name in (
        "largest_vertical_force",
        "smallest_vertical_force",
        "largest_lateral_force",
        "smallest_lateral_force",
    ):
        np.testing.assert_array_equal(seats[name][rows[1:3], 0], 0.0)
        assert np.all(seats[name][rows[1:3], 1] != 0.0)
    force = seats["largest_vertical_force"]
    assert np.all(force[[rows[0], rows[3]], 0] > 1.2 * force[[rows[0], rows[3]], 1])


def test_envelopes_go_along_the_whole_way(result):
    """Seats and slabs without gaps from the window's rear end at the start to its front end at the end.

    The rear place of the window is left out: at times its seat reaches over the end.
    """
    seats, slabs = result.seats(), result.slabs()
    np.testing.assert_array_equal(seats["seat"], np.arange(1, seats["seat"][-1] + 1))
    np.testing.assert_allclose(seats["chainage"], (seats["seat"] + 0.5) * 0.63, rtol=1e-12)
    assert 36.0 - 2.0 * 0.63 < seats["chainage"][-1] <= 36.0 + 0.02
    np.testing.assert_array_equal(slabs["slab"], np.arange(slabs["slab"][-1] + 1))
    np.testing.assert_allclose(slabs["chainage"], (slabs["slab"] + 0.5) * 5.67, rtol=1e-12)
    assert slabs["chainage"][-1] + 5.67 / 2.0 > 36.0
    np.testing.assert_array_equal(slabs["mortar_factor"], np.where(slabs["slab"] == VOID, 0.0, 1.0))
    for group in (seats, slabs):
        for name, values in group.items():
            if name.startswith("largest"):
                assert np.isfinite(values).all()
                assert np.all(values >= group[name.replace("largest", "smallest")])


def test_pressures_of_a_slab_are_those_of_the_bed(result):
    """Over the samples of the group ``mortar``, bit for bit."""
    mortar, slabs = result.group("mortar"), result.slabs()
    for row, slab in enumerate(slabs["slab"]):
        held = mortar["slab"] == slab
        assert slabs["largest_pressure"][row] == mortar["largest_pressure"][held].max()
        assert slabs["smallest_pressure"][row] == mortar["smallest_pressure"][held].min()


def test_a_rail_gauge_under_a_wheel_is_the_rails_deflection_there(result):
    """The right wheel of the second wheelset.

    The contact's solution stops at 1e-6 of the wheel's static load, 0.07 N, on 1e9 N/m: 7e-11 m of 6e-4.
    """
    gauge, wheel = result.gauges()["rail"], result.wheel()
    assert wheel["wheelset_offset"][1] == pytest.approx(7.5, abs=2.0)
    place = GAUGES[0]["chainage"]
    passing = np.argmin(np.abs(wheel["position"] + wheel["wheelset_offset"][1] - place))
    here = np.flatnonzero(gauge["time"] == wheel["time"][passing])[0]
    np.testing.assert_allclose(gauge["displacement"][here, 1], wheel["rail_deflection"][passing, 1, 1], atol=1e-10)


def test_gauges_of_a_snapshot(result):
    """Rail and slab under it, at the time and place of one point of the snapshots."""
    bent, gauges = result.deflection(), result.gauges()
    place = GAUGES[1]["chainage"]
    time, point = np.unravel_index(
        np.argmin(np.abs(bent["position"][:, None] + bent["offset"] - place)), (len(bent["time"]), len(bent["offset"]))
    )
    assert bent["position"][time] + bent["offset"][point] == pytest.approx(place, abs=1e-9)
    for name, channel in (("bent", "rail"), ("under", "slab")):
        here = np.flatnonzero(gauges[name]["time"] == bent["time"][time])[0]
        assert gauges[name]["displacement"][here, 1] == pytest.approx(bent[channel][time, 0, point], rel=1e-9)


def test_snapshots_show_joints_and_fixed_ends(result):
    """Every 10 ms; points of about 0.25 m over the window; the slab is not a number over joints and nowhere else."""
    bent = result.deflection()
    np.testing.assert_allclose(bent["time"], 0.01 * np.arange(1, len(bent["time"]) + 1), rtol=1e-12)
    assert len(bent["time"]) == STEPS * DT // 0.01
    np.testing.assert_allclose(np.diff(bent["offset"]), 0.25, atol=0.01)
    assert bent["offset"][0] == pytest.approx(-14.0, abs=1.0)
    np.testing.assert_allclose(bent["rail"][..., [0, -1]], 0.0, atol=1e-15)  # pinned ends
    chainage = bent["position"][:, None] + bent["offset"]
    slab = np.floor(chainage / 5.67)
    in_joint = np.abs(chainage - (slab + 0.5) * 5.67) > 5.6 / 2.0
    np.testing.assert_array_equal(np.isnan(bent["slab"]), np.broadcast_to(in_joint[:, None], bent["slab"].shape))
    assert in_joint.any()
    under = np.nanmax(bent["slab"][0, 1])
    assert 0.01 * bent["rail"][0, 1].max() < under < bent["rail"][0, 1].max()


def test_a_gauge_out_of_reach_has_few_samples(result):
    """At 35.9 m the window's front end, 36 m in the end, comes by for the last millimetres; files stay bounded."""
    far = result.gauges()["far"]
    inside = far["position"] + 14.0 >= 35.9
    assert inside.all()
    assert 0 < len(far["time"]) <= np.ceil((0.1 + 0.02) / (V350 * DT))


def test_slab_velocities_are_rates(result):
    """Newmark's average acceleration: displacements differ by dt times the mean velocity, velocities likewise.

    To rounding, 1e-16 of the displacement of each of the few coordinates that a place has.
    """
    gauge = result.gauges()["under"]
    for kind, rate in (("displacement", "velocity"), ("velocity", "acceleration")):
        mean = 0.5 * (gauge[rate][1:] + gauge[rate][:-1])
        np.testing.assert_allclose(np.diff(gauge[kind], axis=0), DT * mean, atol=1e-12 * np.abs(gauge[kind]).max())


def test_rail_velocities_are_rates():
    """The same for a place of the rail, to second order: the window moves by V dt, which no step of its modes knows.

    On a smooth track, with two modes a metre, whose waves the steps resolve: error of the trapezoidal rule over the
    largest rate. Half the step leaves a quarter, from 3.5 to 4.5 as both runs' motions differ by dt^2, too.
    """
    errors = []
    for dt in (1e-4, 5e-5):
        changes = {"numerics__time_step": dt, "irregularity__spectrum": "none", "train__distance": 6.0}
        changes |= {"numerics__modes_per_metre": 2.0, "numerics__trial_functions": "sines"}
        with result_of(**changes, track__failed_fastenings=[], track__mortar_voids=[]) as smooth:
            gauge = smooth.gauges()["rail"]
        near = np.abs(gauge["position"] - GAUGES[0]["chainage"]) < 10.0
        for kind, rate in (("displacement", "velocity"), ("velocity", "acceleration")):
            found, truth = gauge[rate][near, 1], gauge[kind][near, 1]
            miss = np.diff(truth) / dt - 0.5 * (found[1:] + found[:-1])
            errors.append(np.abs(miss).max() / np.abs(found).max())
    ratio = np.array(errors[:2]) / errors[2:]
    assert np.all((ratio > 3.5) & (ratio < 4.5)), (errors, ratio)


# --- how it is computed and written -----------------------------------------------------------------------------------


def test_chunks_make_no_difference(result, monkeypatch):
    """The same bits in chunks of 137 steps as in one of 412."""
    monkeypatch.setattr(time_loop, "CHUNK_STEPS", 137)
    with result_of(gauges=[*GAUGES, FAR]) as other:
        for group in GROUPS:
            mine, theirs = result.group(group), other.group(group)
            for name, values in mine.items():
                np.testing.assert_array_equal(values, theirs[name], err_msg=f"{group}/{name}")


def test_explicit_mortar_without_tension():
    """The other way to compute the bed gives the same kind of file: pressures are never negative."""
    with result_of(track__mortar_no_tension=True, numerics__mortar="explicit", train__distance=2.0) as other:
        slabs = other.slabs()
        assert slabs["smallest_pressure"].min() == 0.0
        mortar = other.group("mortar")
        assert slabs["largest_pressure"].max() == mortar["largest_pressure"].max()


def test_groups_can_be_switched_off(tmp_path: Path):
    """No gauges, no envelopes, no snapshots: a sentence says what to set."""
    off = CASE | {"gauges": [], "output.envelopes": False, "output.deflection_interval": "none", "train.distance": 0.05}
    with simulate.run(load_scenario("default", off)) as bare:
        assert set(bare["trains/000"]) & {"seats", "slabs", "deflection", "gauges"} == set()
        for read, key in (
            (bare.seats, r"no 'seats'; set output.envelopes = true in the scenario"),
            (bare.slabs, r"no 'slabs'; set output.envelopes = true in the scenario"),
            (bare.deflection, r"no 'deflection'; set output.deflection_interval"),
            (bare.gauges, r"no 'gauges'; set a table \[\[gauges\]\] in the scenario"),
        ):
            with pytest.raises(InputError, match=key):
                read()
        with pytest.raises(InputError, match="no 'trains/001/seats'"):
            bare.seats(1)


def test_files_open_in_xarray(tmp_path: Path):
    """Named dimensions and coordinates."""
    path = tmp_path / "run.h5"
    simulate.run(load_scenario("default", CASE | {"train.distance": 0.3}), path).close()
    dims = {
        "seats": {"largest_vertical_force": ("seat", "side")},
        "slabs": {"largest_moment_x": ("slab",)},
        "gauges/rail": {"acceleration": ("time", "direction")},
        "gauges/seat": {"vertical_force": ("time",)},
    }
    for group, channels in dims.items():
        with xarray.open_dataset(path, group=f"trains/000/{group}", engine="h5netcdf") as data:
            for name, expected in channels.items():
                assert data[name].dims == expected
                assert {"chainage" if "time" not in expected else "position"} <= set(data[name].coords)
    with xarray.open_dataset(path, group="trains/000/seats", engine="h5netcdf") as seats:
        assert seats["factor"].sel(seat=FAILED, side="left") == 0.0
    with xarray.open_dataset(path, group="trains/000/gauges/rail", engine="h5netcdf") as gauge:
        assert (gauge.attrs["on"], gauge.attrs["side"]) == ("rail", "right")


def test_a_train_that_fails_leaves_no_seats_that_it_never_passed(tmp_path: Path):
    """Forces of a derailed train on the track mean nothing: seats in its window are left out."""
    path = tmp_path / "run.h5"
    wild = CASE | {"irregularity.scale": 100.0, "train.distance": 8.0}
    with pytest.raises(RunFailedError):
        simulate.run(load_scenario("default", wild), path)
    with results.open(path) as failed:
        assert len(failed.seats()["seat"]) == len(failed.slabs()["slab"]) == 0
        assert len(failed.gauges()["rail"]["time"]) > 0
