"""Faults that a run survives: a sample of ``python -m validation.faults``, and its findings one by one."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tiengine import result as results
from tiengine.cli import simulating as cli_run
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.result_files import journal
from tiengine.result_files.checkpoint import Checkpoint, checkpoint_path, checkpoint_paths
from tiengine.result_files.events import Event
from tiengine.result_files.file_lock import acquire_lock, release_lock
from tiengine.result_files.journal import atomic_write, journal_of
from tiengine.result_files.layout import Block, GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import collector as collecting
from tiengine.simulation import simulate, worker
from tiengine.simulation.collector import Collector
from tiengine.simulation.disk_space import check_space, estimated_bytes
from validation.faults.contents import contents, litter
from validation.faults.page import page, rows
from validation.faults.plan import RUNS, kills

ROOT = Path(__file__).parents[2]
SHORT = {"train.distance": 5.0, "irregularity.taper": 1.0}
GROUPS = {"wheel": GroupSpec.standard("wheel", ("normal_force",))}
LABELS = TrainLabels(["coach"], ["car"], np.zeros(2, np.int64), np.array([1.0, -1.0]))


def elsewhere(code: str) -> dict:
    """JSON that a process of its own prints last: copies of this one would inherit Taichi's threads half alive."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "ENABLE_TAICHI_HEADER_PRINT": "False"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def write(writer: Writer, first: int, count: int = 600) -> None:
    time = np.arange(first, first + count, dtype=float)
    writer.write(0, {"wheel": Block(time, time, {"normal_force": np.tile(time[:, None, None], (1, 2, 2))})})


def begun(path: Path, **options) -> Writer:
    writer = Writer(path, 'name = "small"\n', {}, [], GROUPS, **options)
    writer.add(0, LABELS, {"status": "running"})
    return writer


def left_unfinished(path: Path, **options) -> None:
    """A run that was ended after a commit and a checkpoint."""
    with begun(path, **options) as writer:
        write(writer, 0)
        writer.commit()
        Checkpoint(0, {"rows": writer.rows(0)}, {}).write(path)
        write(writer, 600)


# --- a sample of the suite --------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "fork"), reason="copies of a process")
def test_killed_runs_are_gone_on_with_to_the_same_bits():
    """Each stands still at an event of its writer until it is killed, so that no pace of the machine matters."""
    code = """
import json, tempfile
from pathlib import Path
from validation.faults.kills import Yard
from validation.faults.plan import RUNS, Kill
with tempfile.TemporaryDirectory() as folder:
    yard = Yard(Path(folder), RUNS["one"].shorter(40.0))
    cases = [(1, False), (2, True), (4, False)]
    done = [yard.perform(Kill("one", "run", "loop", "copy", 0.0, 0.0, again, event)) for event, again in cases]
print(json.dumps([[each.survived, each.wrong, each.resumed] for each in done]))
"""
    for survived, wrong, resumed in elsewhere(code):
        assert (survived, wrong) == (True, [])
        assert resumed >= 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="copies of a process")
def test_death_at_any_system_call_leaves_the_state_before_or_after_the_commit():
    code = """
import json
from dataclasses import asdict
from validation.faults.boundaries import boundaries
print(json.dumps(asdict(boundaries(stride=61))))
"""
    found = elsewhere(code)
    assert found["wrong"] == []
    assert found["deaths"] == found["as_before"] + found["as_after"]
    assert found["deaths"] >= 12  # some 730 calls in three sessions, most of them writes that are torn as well


def test_cases_are_a_hundred_kills_of_each_run_at_seeded_instants():
    for name in RUNS:
        chosen = kills(name)
        assert len(chosen) == 100
        assert chosen == kills(name)
        assert {kill.victim for kill in chosen} == ({"run", "worker"} if name == "batch" else {"run"})
        assert len({kill.part for kill in chosen}) == 100


