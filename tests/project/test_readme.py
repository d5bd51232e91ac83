"""What the README tells a reader to do works as written."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Code blocks of the README."""
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_python_examples_run(capsys):
    for code in blocks("python"):
        exec(compile(code, "README.md", "exec"), {})
    assert "(" in capsys.readouterr().out


def test_ci_runs_the_test_command():
    """CI makes the environment itself, then installs and tests with the README's words."""
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    _, install, test = blocks("sh")[1].strip().split(" && ")
    assert install.removeprefix(".venv/bin/pip ") in script.replace(" -q", "")
    assert test.removeprefix(".venv/bin/") in script


@pytest.mark.parametrize(
    "line", [line for block in blocks("sh") for line in block.splitlines() if line.startswith("tiengine")]
)
def test_commands_are_understood(line):
    """Options and scenarios of the examples exist: their help and their names."""
    words = line.split("#")[0].split()
    program = Path(sys.executable).with_name("tiengine")
    done = subprocess.run([program, words[1], "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    for word in words[2:]:
        if word.startswith("-"):
            assert word in done.stdout
    if words[1] == "run":
        assert (ROOT / f"tiengine/library/scenarios/{words[2]}.toml").is_file()
