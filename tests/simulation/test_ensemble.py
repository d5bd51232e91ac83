"""Ensembles: who is advanced with whom, the same bits from any number of workers, and trains or workers that fail."""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from threadpoolctl import threadpool_info

from tiengine import result as results
from tiengine.cli.commands import main
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.result import Result
from tiengine.result_files.checkpoint import checkpoint_paths
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation import simulate
from tiengine.simulation.tasks import plan
from tiengine.simulation.worker import distribute, send_task

SHORT = {
    "train.distance": 3.0,
    "train.speed_kmh": 300.0,
    "numerics.truncation": "none",
    "numerics.time_step": 2e-4,
    "output.precision": "double",
    "irregularity.taper": 1.0,
}
ROUNDING = 1e-4  # N: one right-hand side is added up in another order than several (test_determinism)
WILD = 100.0  # times the German low-disturbance track: no train stays on that


def ensemble(**settings: Any) -> Scenario:
    """A short ensemble; settings are of the table ``ensemble``."""
    return load_scenario("default", SHORT | {f"ensemble.{key}": value for key, value in settings.items()})


def single(**changes: Any) -> Result:
    """One train alone; two underscores stand for a dot."""
    return simulate.run(load_scenario("default", SHORT | {k.replace("__", "."): v for k, v in changes.items()}))


def assert_same_bits(a: Result, b: Result, train: int, other: int | None = None) -> None:
    """All that a train has recorded."""
    for group in ("wheel", "body", "irregularity", "mortar", "seats", "slabs", "deflection"):
        mine, theirs = a.group(group, train), b.group(group, train if other is None else other)
        for name, values in mine.items():
            np.testing.assert_array_equal(values, theirs[name])


MIXED = {"size": 6, "vary": {"train.speed_kmh": [300.0, 320.0, 340.0]}}


@cache
def mixed() -> Result:
    """Three groups of two, all in this process."""
    return simulate.run(ensemble(**MIXED), workers=1)


# --- what an ensemble means -------------------------------------------------------------------------------------------


def test_seeds_follow_the_scenarios_own():
    members = ensemble(size=3).members
    assert [train.irregularity.seed for train in members] == [1, 2, 3]
    assert [train.ensemble.size for train in members] == [1, 1, 1]
    assert [train.irregularity.seed for train in ensemble(size=3, seeds=[7, 7, 2]).members] == [7, 7, 2]


def test_lists_are_repeated_in_turn():
    scenario = ensemble(size=4, vary={"train.speed_kmh": [300.0, 320.0], "track.friction": [0.1, 0.2, 0.3, 0.4]})
    assert [train.train.speed_kmh for train in scenario.members] == [300.0, 320.0, 300.0, 320.0]
    assert [train.track.friction for train in scenario.members] == [0.1, 0.2, 0.3, 0.4]


def test_one_train_that_varies_nothing_is_the_scenario_itself():
    scenario = load_scenario("default", SHORT)
    assert scenario.members == (scenario,)


def test_text_of_an_ensemble_loads_back_equal():
    """With the presets that only some trains use."""
    stiff = {"like": "ACE2021", "vertical_stiffness": 5e7}
    vary = {"track.fastening": ["ACE2021", stiff], "track.failed_fastenings": [[{"seats": [30, 31]}], []]}
    scenario = ensemble(size=2, vary=vary)
    again = load_scenario(tomllib.loads(to_toml(scenario)))
    assert again == scenario
    assert again.members == scenario.members
    assert again.members[1].parts.fastening.vertical_stiffness == 5e7


def test_keys_may_be_written_without_quotes():
    assert ensemble(size=2, vary={"train": {"speed_kmh": [300.0, 320.0]}}) == ensemble(
        size=2, vary={"train.speed_kmh": [300.0, 320.0]}
    )


