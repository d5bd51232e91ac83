"""Indices of whole files: made-up runs whose indices follow by hand, and files that must be refused."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tiengine import result as results
from tiengine.cli.commands import main
from tiengine.cli.screen import show
from tiengine.indices.metrics import evaluate
from tiengine.indices.recorded_ride import RecordedRide
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml
from tiengine.report.metrics_table import metrics_table
from tiengine.result_files.channels import WHEEL
from tiengine.result_files.layout import GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.vehicle.train import assemble, static_wheel_loads

from ..vehicle.test_running_gear import DATA, articulated

SPEED = 97.0  # m/s, as written
BODIES = ("car", "frame 1", "frame 2", "wheelset 1", "wheelset 2", "wheelset 3", "wheelset 4")
HALF_BOGIE_CENTRES = 8.75  # m, of CRH380A_v2
Y, Z, ROLL, PITCH, YAW = range(5)


@cache
def scenario(trains: int = 1) -> Scenario:
    return load_scenario("paper", {"ensemble.size": trains})


@cache
def static_loads() -> np.ndarray:
    """Static load of each wheel [N]."""
    parts = scenario().parts
    return static_wheel_loads(assemble(parts.vehicles, parts.centres))


def write(path: Path | None = None, *, duration: float = 12.0, interval: float = 1e-3, trains: int = 1, **change):
    """A run in which every wheel carries its static load and pushes outward with a tenth of it, the car at rest.

    ``change`` holds functions of time [s] and train: ``Y`` and ``Q`` (n, 4, 2) added to the forces [N], ``car`` (n, 5),
    the acceleration; ``status`` of the last train; ``body`` false for a file without bodies.
    """
    labels = TrainLabels(["coach"], BODIES, np.zeros(4, np.int64), np.array([10.0, 7.5, -7.5, -10.0]))
    groups = {"wheel": GroupSpec.standard("wheel", tuple(WHEEL))}
    if change.get("body", True):
        groups["body"] = GroupSpec.standard("body", ("acceleration",))
    time = interval * np.arange(round(duration / interval))
    ones = np.ones((len(time), 1, 1))
    with Writer(path, to_toml(scenario(trains)), {}, [labels] * trains, groups) as writer:
        for train in range(trains):
            wheel = {name: 0.0 * ones * static_loads() for name in WHEEL}
            wheel["vertical_force"] = ones * static_loads() + change.get("Q", lambda t, i: 0.0)(time, train)
            outward = 0.1 * static_loads() * np.array([-1.0, 1.0])
            wheel["lateral_force"] = ones * outward + change.get("Y", lambda t, i: 0.0)(time, train)
            writer.append(train, "wheel", time, SPEED * time, wheel)
            if "body" in groups:
                body = np.zeros((len(time), len(BODIES), 5))
                body[:, 0] = change.get("car", lambda t, i: 0.0)(time, train)
                writer.append(train, "body", time, SPEED * time, {"acceleration": body})
            last = train == trains - 1
            writer.describe(train, {"status": change.get("status", "complete") if last else "complete"})
        return results.Result.of(writer.close({"status": "complete"}))


def values(result: results.Result) -> dict[tuple[str, str], object]:
    """Indices of the first train by the standard's first word and their name."""
    with result:
        (train, *_) = result.metrics().trains
    return {(index.standard.split()[0], index.name): index for index in train.indices}


def acceleration(dof: int, amplitude: float, f: float):
    """A sine in one motion of the car."""
    return lambda t, i: amplitude * np.sin(2.0 * np.pi * f * t)[:, None] * (np.arange(5) == dof)


def test_a_constant_run():
    """Q static, Y/Q 0.1, no force of the wheelset as a whole, nothing unloaded, a car at rest; single precision."""
    got = values(write())
    static = static_loads() * 1e-3
    assert got["EN", "Y/Q, 2 m mean"].value == pytest.approx(0.1, rel=1e-6)
    assert got["EN", "wheel force Q"].value == pytest.approx(static.max(), rel=1e-6)
    assert got["EN", "wheel force Q"].limit == min(160.0, 90.0 + static.max())  # 350 km/h
    assert got["EN", "sum of Y, 2 m mean"].value == pytest.approx(0.0, abs=1e-4)
    assert got["EN", "sum of Y, 2 m mean"].limit == pytest.approx(10.0 + 2.0 * static[0].mean() / 3.0, rel=1e-12)
    assert got["GB/T", "wheel unloading"].value == pytest.approx(0.0, abs=1e-6)
    assert got["GB/T", "lateral axle force"].limit == pytest.approx(15.0 + 2.0 * static[0].mean() / 3.0, rel=1e-12)
    assert got["EN", "vertical acceleration"].value == got["EN", "mean comfort N_MV"].value == 0.0
    assert {index.verdict for index in got.values()} == {"within", "none"}
    assert {index.kind for index in got.values()} == {"index"}


