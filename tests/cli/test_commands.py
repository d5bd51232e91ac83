"""Command line: exit status, one-line errors, output, and no remaining files.

The simulation is replaced by a short substitute that writes a real result file.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner, Result

from tiengine import result as results
from tiengine import simulation
from tiengine.cli.commands import main
from tiengine.parameters.errors import RunStoppedError
from tiengine.parameters.presets import KINDS, preset_names
from tiengine.result_files.channels import WHEEL
from tiengine.result_files.layout import GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import to_toml

LABELS = TrainLabels(["coach"], ["car"], np.zeros(4, np.int64), np.array([10.0, 7.5, -7.5, -10.0]))


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """A ``tiengine.simulation.simulate`` that records its calls and writes ten samples, in an empty folder."""
    module = ModuleType("tiengine.simulation.simulate")
    module.calls = []
    module.failure = None

    def run(
        scenario, output=None, *, force=False, progress=None, notify=None, workers=None, checkpoint=60.0, stop=None
    ):
        module.calls.append(scenario)
        groups = {"wheel": GroupSpec.standard("wheel", tuple(WHEEL))}
        with Writer(output, to_toml(scenario), {}, [LABELS], groups, force=force) as writer:
            time = np.arange(10) * 1e-4
            for t in time:
                progress(t, 1e-3)
            writer.append(0, "wheel", time, time, {name: np.zeros((10, 4, 2)) for name in WHEEL})
            if module.failure is not None:
                writer.commit()
                module.failure()
                if stop():
                    raise RunStoppedError("stopped after 0.001 of 0.002 s of simulated time")
            walls = {f"wall_time_{part}": 0.5 for part in ("import", "jit", "setup", "loop", "writing")}
            return writer.close(
                {"status": "complete", "dofs": 943, "time_step": 1e-4, "real_time_factor": 1.5, **walls}
            )

    module.run = run
    monkeypatch.setitem(sys.modules, "tiengine.simulation.simulate", module)
    monkeypatch.setattr(simulation, "simulate", module, raising=False)  # where an earlier import has put the real one
    monkeypatch.chdir(tmp_path)
    return module


def call(*arguments: str) -> Result:
    """Run the command."""
    return CliRunner().invoke(main, arguments)


def assert_refused(result: Result, message: str) -> None:
    """One line on stderr, exit status 2, nothing on stdout."""
    assert result.exit_code == 2
    assert result.stdout == ""
    assert re.fullmatch(r"error: [^\n]+\n", result.stderr)
    assert message in result.stderr


def test_run_writes_the_result_and_a_summary(fake, tmp_path):
    """The file is named after the scenario; the table at the end says size, step, speed and wall times."""
    result = call("run", "paper")
    assert result.exit_code == 0, result.output
    for text in ("943", "0.0001 s", "1.50", "import", "JIT", "set-up", "loop", "writing", "paper.h5"):
        assert text in result.stdout
    with results.open(tmp_path / "paper.h5") as file:
        assert file.scenario == fake.calls[0]
    assert [path.name for path in tmp_path.iterdir()] == ["paper.h5"]


def test_run_quiet_says_nothing(fake, tmp_path):
    """Neither a bar nor a table."""
    result = call("run", "paper", "--quiet", "-o", "out.h5")
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "out.h5").is_file()


def test_run_takes_settings(fake):
    """Several --set, later ones winning."""
    result = call("run", "paper", "--set", "train.speed_kmh=300", "--set", "train.speed_kmh=250", "--quiet")
    assert result.exit_code == 0, result.output
    assert fake.calls[0].train.speed_kmh == 250


def test_run_takes_a_file(fake, tmp_path):
    """A path instead of a name."""
    (tmp_path / "my.toml").write_text(
        '[train]\nvehicles = ["CRH380A_v2"]\nspeed_kmh = 100.0\ndistance = 10.0\n', encoding="utf-8"
    )
    result = call("run", "my.toml", "--quiet")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "my.h5").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--set", "train.speed_kmh=0"], "train.speed_kmh = 0: must be greater than 0"),
        (["--set", "train.distance=long"], "train.distance = 'long': must be a number"),
        (["--set", "train.sped_kmh=3"], "train.sped_kmh: unknown key; did you mean 'speed_kmh'?"),
        (["--set", "train.vehicles.0.car.mass=-1"], "car.mass = -1: must be greater than 0 kg"),
        (
            ["--set", "train.wheel_profile=LMX"],
            "train.wheel_profile = 'LMX': no such preset; did you mean 'LMA'?",
        ),
        (["--set", "numerics.window=10"], "numerics.window = 10: window shorter than the train"),
        (["--set", "numerics.time_step=0.1"], "numerics.time_step = 0.1: must be 'auto' or a number between"),
        (["--set", "train.speed_kmh"], "must be KEY=VALUE"),
        (["-o", "no/such/folder/run.h5"], "output = 'no/such/folder/run.h5': there is no folder"),
        (["-o", "."], "output = '.': must be a file, not a folder"),
    ],
)
def test_bad_input_is_one_line(fake, tmp_path, arguments, message):
    """Every kind of bad input ends before the run, with nothing left behind."""
    assert_refused(call("run", "paper", *arguments), message)
    assert fake.calls == []
    assert list(tmp_path.iterdir()) == []


def test_unknown_scenario(fake):
    """The nearest one is named."""
    assert_refused(call("run", "papr"), "scenario = 'papr': no such preset; did you mean 'paper'?")


def test_existing_result_needs_force(fake):
    """An existing result is not overwritten by accident."""
    assert call("run", "paper", "--quiet").exit_code == 0
    assert_refused(
        call("run", "paper", "--quiet"), "output = 'paper.h5': exists already; choose another name or --force"
    )
    assert len(fake.calls) == 1
    assert call("run", "paper", "--quiet", "--force").exit_code == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "sigterm"])
def test_interrupted_run_can_be_resumed(fake, tmp_path, number):
    """One line says how; what was written stays."""
    fake.failure = lambda: os.kill(os.getpid(), number)
    result = call("run", "paper", "--quiet")
    assert result.exit_code == 128 + number
    assert result.stderr == "stopped after 0.001 of 0.002 s of simulated time; resume with: tiengine resume paper.h5\n"


def test_second_interrupt_leaves_at_once(fake):
    """A second signal ends the program at once, without a commit."""

    def twice() -> None:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("still here")

    fake.failure = twice
    assert call("run", "paper", "--quiet").exit_code == 128 + signal.SIGINT


def test_list_names_every_preset():
    """All kinds, all names, each with a source."""
    lines = call("list").stdout.splitlines()
    for kind in KINDS:
        assert kind in lines
        for name in preset_names(kind):
            assert any(re.match(rf"  {re.escape(name)} +\S", line) for line in lines), name
    assert "CHN60" in call("list", "rails").stdout
    assert "LMA" not in call("list", "rails").stdout


def test_info_describes_a_result(fake):
    """Scenario, versions and contents of the file are listed."""
    call("run", "paper", "--quiet")
    text = call("info", "paper.h5").stdout
    for word in (
        "paper",
        "CRH380A_v2",
        "350.0",
        "600.0",
        "943",
        "taichi_version",
        "10 samples of",
        "normal_force",
    ):
        assert word in text
    assert "[presets" not in text


def test_info_of_something_else(fake, tmp_path):
    """One line, whatever the file is."""
    (tmp_path / "text.h5").write_text("hello")
    assert_refused(call("info", "text.h5"), "text.h5: not a tiengine result")
    assert_refused(call("info", "none.h5"), "none.h5: no such file")


def test_version():
    """The installed version."""
    assert metadata.version("tiengine") in call("--version").stdout


def test_light_commands_do_not_import_taichi():
    """Listing and reading answer at once; Taichi alone takes longer to import than they take."""
    code = (
        "import sys, tiengine.result\nfrom click.testing import CliRunner\nfrom tiengine.cli.commands import main\n"
        "assert CliRunner().invoke(main, ['list']).exit_code == 0\n"
        "sys.exit('taichi' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
