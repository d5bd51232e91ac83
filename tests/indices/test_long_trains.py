"""Trains of several vehicles: run-in of each vehicle, extremes of all wheels, the worst vehicle, tables by vehicle."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from tiengine.cli.commands import main
from tiengine.indices.by_car import by_car
from tiengine.indices.key_figures import key_figures
from tiengine.indices.recorded_ride import RecordedRide
from tiengine.indices.train_record import SHORTEST_SLICE, SLICE, Train
from tiengine.indices.wheel_extremes import first_samples, wheel_extremes

from .. import hand_made as by
from .. import long_trains as long

RUN_IN = 10.0
CARS = 3
SAMPLES = 900  # 87.5 m: 77.5, 52.5 and 27.5 m after the run-in of each car


def at_distance(distance: float) -> int:
    """Sample at a distance of the train [m]."""
    return int(np.ceil(distance / by.V / 1e-3))


def test_every_vehicle_leaves_its_run_in_at_the_same_chainage(tmp_path):
    """10, 35 and 60 m of the train's way: chainage 34 m of each leading wheelset."""
    groups = {"wheel": long.wheel(CARS, SAMPLES)}
    with by.made(tmp_path / "a.h5", long.train_of(CARS, output__run_in=RUN_IN), groups) as result:
        train = Train(result)
        samples = train.samples("wheel", "vertical_force")
        begin = first_samples(train, samples)
        position = samples.group["position"][:][begin]
    np.testing.assert_array_equal(begin, np.repeat([at_distance(RUN_IN + long.PITCH * k) for k in range(CARS)], 4))
    leading = position[::4] + long.offsets(CARS)[::4]
    np.testing.assert_allclose(leading, by.START + by.OFFSET[0] + RUN_IN, atol=by.V * 1e-3)  # within a sample


def test_extremes_leave_the_run_in_of_each_vehicle_out(tmp_path):
    """Wheelset 9 (third car) has 200 kN before its run-in ends and 120 kN after it; wheelset 1 has 110 kN."""
    forces = long.wheel(CARS, SAMPLES)
    Q, Y = forces["vertical_force"], forces["lateral_force"]
    early, late = at_distance(40.0), at_distance(70.0)
    Q[early, 8, 1], Q[late, 8, 1], Q[early, 0, 0] = 200e3, 120e3, 110e3
    Y[early, 8, 0], Y[late, 5, 0], Q[late : late + 20, 6, 1] = 50e3, -20e3, 0.0
    with by.made(tmp_path / "a.h5", long.train_of(CARS, output__run_in=RUN_IN), {"wheel": forces}) as result:
        found = wheel_extremes(Train(result))
        figures = {figure.name: figure for figure in key_figures(Train(result))}
    assert found.largest.value[8, 1] == 120e3
    assert found.largest.value[0, 0] == 110e3
    assert found.lateral.value[8, 0] == 0.0
    largest = figures["largest vertical wheel force Q"]
    chainage = by.START + by.V * 1e-3 * late + long.offsets(CARS)[8]
    assert (largest.value, largest.where) == (120.0, f"wheelset 9 right, vehicle 3, chainage {chainage:.1f} m")
    assert figures["largest lateral wheel force |Y|"].where.startswith("wheelset 6 left, vehicle 2")
    off = figures["longest time of a wheel off the rail"]
    assert (off.value, off.where) == (pytest.approx(20.0), "wheelset 7 right, vehicle 2")


def test_a_run_that_ends_in_the_run_in_counts_as_a_whole(tmp_path):
    """9 m of 10 m: all wheelsets count from the start; 40 m: only those of the first two cars."""
    for samples, counted in ((at_distance(9.0), 12), (at_distance(40.0), 8)):
        groups = {"wheel": long.wheel(CARS, samples)}
        with by.made(tmp_path / f"{samples}.h5", long.train_of(CARS, output__run_in=RUN_IN), groups) as result:
            value = wheel_extremes(Train(result)).largest.value
        assert np.isfinite(value).all(axis=1).sum() == counted


def test_extremes_by_slices(tmp_path, monkeypatch):
    """Slices of 7 samples find what one slice finds."""
    rng = np.random.default_rng(1)
    forces = long.wheel(CARS, SAMPLES)
    for name in ("vertical_force", "lateral_force"):
        forces[name] = rng.standard_normal(forces[name].shape)
    with by.made(tmp_path / "a.h5", long.train_of(CARS, output__run_in=RUN_IN), {"wheel": forces}) as result:
        whole = wheel_extremes(Train(result))
        monkeypatch.setattr("tiengine.indices.train_record.SHORTEST_SLICE", 7)
        monkeypatch.setattr("tiengine.indices.train_record.SLICE", 21)
        pieces = wheel_extremes(Train(result))
    for name in ("largest", "smallest", "lateral"):
        np.testing.assert_array_equal(getattr(pieces, name).value, getattr(whole, name).value)
        np.testing.assert_array_equal(getattr(pieces, name).chainage, getattr(whole, name).chainage)
    np.testing.assert_array_equal(pieces.time_off, whole.time_off)