def test_outward_is_positive():
    """On the left as on the right."""
    with write(duration=1.0) as result:
        np.testing.assert_allclose(RecordedRide(result).forces(1).quotient, 0.1, rtol=1e-6)


def test_vehicles_are_kept_apart():
    """The second of three coaches heaves by 0.5 m/s^2 at 1 Hz, and its third wheelset loses half its load."""
    coaches = load_scenario("train3")
    model = assemble(coaches.parts.vehicles, coaches.parts.centres)
    static, time = static_wheel_loads(model), 1e-3 * np.arange(8000)
    labels = TrainLabels(["a", "b", "c"], model.body_names, model.wheelset_vehicle, model.wheelset_x)
    names = ("lateral_force", "vertical_force")
    groups = {"wheel": GroupSpec.standard("wheel", names), "body": GroupSpec.standard("body", ("acceleration",))}
    force, body = np.ones((8000, 12, 2)) * static, np.zeros((8000, len(model.body_names), 5))
    force[:, 6, :] *= 0.5
    body[:, model.body_names.index("v2 car"), Z] = 0.5 * np.sin(2.0 * np.pi * time)
    with Writer(None, to_toml(coaches), {}, [labels], groups) as writer:
        writer.append(0, "wheel", time, SPEED * time, dict(zip(names, (0.0 * force, force), strict=True)))
        writer.append(0, "body", time, SPEED * time, {"acceleration": body})
        with results.Result.of(writer.close({"status": "complete"})) as result:
            indices = result.metrics().trains[0].indices
    sperling = [index.value for index in indices if index.name == "Sperling index W, vertical"]
    assert sperling == pytest.approx([0.0, 2.59148, 0.0], rel=1e-4)
    lost = [(index.value, index.place) for index in indices if index.name == "wheel unloading"]
    assert [value for value, _ in lost] == pytest.approx([0.0, 0.5, 0.0], abs=1e-6)
    assert lost[1][1].startswith("wheelset 7 ")


def test_the_worst_wheelset_is_named():
    """Wheelset 3's right wheel loses 0.9 of its load for good, its left pushes: 0.9 unloaded and beyond the limit."""
    at = (np.arange(4)[:, None] == 2) & np.array([False, True])
    got = values(write(Q=lambda t, i: -0.9 * at * static_loads()))
    index = got["GB/T", "wheel unloading"]
    assert (index.place, index.verdict, index.limit) == ("wheelset 3 right", "over", 0.8)
    assert index.value == pytest.approx(0.9, rel=1e-5)
    assert got["GB/T", "derailment coefficient"].value == pytest.approx(1.0, rel=1e-5)  # 0.1 over 0.1
    assert got["EN", "Y/Q, 2 m mean"].place == "wheelset 3 right"


def test_a_wheel_in_the_air_has_a_finite_quotient():
    """Q = 0, Y a tenth of the load: against 1 % of the load 10."""
    got = values(write(Q=lambda t, i: -static_loads()))
    assert got["EN", "Y/Q, 2 m mean"].value == pytest.approx(10.0, rel=1e-5)


def test_forces_are_filtered_and_averaged():
    """Both wheels sway together by 1 kN at 10 Hz: low pass, then 2 m of 9.7 m; the percentile of a sine is 1 - 5.6e-6.

    The low pass passes 1/(1 + (sqrt(2) - 1)/16), 0.02 % for its warping; means every 0.5 m see the crest within 0.5 %.
    """
    got = values(write(Y=lambda t, i: 1e3 * np.sin(20.0 * np.pi * t)[:, None, None]))
    k = 2.0 * np.pi / 9.7
    expected = 2.0 / (1.0 + (np.sqrt(2.0) - 1.0) / 16.0) * np.sin(k) / k
    assert got["EN", "sum of Y, 2 m mean"].value == pytest.approx(expected, rel=5e-3)
    assert got["GB/T", "lateral axle force"].value == pytest.approx(expected, rel=5e-3)