def test_page_tells_what_went_wrong():
    seen = {
        "date": "now", "effort": "quick", "load_average": 0.5, "commit": "abc", "versions": {"python": "3"},
        "machine": {"cpu": "a processor", "cores": 2, "memory_bytes": 2**34},
    }  # fmt: skip
    checks = [{"words": "a", "good": True, "wrong": []}, {"words": "b", "good": False, "wrong": ["torn | apart"]}]
    known = {"disk": {"circumstances": seen, "seconds": 1.0, "checks": checks}}
    assert [good for *_, good in rows(known)] == [True, False]
    text = page(known)
    assert "1 of 2 good" in text
    assert "torn / apart" in text


# --- what a dead writer leaves ----------------------------------------------------------------------------------------


def test_a_commit_that_a_crash_interrupted_is_completed_by_the_next_reader(tmp_path, monkeypatch):
    path = tmp_path / "run.h5"
    left_unfinished(path)
    with Writer.resume(path, GROUPS) as writer:
        writer.rewind(0, {"wheel": 600})
        write(writer, 600)

        def die(*_: object) -> None:
            raise RuntimeError("dead")

        monkeypatch.setattr(journal, "_apply", die)
        with pytest.raises(InputError, match="cannot be written"):
            writer.commit()
        monkeypatch.undo()
    assert journal_of(path).exists()
    with results.open(path) as result:
        assert result.wheel()["normal_force"].shape == (1200, 2, 2)
    assert litter(path) == [f".{path.name}.0000.checkpoint"]


def test_a_file_that_only_looks_like_a_journal_is_left_alone(tmp_path):
    path = tmp_path / "run.h5"
    left_unfinished(path)
    journal_of(path).write_text("somebody's diary")
    with results.open(path) as result:
        assert not result.finished
    assert journal_of(path).read_text() == "somebody's diary"


def test_a_journal_of_another_file_never_meets_a_new_one(tmp_path):
    """The journal of a file that was removed by hand after a crash: the new file would be cut to its length."""
    path = tmp_path / "run.h5"
    left_unfinished(path)
    journal_of(path).write_bytes(journal._journal(4096, [(0, bytearray(4096))]))
    path.unlink()
    left_unfinished(path)
    before = contents(path)
    with results.open(path):
        pass
    assert contents(path) == before


@pytest.mark.parametrize("name", [".run.h5.77.part", ".run.h5.journal.77.part", "..run.h5.0003.checkpoint.77.part"])
def test_temporary_files_of_the_dead_are_removed_and_no_others(tmp_path, name):
    path = tmp_path / "run.h5"
    left_unfinished(path)
    other = tmp_path / ".other.h5.77.part"
    for each in (tmp_path / name, other):
        each.write_bytes(b"half")
    Writer.resume(path, GROUPS).leave()
    assert litter(path) == [f".{path.name}.0000.checkpoint"]
    assert other.exists()


def test_checkpoints_of_a_replaced_run_do_not_meet_the_new_one(tmp_path):
    """They go before the new file gets its name, not after: a kill in between must not join the two."""
    path = tmp_path / "run.h5"
    left_unfinished(path)
    with begun(path, force=True) as writer:
        assert checkpoint_paths(path)  # the old file has its name still
        write(writer, 0)
        writer.commit()
        assert not checkpoint_paths(path)


def test_a_complete_file_keeps_no_checkpoints(tmp_path):
    path = tmp_path / "run.h5"
    left_unfinished(path)
    with Writer.resume(path, GROUPS) as writer:
        writer.rewind(0, {"wheel": 600})
        writer.close({"status": "complete"}).close()
    assert litter(path) == []
    checkpoint_path(path, 0).write_bytes(b"left by a kill right after the last commit")
    with pytest.raises(InputError, match="nothing to resume"):
        Writer.resume(path, GROUPS)
    assert litter(path) == []


def test_a_reader_does_not_wait_for_a_writer_for_ever(tmp_path, monkeypatch):
    """A journal lies there and somebody holds the lock: the file as it is."""
    monkeypatch.setattr("tiengine.result_files.file_lock.PATIENCE", 0.05)
    path = tmp_path / "run.h5"
    left_unfinished(path)
    atomic_write(journal_of(path), journal._journal(path.stat().st_size, []))
    lock = acquire_lock(path)
    with results.open(path) as result:
        assert not result.finished
    release_lock(lock)
    assert journal_of(path).exists()