def test_measured_files_are_found_beside_the_scenario(tmp_path):
    """Relative paths are resolved as for the key itself."""
    (tmp_path / "many.toml").write_text(
        '[train]\nvehicles = ["CRH380A_v2"]\nspeed_kmh = 100.0\ndistance = 10.0\n[ensemble]\nsize = 2\n'
        '[ensemble.vary]\n"irregularity.file" = ["a.csv", "b.csv"]\n'
    )
    members = load_scenario(tmp_path / "many.toml").members
    assert [train.irregularity.file for train in members] == [str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"size": 0}, "ensemble.size = 0: must be greater than or equal to 1"),
        ({"size": 2, "seeds": [1]}, r"ensemble.seeds = \[1\]: must be one seed per train, 2"),
        ({"size": 2, "seeds": [1, -1]}, r"ensemble.seeds\[1\] = -1: must be"),
        ({"size": 2, "vary": {"train.speed_kmh": [300.0] * 3}}, "'train.speed_kmh' has 3 values: must be as many"),
        ({"size": 2, "vary": {"train.speed_kmh": []}}, "'train.speed_kmh' has 0 values"),
        ({"size": 2, "vary": {"train.speed_kmh": 300.0}}, "'train.speed_kmh' = 300.0: must be a list"),
        ({"size": 2, "vary": {"train.sped_kmh": [1.0]}}, "train 0 of the ensemble: train.sped_kmh: unknown key"),
        ({"size": 2, "vary": {"track.friction": [0.3, -0.1]}}, "train 1 of the ensemble: track.friction = -0.1"),
        ({"size": 2, "vary": {"numerics.window": [30.0, 9.0]}}, "train 1 of the ensemble: numerics.window = 9: window"),
        ({"size": 2, "vary": {"output.precision": ["single", "double"]}}, "'output.precision' cannot vary"),
        ({"size": 2, "vary": {"ensemble.size": [1, 2]}}, "'ensemble.size' cannot vary"),
        ({"size": 2, "vary": {"numerics.threads": [1, 2]}}, "'numerics.threads' cannot vary"),
        ({"size": 2, "seeds": [1, 2], "vary": {"irregularity.seed": [1, 2]}}, "'irregularity.seed' cannot vary if"),
        (
            {"size": 2, "seeds": [1, 2], "vary": {"irregularity.spectrum": ["none"]}},
            "ensemble.seeds: must be left out where no train",
        ),
    ],
)
def test_bad_input_names_the_train_and_the_key(settings, message):
    """Before anything runs."""
    with pytest.raises(InputError, match=message):
        ensemble(**settings)


# --- who is advanced with whom ----------------------------------------------------------------------------------------


def test_trains_that_share_matrices_form_a_group():
    """Realisation and size of the irregularity do not matter; speed, and waves that the step depends on, do."""
    assert [t.trains for t in plan(ensemble(size=4, vary={"irregularity.scale": [1.0, 2.0]}))] == [(0, 1, 2, 3)]
    assert [t.trains for t in plan(ensemble(size=4, vary={"train.speed_kmh": [300.0, 320.0]}))] == [(0, 2), (1, 3)]
    waves = ensemble(size=2, vary={"irregularity.wavelength_min": [1.0, 2.0]})
    assert [t.trains for t in plan(waves)] == [(0,), (1,)]


def test_a_group_is_cut_into_equal_tasks():
    """Nine trains, four at most: three tasks of three; ten: three of four, the last filled up with its last train."""
    assert [t.trains for t in plan(ensemble(size=9), together=4)] == [(0, 1, 2), (3, 4, 5), (6, 7, 8)]
    tasks = plan(ensemble(size=10), together=4)
    assert [t.trains for t in tasks] == [(0, 1, 2, 3), (4, 5, 6, 7), (8, 9)]
    assert [t.size for t in tasks] == [4, 4, 4]
    assert [track.seed for track in tasks[2].tracks] == [9, 10, 10, 10]


def test_bits_of_a_train_do_not_depend_on_its_neighbours(monkeypatch):
    """Beside others, or filled up with copies of itself: a task of equal size gives the same bits."""
    monkeypatch.setattr(simulate, "plan", lambda scenario, **given: plan(scenario, together=2, **given))
    with simulate.run(ensemble(size=3), workers=1) as three, simulate.run(ensemble(size=2, seeds=[3, 8])) as two:
        assert_same_bits(three, two, 2, 0)
        assert three.trains == 3


# --- runs -------------------------------------------------------------------------------------------------------------