@pytest.mark.parametrize(("cars", "length"), [(1, SLICE), (2, SLICE // 2), (16, SHORTEST_SLICE)])
def test_slices_of_long_trains_are_shorter(tmp_path, cars, length):
    """Memory of a slice: that of one coach, until the filters' margins would dominate."""
    with by.made(tmp_path / "a.h5", long.train_of(cars), {"wheel": long.wheel(cars, 5)}) as result:
        assert Train(result).samples("wheel", "vertical_force").slice_length == length


def swaying(samples: int, since: float) -> dict[str, dict]:
    """The third car heaves by 1 m/s^2 at 2 Hz, ten times as much before a distance of the train [m]."""
    moving = long.body(CARS, samples)
    time = 1e-3 * np.arange(samples)
    heave = np.sin(4.0 * np.pi * time) * np.where(by.V * time < since, 10.0, 1.0)
    moving["acceleration"][:, 14, 1] = heave
    return {"wheel": long.wheel(CARS, samples), "body": moving}


def test_indices_begin_with_each_vehicle(tmp_path):
    """The third car heaves strongly up to the end of its run-in at 60 m: its vertical acceleration stays near 1."""
    groups = swaying(8000, since=40.0)  # the filter's response to the step decays over the last 20 m and the settling
    with by.made(tmp_path / "a.h5", long.train_of(CARS, output__run_in=300.0), groups) as result:
        metrics = result.metrics()
        ride = RecordedRide(result)
    whole = float(ride.body_times.position[-1] - ride.body_times.position[0])
    assert [ride.distance(v) for v in range(CARS)] == pytest.approx(
        [whole - 300.0 - long.PITCH * v for v in range(CARS)]
    )
    assert len(ride.acceleration_times(2).position) == 8000
    spread = {(each.worst.standard, each.worst.name): each for each in metrics.spread(by_vehicle=False)}
    vertical = spread["EN 14363:2016", "vertical acceleration"].worst
    assert vertical.vehicle == 3
    assert vertical.value == pytest.approx(1.0, rel=0.02)  # band pass at 2 Hz: 1/(1 + 0.2^4)^2
    columns = {column.heading: column for column in by_car(CARS, metrics.spread())}
    assert [cell.is_worst for cell in columns["vertical acceleration"].cells] == [False, False, True]
    assert columns["vertical acceleration"].cells[2].value == vertical.value


def test_vehicles_that_the_run_is_too_short_for_are_left_out(tmp_path):
    """40 m, 10 m of run-in: the first car covers 30 m, the second 5, the third none."""
    groups = swaying(at_distance(40.0), since=0.0)
    with by.made(tmp_path / "a.h5", long.train_of(CARS, output__run_in=RUN_IN), groups) as result:
        metrics = result.metrics()
    (train,) = metrics.trains
    assert train.left_out == (2, 3)
    assert {index.vehicle for index in train.indices} == {1}
    assert metrics.vehicles == CARS
    shown = CliRunner().invoke(main, ["metrics", str(tmp_path / "a.h5")])
    assert shown.exit_code == 0, shown.output
    assert "vehicles 2 to 3 are left out: the run ends before 10 m beyond" in " ".join(shown.output.split())


def test_the_worst_vehicle_stands_for_the_train(tmp_path):
    """Wheelset 7 (second car) pushes with 20 kN throughout: sum of Y; the table lists every index once."""
    groups = swaying(SAMPLES, since=0.0)
    groups["wheel"]["lateral_force"][:, 6, 0] = 20e3
    with by.made(tmp_path / "a.h5", long.train_of(CARS, output__run_in=RUN_IN), groups) as result:
        metrics = result.metrics()
        extremes = [wheel_extremes(Train(result))]
    spread = metrics.spread(by_vehicle=False)
    assert (
        len({(each.worst.standard, each.worst.name) for each in spread}) == len(spread) == len(metrics.spread()) / CARS
    )
    axle = next(each for each in spread if each.worst.name.startswith("sum of Y"))
    assert (axle.worst.vehicle, axle.worst.place) == (2, "wheelset 7")
    assert axle.worst.value == pytest.approx(20.0, rel=1e-3)
    columns = {column.heading: column for column in by_car(CARS, metrics.spread(), extremes)}
    lateral = columns["largest |Y|"].cells
    assert [cell.value for cell in lateral] == [0.0, 20.0, 0.0]
    assert lateral[1].place == "wheelset 7 left"
    assert [cell.is_worst for cell in columns["ΣY"].cells] == [False, True, False]
    shown = CliRunner().invoke(main, ["metrics", str(tmp_path / "a.h5")]).output
    assert "wheelset 7, vehicle 2" in " ".join(shown.split())
    assert "20 (7)" in shown


def test_an_ensemble_of_trains_of_different_length(tmp_path):
    """A train of three cars and one of two, whose second car has the largest force."""
    extremes = []
    for cars, force in ((3, 100e3), (2, 110e3)):
        forces = long.wheel(cars, SAMPLES)
        forces["vertical_force"][500, 5, 0] = force
        with by.made(tmp_path / f"{cars}.h5", long.train_of(cars), {"wheel": forces}) as result:
            extremes.append(wheel_extremes(Train(result)))
    (largest, *_) = by_car(3, [], extremes)
    assert [cell.value for cell in largest.cells] == [70.0, 110.0, 70.0]