# --- disks, signals, workers ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("doing", ["add", "write", "note", "commit"])
def test_a_full_disk_is_one_sentence_and_keeps_what_was_committed(tmp_path, monkeypatch, doing):
    path = tmp_path / "run.h5"

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def go_on(writer: Writer) -> None:
        for call in ("_write_at", "atomic_write"):
            monkeypatch.setattr(journal, call, full)
        if doing == "add":
            writer.add(1, LABELS, {"status": "running"})
        elif doing == "note":
            writer.add_events(0, [Event("wheel_lift", 0.1, 1.0, 1, "left", "x" * 100_000, False)])
        elif doing == "write":
            write(writer, 600, 5000)
        else:
            writer.describe(0, {"simulated_time": 1.0})
        writer.commit()

    with pytest.raises(InputError, match=r"run\.h5': cannot be written .*No space left"), begun(path) as writer:  # noqa: PT012
        write(writer, 0)
        writer.commit()
        go_on(writer)
    monkeypatch.undo()
    with results.open(path) as result:
        assert result.wheel()["normal_force"].shape == (600, 2, 2)
    assert litter(path) == []


def test_size_is_estimated_within_ten_per_cent(tmp_path):
    """Twenty metres: 2 MB, many chunks of which are not full."""
    path = tmp_path / "run.h5"
    gauges = [{"name": "post", "on": "rail", "chainage": 22.0, "side": "left"}]
    scenario = load_scenario("paper", SHORT | {"train.distance": 20.0, "gauges": gauges})
    simulate.run(scenario, path).close()
    assert 1.0 <= estimated_bytes(scenario) / path.stat().st_size <= 1.1


def test_a_run_that_does_not_fit_says_how_much_is_missing(tmp_path, monkeypatch):
    scenario = load_scenario("paper", {"train.distance": 100_000.0})
    monkeypatch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(free=1_000_000_000))
    missing = estimated_bytes(scenario) / 1e9 - 1.0
    with pytest.raises(InputError, match=f"1.00 GB are free: {missing:.2f} GB are missing"):
        check_space(scenario, tmp_path / "run.h5")


def test_commits_take_a_hundredth_of_the_time_at_most(monkeypatch):
    """A commit of 2 s: the next one is 200 s away."""
    now = [0.0]
    monkeypatch.setattr(collecting, "time", SimpleNamespace(perf_counter=lambda: now[0]))

    def commit() -> None:
        now[0] += 2.0

    collector = Collector(load_scenario("paper", SHORT), SimpleNamespace(commit=commit))
    assert collector._pause == collecting.FLUSH_SECONDS
    collector._commit()
    assert collector._pause == pytest.approx(2.0 / 0.01)


def test_a_signal_may_come_in_the_middle_of_printing(capfd):
    """The handler uses nothing that the interrupted code may be using."""

    class Busy:
        quiet = False

        def print(self, *_: object) -> None:
            raise RuntimeError("reentrant call")

    with cli_run.stopped_by_signals(Busy()) as stop:
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.number == signal.SIGTERM
    assert "a second signal exits at once" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("code", "excusable", "raises"), [(-9, True, False), (-9, False, True), (1, True, True)],
    ids=["killed", "killed again and again", "by itself"],
)  # fmt: skip
def test_a_worker_killed_before_it_begins_is_replaced(code, excusable, raises):
    """One that ends by itself is not: a script without a guard would start workers for ever."""
    dead = worker._Worker(SimpleNamespace(join=lambda: None, exitcode=code))
    if raises:
        with pytest.raises(RunFailedError, match="before it began"):
            worker._cause_of_death(dead, excusable)
    else:
        assert worker._cause_of_death(dead, excusable) == "killed by SIGKILL"