def test_run_in_is_left_out():
    """Ten times the load in the first 40 m; what the filter carries over 10 m is 9 exp(-11) of it: 20 Hz."""
    got = values(write(Q=lambda t, i: 9.0 * static_loads() * (SPEED * t < 40.0)[:, None, None]))
    assert got["EN", "wheel force Q"].value == pytest.approx(1e-3 * static_loads().max(), rel=1e-3)


@pytest.mark.parametrize(
    ("dof", "direction", "arm"),
    [(Z, "vertical", 1.0), (PITCH, "vertical", HALF_BOGIE_CENTRES), (ROLL, "vertical", 1.0), (Y, "lateral", 1.0),
     (YAW, "lateral", HALF_BOGIE_CENTRES)],
)  # fmt: skip
def test_floor_points_move_with_the_car(dof, direction, arm):
    """A sine of 0.5 m/s^2 at 1 Hz over the bogie has Sperling indices 2.59148 and 2.83575."""
    got = values(write(car=acceleration(dof, 0.5 / arm, 1.0)))
    expected = {"vertical": 2.59148, "lateral": 2.83575}[direction]
    assert got["GB/T", f"Sperling index W, {direction}"].value == pytest.approx(expected, rel=1e-4)
    assert got["GB/T", f"{direction} acceleration"].value == pytest.approx(0.5 * 0.9748, rel=2e-3)


def test_signs_of_roll_pitch_and_yaw():
    """z - X pitch + Y roll and y + X yaw - Z roll at the front left point: X = 8.75, Y = -1, Z = height - 1.25."""
    motion = np.array([1.0, 2.0, 0.1, 0.2, 0.3])
    with write(car=lambda t, i: motion, duration=3.0) as result:
        points = {point.name: point for point in RecordedRide(result).floor(0)}
    height = next(b.height for b in scenario().parts.vehicles[0].body if b.name == "car")
    front = points["floor over front bogie left"]
    assert front.acceleration["vertical"][0] == pytest.approx(2.0 - 8.75 * 0.2 - 0.1, rel=1e-6)
    assert front.acceleration["lateral"][0] == pytest.approx(1.0 + 8.75 * 0.3 - (height - 1.25) * 0.1, rel=1e-6)
    assert points["floor middle right"].acceleration["vertical"][0] == pytest.approx(2.0 + 0.1, rel=1e-6)


def test_comfort_of_a_run():
    """0.5 m/s^2 at 8 Hz: 6 * 1.0559 * 0.5/sqrt(2), and 1.036 * 0.5/sqrt(2) by the tables' digits."""
    got = values(write(car=acceleration(Z, 0.5, 8.0)))
    comfort, rms = got["EN", "mean comfort N_MV"], got["ISO", "weighted rms, total"]
    assert comfort.value == pytest.approx(6.0 * 1.0559 * 0.5 / np.sqrt(2.0), rel=1e-3)
    assert (comfort.verdict, comfort.note, comfort.unit) == ("none", "comfortable", "-")
    assert rms.value == pytest.approx(1.036 * 0.5 / np.sqrt(2.0), rel=1e-3)


