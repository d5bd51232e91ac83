"""Studies on this machine: the same bits from any number of processes, in shares, and after every kind of end."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from itertools import count
from pathlib import Path

import pytest
import tomli_w
from click.testing import CliRunner

from tiengine import result as results
from tiengine.cli.commands import main
from tiengine.parameters.errors import InputError, RunFailedError, RunStoppedError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate
from tiengine.study.study import Study, study

from .short import PLAN, bits


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    """The study in this process."""
    folder = tmp_path_factory.mktemp("whole") / "study"
    study(PLAN, folder, workers=1)
    return folder


def test_a_study_is_complete(whole):
    """Six trains in two tasks, with key figures of every train; asked again, nothing is run again."""
    status = Study.open(whole).status()
    assert (status.tasks, status.complete, status.trains, status.done, status.failed) == (2, 2, 6, 6, 0)
    records = list(Study.open(whole).folder.records())
    assert [train["member"] for record in records for train in record["trains"]] == list(range(6))
    assert records[0]["trains"][0]["figures"]["largest_vertical_wheel_force_Q_kN"] > 50.0
    before = {path: path.stat().st_mtime_ns for path in whole.rglob("*.h5")}
    Study.open(whole).resume()
    assert {path: path.stat().st_mtime_ns for path in whole.rglob("*.h5")} == before


def test_a_part_is_the_ensemble_of_its_trains(whole):
    """A part holds what `tiengine run` gives for the same trains as an ensemble, bit for bit."""
    own = {"ensemble.size": 4, "ensemble.vary.irregularity.scale": [0.5, 0.5, 1.0, 1.0]}
    seeds = {"ensemble.vary.irregularity.seed": [1, 2, 1, 2], "train.speed_kmh": 300.0}
    scenario = load_scenario("default", PLAN["set"] | own | seeds)
    with simulate.run(scenario, workers=0) as ensemble, results.open(whole / "parts" / "00000.h5") as part:
        for train in range(4):
            mine, theirs = ensemble.wheel(train), part.wheel(train)
            assert all((mine[name] == theirs[name]).all() for name in mine)


def test_shares_and_workers_have_the_same_bits(whole, tmp_path):
    """Two shares one after the other, then two worker processes: the parts of one process."""
    study(PLAN, tmp_path / "shares", part=(2, 2), workers=1)
    assert Study.open(tmp_path / "shares").status().complete == 1
    study(PLAN, tmp_path / "shares", part=(1, 2), workers=1)
    assert bits(tmp_path / "shares") == bits(whole)
    study(PLAN, tmp_path / "workers", workers=2)
    assert bits(tmp_path / "workers") == bits(whole)


def test_a_stopped_study_continues(whole, tmp_path):
    """Stopped within the first task, which then continues from its checkpoint."""
    calls = count()
    with pytest.raises(RunStoppedError, match="stopped after 0 of 6 trains"):
        study(
            {**PLAN, "set": {**PLAN["set"], "train.distance": 40.0}},
            tmp_path / "s",
            workers=1,
            stop=lambda: next(calls) > 1,
        )
    folder = tmp_path / "s"
    assert [path.name for path in (folder / "parts").glob(".*.checkpoint")] == [".00000.h5.0000.checkpoint"]
    assert Study.open(folder).status().complete == 0


KILLED = """
import sys
from tiengine.study.study import Study, study
sys.path.insert(0, {tests!r})
if __name__ == "__main__":
    from short import PLAN
    study(PLAN, {folder!r}, workers=1, checkpoint=1e-3)
"""


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_killed_study_continues(whole, tmp_path, share):
    """Killed at once when some of the bytes of the study are there; the study then has the same bits."""
    folder = tmp_path / "study"
    code = KILLED.format(tests=str(Path(__file__).parent), folder=str(folder))
    size = sum(path.stat().st_size for path in whole.rglob("*.h5"))
    process = subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[2])
    while process.poll() is None:
        parts = list((folder / "parts").glob("*.h5")) if (folder / "parts").is_dir() else []
        if sum(path.stat().st_size for path in parts) > share * size:
            process.send_signal(signal.SIGKILL)
            process.wait()
        time.sleep(0.005)
    Study.open(folder).resume(workers=1)
    assert bits(folder) == bits(whole)


def test_a_killed_worker_is_replaced(whole, tmp_path):
    """A worker process that dies; its task is started again."""
    said: list[str] = []
    victims: list[int] = []

    def kill_first(done: float, trains: float) -> None:
        children = subprocess.run(["pgrep", "-P", str(os.getpid()), "-f", "spawn_main"], capture_output=True, text=True)
        if not victims and done > 0.0 and children.stdout.split():
            victims.append(int(children.stdout.split()[0]))
            os.kill(victims[0], signal.SIGKILL)

    study(PLAN, tmp_path / "study", workers=2, progress=kill_first, notify=said.append)
    assert victims
    assert bits(tmp_path / "study") == bits(whole)


def test_two_studies_in_one_folder(whole, tmp_path):
    """Another plan, the same plan again, and a second process are refused."""
    with pytest.raises(InputError, match="holds another study"):
        study({**PLAN, "seeds": 3}, whole)
    with pytest.raises(InputError, match="holds this study already; continue it with `tiengine study resume"):
        study(PLAN, whole)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").touch()
    with pytest.raises(InputError, match="holds other files"):
        study(PLAN, tmp_path / "other")
    opened = Study.open(whole)
    with opened.folder.alone(), pytest.raises(InputError, match="another study runs in this folder"):
        Study.open(whole).resume()


def test_a_damaged_part_is_named(whole, tmp_path):
    """A part that is no result is neither replaced nor read."""
    shutil.copytree(whole, tmp_path / "s")
    (tmp_path / "s" / "records" / "00001.json").unlink()
    (tmp_path / "s" / "parts" / "00001.h5").write_bytes(b"no result")
    with pytest.raises(RunFailedError, match=r"task 1: .*00001\.h5: not a tiengine result"):
        Study.open(tmp_path / "s").resume(workers=1)


def test_derailed_trains_are_told_with_their_reason(tmp_path):
    """A track that no train stays on: the study is complete, the trains are failures."""
    plan = {**PLAN, "constraints": [], "seeds": 1, "factors": [{"key": "irregularity.scale", "values": [1.0, 100.0]}]}
    said: list[str] = []
    status = study(plan, tmp_path / "s", workers=1, notify=said.append).status()
    assert (status.done, status.failed, status.finished) == (2, 1, True)
    assert re.match(r"train 1 failed: ", said[-1])


def test_commands(tmp_path, monkeypatch):
    """Plan to folder, status, resume, and bad options in one line."""
    monkeypatch.chdir(tmp_path)
    Path("plan.toml").write_text(
        tomli_w.dumps({**PLAN, "seeds": 1, "factors": []} | {"constraints": []}), encoding="utf-8"
    )

    def run(line: str, code: int = 0) -> str:
        done = CliRunner().invoke(main, ["study", *line.split()])
        assert done.exit_code == code, done.output
        return done.output

    assert re.search(r"^trains +1$", run("plan.toml --dry-run"), flags=re.MULTILINE)
    assert not Path("plan").exists()
    assert "1 of 1 complete" in run("plan.toml -o s --workers 1")
    assert "1 of 1 done, 0 failed" in run("status s")
    run("resume s")
    assert run("plan.toml -o s", 2).count("\n") == 1
    assert "must be I/N with I from 1 to N" in run("plan.toml -o t --part 3/2", 2)
    assert "only one of them" in run("plan.toml -o t --part 1/2 --slurm", 2)
    assert "no folder of a study" in run("status nowhere", 2)
