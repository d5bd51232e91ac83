"""Files, commands and Python of the manual work as written, on a few metres of track instead of hundreds."""

import re
import shlex
from pathlib import Path

import pytest
from click import Command
from click.testing import CliRunner

from tiengine.cli.commands import main
from validation.__main__ import main as validation

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```', flags=re.DOTALL | re.MULTILINE)
SHORTER = {
    "first_run": {
        "distance = 150.0 ": "distance = 12.0",
        "seed = 7 ": "seed = 7\n[output]\nrun_in = 1.0\n",
        '"train.distance": 20.0': '"train.distance": 3.0',
    },
    "three_failed_fastenings": {
        "distance = 150.0": "distance = 20.0\nstart = 80.0\n[output]\nrun_in = 5.0\n",
    },
    "polygonal_wheel": {
        "distance = 60.0": "distance = 9.0",
        "taper = 10.0 ": "taper = 1.0",
        "run_in = 20.0": "run_in = 1.0",
        "[0] + 20.0": "[0] + 1.0",
        "in (8, 20)": "in (20,)",
    },
    "gust": {"distance = 160.0": "distance = 12.0", "run_in = 20.0": "run_in = 1.0"},
    "settlement_at_a_pier": {
        "distance = 130.0": "distance = 12.0",
        "start = 60.0": "start = 105.0",
        "taper = 10.0": "taper = 1.0",
        "run_in = 10.0": "run_in = 1.0",
        "[0] + 10.0": "[0] + 1.0",
        "in (0.010, 0.020)": "in (0.010,)",
    },
    "unsupported_corner": {
        "distance = 60.0": "distance = 26.0",
        "taper = 10.0": "taper = 5.0",
        "run_in = 15.0": "run_in = 1.0",
        '"train.distance": 25.0': '"train.distance": 17.0',
    },
    "own_profiles": {"distance = 150.0": "distance = 5.0"},
    "hundred_trains": {
        "size = 100 ": "size = 4 ",
        "distance = 300.0": "distance = 12.0",
        "[output]\n": "[output]\nrun_in = 1.0\n",
        "wheel.position[0] + 50.0": "wheel.position[0] + 1.0",
        "-o hundred.h5": "-o hundred.h5 --workers 1",
    },
    "how_many_fastenings": {
        "seeds = 10": "seeds = 1",
        '"train.distance" = 60.0': '"train.distance" = 8.0',
        '"train.start" = 80.0': '"train.start" = 108.0',
        '"output.run_in" = 10.0': '"output.run_in" = 1.0',
        "-o failed": "-o failed --workers 1",
    },
    "which_parameter": {
        '"train.distance" = 30.0': '"train.distance" = 3.0',
        '"output.run_in" = 5.0': '"output.run_in" = 0.5',
        'method = "saltelli"\nsize = 16 ': 'method = "latin_hypercube"\nsize = 2 ',
        "-o matters": "-o matters --workers 1",
    },
    "through_a_curve": {"distance = 330.0": "distance = 15.0\n[output]\nrun_in = 2.0\n"},
    "full_length": {"train.distance=15": "train.distance=4"},
}
"""Replacements that shorten the runs, by tutorial; each text must be there."""

PROGRAMS: dict[str, Command] = {"tiengine": main, "python -m validation": validation}


def run(line: str) -> None:
    """Run a command line of a tutorial in this process."""
    for program, command in PROGRAMS.items():
        if line.startswith(f"{program} "):
            done = CliRunner().invoke(command, shlex.split(line.removeprefix(program), comments=True))
            assert done.exit_code == 0, f"{line}\n{done.output}\n{done.exception!r}"
            return
    raise AssertionError(f"no such program: {line}")


def follow(page: str, text: str) -> None:
    """Carry out everything on a page, one after the other, in the working folder."""
    names: dict[str, object] = {}
    for language, title, code in BLOCK.findall(text):
        if language in ("toml", "csv"):
            Path(title).write_text(code, encoding="utf-8")
        elif language == "sh":
            for line in code.splitlines():
                run(line)
        elif language == "python":
            exec(compile(code, f"{page}, {code.splitlines()[0]}", "exec"), names)


@pytest.mark.parametrize("page", sorted((DOCS / "tutorials").glob("*.md")), ids=lambda page: page.stem)
def test_tutorial(page, tmp_path, monkeypatch):
    text = page.read_text(encoding="utf-8")
    for long, short in SHORTER[page.stem].items():
        assert long in text
        text = text.replace(long, short)
    monkeypatch.chdir(tmp_path)
    follow(page.name, text)


def test_result_files(tmp_path, monkeypatch):
    """The page on result files works with a run of two metres."""
    monkeypatch.chdir(tmp_path)
    run("tiengine run default --set train.distance=2 -o run.h5")
    follow("results.md", (DOCS / "results.md").read_text(encoding="utf-8"))
    assert {path.name for path in tmp_path.iterdir()} == {"run.h5", "wheels.csv", "car.parquet", "run.mat"}
