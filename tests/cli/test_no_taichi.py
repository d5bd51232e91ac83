"""Commands and calls that simulate nothing import no Taichi; each runs in a fresh interpreter."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tiengine.result_files.channels import WHEEL
from tiengine.result_files.writer import GroupSpec, TrainLabels, Writer
from tiengine.scenario.scenario import to_toml

from .. import hand_made as by

SAMPLES = 3000  # 3 s: long enough for all filters but the blocks of 5 s

COMMAND = """
from tiengine.cli.commands import main
try:
    main(sys.argv[1:])
except SystemExit as end:
    assert not end.code, end.code
"""
RESULT = """
import tiengine
with tiengine.open("run.h5") as result:
    result.scenario.members, result.metrics(), result["trains/000/wheel/vertical_force"][:]
"""
SCENARIO = """
import tiengine
tiengine.load_scenario("paper").parts
"""


def loaded(code: str, *arguments: str, folder: Path | None = None) -> set[str]:
    """Top-level packages that an interpreter has imported after it ran the code, in a folder."""
    script = f"import sys\n{code}\nprint('loaded', *{{name.split('.')[0] for name in sys.modules}})"
    paths = [str(Path(__file__).parents[2]), *sys.path]  # relative entries would follow the folder
    script = f"import sys\nsys.path[:0] = {paths!r}\n{script}"
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    head, *packages = done.stdout.splitlines()[-1].split()
    assert head == "loaded"
    return set(packages)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds ``run.h5``, with the channels that figures and indices read, and ``short.h5`` as the program writes it."""
    path = tmp_path_factory.mktemp("results")
    noise = np.random.default_rng(0).standard_normal
    Q, Y = 70e3 + 1e3 * noise((SAMPLES, 4, 2)), 1e3 * noise((SAMPLES, 4, 2))
    position = {"contact_position_wheel": 1e-6 * Y, "contact_position_rail": 1e-6 * Y}
    groups = {
        "wheel": by.wheel(Q, Y, normal_force=Q, **position),
        "body": by.body(noise((SAMPLES, 7, 5))),
        "seats": by.seats(600),
        "slabs": by.slabs(70),
    }
    by.written(path / "run.h5", by.scenario(), groups)
    labels = TrainLabels(["coach"], by.BODIES, np.zeros(4, np.int64), by.OFFSET)
    standard = {"wheel": GroupSpec.standard("wheel", tuple(WHEEL))}
    with Writer(path / "short.h5", to_toml(by.scenario()), {}, [labels], standard) as writer:
        time = 1e-3 * np.arange(10)
        writer.append(0, "wheel", time, by.V * time, {name: np.zeros((10, 4, 2)) for name in WHEEL})
        writer.close({"status": "complete"}).close()
    return path


@pytest.mark.parametrize(
    "command",
    [
        "list", "info run.h5", "metrics run.h5", "plot run.h5", "report run.h5", "export short.h5 -o short.csv",
        "contact LMA CHN60", "contact LMA CHN60 -o contact.png", "run --help",
    ],
)  # fmt: skip
def test_commands_import_no_taichi(folder, command):
    """Every command that simulates nothing, with its work done; its start would take a second longer otherwise."""
    assert "taichi" not in loaded(COMMAND, *command.split(), folder=folder)


@pytest.mark.parametrize("code", [RESULT, SCENARIO])
def test_reading_imports_no_taichi(folder, code):
    """A result with its scenario and indices; a scenario with its parts."""
    assert "taichi" not in loaded(code, folder=folder)


@pytest.mark.parametrize("command", ["list", "info run.h5", "export short.h5 -o again.csv"])
def test_light_commands_import_little(folder, command):
    """Slow imports are left to the commands that need them."""
    assert not {"matplotlib", "jinja2", "scipy", "pydantic"} & loaded(COMMAND, *command.split(), folder=folder)


def test_imports_are_seen():
    """The test can fail: kernels do import Taichi."""
    assert "taichi" in loaded("from tiengine.kernels import plate")