def test_each_train_is_the_single_run_of_its_own_scenario():
    """Train 3 has speed 300 km/h and seed 4; train 4 is another one."""
    many = mixed()
    with single(irregularity__seed=4) as one:
        for channel in ("vertical_force", "lateral_force"):
            np.testing.assert_allclose(many.wheel(3)[channel], one.wheel()[channel], atol=ROUNDING)
        assert np.abs(many.wheel(0)["vertical_force"] - one.wheel()["vertical_force"]).max() > 1e3 * ROUNDING
        np.testing.assert_array_equal(many.wheel(3)["position"], one.wheel()["position"])
        assert many.scenario_of(3) == one.scenario


def test_file_of_an_ensemble():
    """Facts of all trains are at the root, those of one train at its group."""
    many = mixed()
    root, facts = many.attributes, [many.facts(train) for train in range(6)]
    assert (root["status"], root["trains"], many.failures) == ("complete", 6, {})
    assert [known["seed"] for known in facts] == [1, 2, 3, 4, 5, 6]
    assert "seed" not in root
    assert root["time_step"] == 2e-4
    assert root["simulated_time"] == pytest.approx(sum(known["simulated_time"] for known in facts))
    assert root["real_time_factor"] == pytest.approx(root["wall_time_loop"] / root["simulated_time"])
    assert len(many.wheel(2)["time"]) == facts[2]["steps"] < facts[0]["steps"]  # 340 km/h, 300 km/h


def test_defects_of_one_train():
    """A missing row of fastenings under the first wheels affects only the train that has it."""
    failed = [[], [{"seats": [36, 40]}]]  # chainage 23 to 25.5 m, where the leading wheelset starts at 24 m
    scenario = ensemble(size=2, seeds=[5, 5], vary={"track.failed_fastenings": failed})
    with simulate.run(scenario, workers=1) as both:
        sound, broken = (both.wheel(train)["rail_deflection"].max() for train in (0, 1))
        assert broken > 1.1 * sound
        with single(irregularity__seed=5) as one:
            assert_same_bits(both, one, 0)


def test_parallel_loop_over_trains_agrees():
    """Other machine code, whose sums are associated otherwise (test_determinism)."""
    sines = {"numerics.trial_functions": "sines"}
    two = load_scenario("default", SHORT | sines | {"ensemble.size": 2})
    with (
        simulate.run(two, workers=1) as serial,
        simulate.run(load_scenario(two, {"numerics.threads": 2}), workers=1) as parallel,
    ):
        a, b = serial.wheel(1)["vertical_force"], parallel.wheel(1)["vertical_force"]
        np.testing.assert_allclose(a, b, atol=ROUNDING)


def test_progress_counts_all_trains():
    """Simulated and whole time rise and fall together at the end."""
    seen: list[tuple[float, float]] = []
    with simulate.run(ensemble(size=2), progress=lambda *times: seen.append(times), workers=1) as result:
        assert seen[-1][0] == pytest.approx(result.attributes["simulated_time"])
    assert seen[-1][0] == pytest.approx(seen[-1][1], rel=1e-2)  # one step more or less of 180


# --- failures ---------------------------------------------------------------------------------------------------------

DERAILS = {"size": 3, "seeds": [1, 2, 3], "vary": {"irregularity.scale": [1.0, WILD, 1.0]}}


def test_a_train_that_fails_leaves_the_others_alone():
    """To the last bit; it is marked, and what it recorded is there."""
    with simulate.run(ensemble(**DERAILS), workers=1) as wild, simulate.run(ensemble(size=3), workers=1) as tame:
        for train in (0, 2):
            assert_same_bits(wild, tame, train)
            assert wild.status(train) == "complete"
        assert list(wild.failures) == [1]
        assert "wheelset" in wild.failures[1]
        assert wild.attributes["status"] == "1 of 3 trains failed"
        assert len(wild.wheel(1)["time"]) > 0