def test_a_short_run_has_no_long_indices():
    """2 s: 144 m behind the run-in are enough for the wheels, not for 5 s blocks nor for 0.4 Hz."""
    got = values(write(duration=2.0))
    assert got["EN", "Y/Q, 2 m mean"].value == pytest.approx(0.1, rel=1e-6)
    for key in (("GB/T", "Sperling index W, lateral"), ("EN", "mean comfort N_MV"), ("EN", "lateral acceleration")):
        assert got[key].value is None
        assert got[key].verdict == "none"
        assert "run shorter than" in got[key].note


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"body": False}, "no body/acceleration; the indices need it: name it in output.body_channels"),
        ({"duration": 0.55}, "m are too short: output.run_in = 50 must leave 10 m"),
        ({"interval": 6e-3}, "output.wheel_interval = 0.006: too coarse for the filters, must be at most 0.005 s"),
        ({"status": "derailed"}, "no train completed its run: derailed"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(change, message):
    with write(**change) as result, pytest.raises(InputError, match=message.replace(".", r"\.")):
        evaluate(result)


def test_trains_are_summarised(capsys):
    """Three trains swaying by 1, 2, 3 kN: the last is worst, the middle one the median; a fourth failed."""
    sway = {"Y": lambda t, i: 1e3 * (i + 1) * np.ones((len(t), 4, 2)), "trains": 4, "status": "derailed"}
    with write(**sway) as result:
        found = evaluate(result)
        assert [train.train for train in evaluate(result, 1).trains] == [1]
        with pytest.raises(InputError, match="train = 7: must be from 0 to 3"):
            evaluate(result, 7)
        with pytest.raises(InputError, match="derailed"):
            evaluate(result, 3)
    spread = next(each for each in found.spread() if each.worst.name == "lateral axle force")
    assert (spread.train, spread.over, spread.trains) == (2, 0, 3)
    assert (spread.median, spread.worst.value) == pytest.approx((4.0, 6.0), rel=1e-5)
    show(metrics_table(found))
    printed = capsys.readouterr().out
    assert "train 3 is left out: derailed" in printed
    assert "median" in printed


def test_command(tmp_path):
    """Table on screen, JSON in a file; a missing train ends with one line."""
    write(tmp_path / "run.h5").close()
    file, out = str(tmp_path / "run.h5"), tmp_path / "run.json"
    done = CliRunner().invoke(main, ["metrics", file, "--json", str(out)])
    assert done.exit_code == 0, done.output
    for text in ("EN 14363:2016", "within", "7.5.2 running safety", "indices, not an assessment: the run covers only"):
        assert text in done.stdout
    tables = json.loads(out.read_text(encoding="utf-8"))
    first = tables["trains"][0]["indices"][0]
    assert (tables["format"], first["verdict"], first["kind"], first["limit"]) == (
        "tiengine-metrics",
        "within",
        "index",
        0.8,
    )
    refused = CliRunner().invoke(main, ["metrics", file, "--train", "5"])
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "train = 5: must be from 0 to 0" in refused.stderr


def ride_of(vehicle: dict, path: Path, motion: dict[str, np.ndarray], speed_kmh: float = 80.0) -> results.Result:
    """A run of one vehicle, its wheels at rest; the bodies named move, shape (n, 5) each."""
    settings = {"train.vehicles": ("made",), "train.speed_kmh": speed_kmh, "output.run_in": 0.0}
    of = load_scenario("default", {**settings, "presets.vehicles.made": vehicle})
    model = assemble(of.parts.vehicles, of.parts.centres)
    count = len(next(iter(motion.values())))
    time, loads = 2e-3 * np.arange(count), static_wheel_loads(model)
    labels = TrainLabels(["made"], model.body_names, model.wheelset_vehicle, model.wheelset_x)
    names = ("lateral_force", "vertical_force")
    groups = {"wheel": GroupSpec.standard("wheel", names), "body": GroupSpec.standard("body", ("acceleration",))}
    force, body = np.ones((count, len(loads), 2)) * loads, np.zeros((count, len(model.body_names), 5))
    for name, series in motion.items():
        body[:, model.body_names.index(name)] = series
    with Writer(path, to_toml(of), {}, [labels], groups) as writer:
        writer.append(0, "wheel", time, speed_kmh / 3.6 * time, dict(zip(names, (0.0 * force, force), strict=True)))
        writer.append(0, "body", time, speed_kmh / 3.6 * time, {"acceleration": body})
        return results.Result.of(writer.close({"status": "complete"}))


def heave(amplitude: float, f: float = 1.0, duration: float = 10.0) -> np.ndarray:
    """A sine in z, shape (n, 5)."""
    time = 2e-3 * np.arange(round(duration / 2e-3))
    return amplitude * np.sin(2.0 * np.pi * f * time)[:, None] * (np.arange(5) == Z)


def table(name: str, **change: object) -> dict:
    return {**load_toml(DATA / f"{name}.toml"), **change}


def test_every_car_has_its_own_floor(tmp_path):
    """Only the rear car of two heaves, by 0.5 m/s^2 at 1 Hz, and pitches: 2.59 on it, nothing from 22 m ahead."""
    rear = heave(0.5)
    with ride_of(articulated().model_dump(exclude_none=True), tmp_path / "a.h5", {"rear car": rear}) as result:
        points = {point.name: point for point in RecordedRide(result).floor(0)}
    assert len(points) == 2 * 3 * 2  # cars, stations, sides
    for name, point in points.items():
        largest = np.abs(point.acceleration["vertical"]).max()
        assert largest == pytest.approx(0.5 if "rear car" in name else 0.0, rel=1e-3), name
    with ride_of(articulated().model_dump(exclude_none=True), tmp_path / "b.h5", {"rear car": rear}) as result:
        index = next(i for i in result.metrics().trains[0].indices if i.name == "Sperling index W, vertical")
    assert index.value == pytest.approx(2.59148, rel=1e-4)
    assert "of rear car" in index.place


@pytest.mark.parametrize(
    ("vehicle_class", "limits"),
    [
        ("coach", {"sum": 1.0, "Sperling": 3.0, "acceleration": 2.5, "comfort": True, "derailment": 0.8}),
        ("locomotive", {"sum": 1.0, "Sperling": 3.45, "acceleration": None, "comfort": False, "derailment": 0.8}),
        ("freight", {"sum": 0.85, "Sperling": 4.25, "acceleration": None, "comfort": False, "derailment": None}),
        (None, {"sum": None, "Sperling": None, "acceleration": None, "comfort": True, "derailment": None}),
    ],
)
def test_limits_are_those_of_the_class(tmp_path, vehicle_class, limits):
    """k1 of 0.85 for freight wagons; no limit of coaches elsewhere, and the reason is said; Y/Q and Q for all."""
    change = {} if vehicle_class is None else {"vehicle_class": vehicle_class}
    with ride_of(table("locomotive", **change), tmp_path / "a.h5", {"car": heave(0.5)}) as result:
        got = values(result)
    loads = got["EN", "wheel force Q"]
    assert loads.limit is not None
    assert got["EN", "Y/Q, 2 m mean"].limit == 0.8
    assert got["GB/T", "Sperling index W, vertical"].limit == limits["Sperling"]
    assert got["EN", "vertical acceleration"].limit == got["GB/T", "vertical acceleration"].limit
    assert got["EN", "vertical acceleration"].limit == limits["acceleration"]
    assert got["GB/T", "derailment coefficient"].limit == limits["derailment"]
    assert (("EN", "mean comfort N_MV") in got) == limits["comfort"]
    axle = got["EN", "sum of Y, 2 m mean"].limit
    static = 9.81 * (68e3 + 2 * 13e3 + 6 * 3600.0) / 6.0 * 1e-3  # kN a wheelset
    assert axle == (None if limits["sum"] is None else pytest.approx(limits["sum"] * (10.0 + static / 3.0), rel=2e-2))
    if vehicle_class != "coach":
        note = got["EN", "vertical acceleration"].note
        assert ("not stated" if vehicle_class is None else f"class {vehicle_class}") in note


def test_the_class_can_be_given_at_the_evaluation(tmp_path):
    """A file whose vehicle states none, with --class."""
    ride_of(table("three_piece_wagon"), tmp_path / "a.h5", {"car": heave(0.5)}).close()
    with results.open(tmp_path / "a.h5") as result:
        index = next(i for i in result.metrics(vehicle_class="freight").trains[0].indices if "Sperling" in i.name)
    assert index.limit == 4.25
    done = CliRunner().invoke(main, ["metrics", str(tmp_path / "a.h5"), "--class", "freight"])
    assert done.exit_code == 0, done.output
    assert "4.25" in done.stdout


@pytest.mark.parametrize("cut", [7.0, 7.13, 7.31, 8.0])
def test_cutting_a_run_does_not_move_its_indices(tmp_path, cut):
    """A sine of 0.5 m/s^2 at 2 Hz, cut anywhere: its amplitude within 1 %, in both standards."""
    with ride_of(table("locomotive"), tmp_path / "a.h5", {"car": heave(0.5, 2.0, cut)}) as result:
        got = values(result)
    for standard in ("EN", "GB/T"):
        assert got[standard, "vertical acceleration"].value == pytest.approx(0.5, rel=0.01)