def test_command_ends_with_a_line_for_each_train_that_failed(tmp_path, monkeypatch):
    """Exit status 1, and a file with the others."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wild.toml").write_text(to_toml(ensemble(**DERAILS)))
    done = CliRunner().invoke(main, ["run", "wild.toml", "-o", "wild.h5", "--workers", "1"])
    assert done.exit_code == 1
    assert re.search(r"^train 1 failed: wheelset .*\n\Z", done.stderr, flags=re.MULTILINE)
    assert re.search(r"^trains +3$", done.stdout, flags=re.MULTILINE)
    with results.open(tmp_path / "wild.h5") as result:
        assert list(result.failures) == [1]


def test_all_trains_fail():
    """One line of each."""
    with pytest.raises(RunFailedError, match=r"train 0: .*; train 1: "):
        simulate.run(ensemble(size=2, vary={"irregularity.scale": [WILD]}))


def test_trains_that_cannot_be_set_up():
    """An unstable time step is found at set-up: a reason to refuse one train, and all if it is all of them."""
    coarse = {"numerics.time_step": [2e-4, 1e-3], "numerics.passes": [2, 1], "irregularity.wavelength_min": [2.0]}
    with simulate.run(ensemble(size=2, vary=coarse), workers=1) as result:
        assert list(result.failures) == [1]
        assert "unstable" in result.failures[1]
    with pytest.raises(InputError, match="unstable"):
        simulate.run(ensemble(size=2, vary={key: values[-1:] for key, values in coarse.items()}), workers=1)


def test_same_bits_from_three_workers():
    """Tasks end in any order; three workers for three groups."""
    with simulate.run(ensemble(**MIXED), workers=3) as apart:
        assert apart.attributes["workers"] == 3
        for train in range(6):
            assert_same_bits(apart, mixed(), train)
    assert multiprocessing.active_children() == []


def report_threads(task: Any, saved: Any, stop: Any, send: Any) -> None:
    """Send the threads of every BLAS library with which a worker's trains are computed."""
    from tiengine.simulation import stream

    def threads(*_: Any, **__: Any) -> Any:
        yield {pool["filepath"]: pool["num_threads"] for pool in threadpool_info()}

    stream.run_task = threads  # the import above has loaded what the engine needs
    send_task(task, saved, stop, send, public=False, every=1.0)


def test_every_library_of_a_worker_computes_on_one_thread(monkeypatch: pytest.MonkeyPatch):
    """SciPy's BLAS is loaded with the engine, after the worker has begun; two threads round in another way than one."""
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    (found,) = distribute(plan(ensemble(size=1)), 1, {}, run=report_threads)
    assert len(found) >= 2  # NumPy's and SciPy's
    assert set(found.values()) == {1}


def test_the_trains_of_a_killed_worker_are_begun_again():
    """Two workers, one of them killed at the first sign of life; another takes its place. No train is lost."""
    killed: list[int] = []

    def kill(*_: float) -> None:
        if not killed:
            killed.append(int(multiprocessing.active_children()[0].pid or 0))
            os.kill(killed[0], signal.SIGKILL)

    notes: list[str] = []
    with simulate.run(ensemble(**MIXED), workers=2, progress=kill, notify=notes.append) as result:
        assert not result.failures
        for train in range(6):
            assert_same_bits(result, mixed(), train)
    # no note if the killed one had sent everything
    assert notes in ([], ["a worker died (killed by SIGKILL); its 2 trains are started again"])
    assert multiprocessing.active_children() == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
def test_interrupted_ensemble_can_be_resumed(number, tmp_path: Path):
    """Its trains are saved at the end of their first chunk; no process is left in the session of the command."""
    command = [str(Path(sys.executable).with_name("tiengine")), "run", "default", "--workers", "2", "--quiet"]
    command += ["--set", "ensemble.size=2", "--set", "ensemble.vary={train.speed_kmh=[300,350]}", "--checkpoint", "0.1"]
    with subprocess.Popen(command, cwd=tmp_path, start_new_session=True, stderr=subprocess.PIPE) as process:
        deadline = time.monotonic() + 120.0
        while len(checkpoint_paths(tmp_path / "default.h5")) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)  # workers are on their way
        os.kill(process.pid, number)
        process.wait(timeout=60.0)
    assert process.returncode == 128 + number
    with results.open(tmp_path / "default.h5") as result:
        assert not result.finished
    assert len(checkpoint_paths(tmp_path / "default.h5")) == 2
    deadline = time.monotonic() + 10.0  # multiprocessing's resource tracker leaves a moment after its parent
    while (left := _running(process.pid)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert left == []


def _running(session: int) -> list[str]:
    """Processes of a session, those that wait to be reaped apart."""
    rows = subprocess.run(["ps", "-e", "-o", "sid=,stat=,args="], capture_output=True, text=True, check=True).stdout
    fields = [row.split(maxsplit=2) for row in rows.splitlines()]
    return [args for sid, stat, args in fields if int(sid) == session and not stat.startswith("Z")]
