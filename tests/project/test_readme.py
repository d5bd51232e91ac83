"""Examples and commands of the README work as written."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tiengine.parameters.presets import preset_names

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Code blocks of the README."""
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_python_examples_run(capsys):
    for code in blocks("python"):
        exec(compile(code, "README.md", "exec"), {})
    assert "(" in capsys.readouterr().out


def test_ci_installs_and_tests_like_the_readme():
    """Both install the extra ``test`` and run the suite, CI from a wheel."""
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    _, install, test = blocks("sh")[1].strip().split(" && ")
    assert install == '.venv/bin/pip install -e ".[test]"'
    assert 'pip install -q "$wheel[test]"' in script
    assert test.removeprefix(".venv/bin/") in script


def test_no_speed_is_claimed():
    """Neither README nor package description says how fast it is; the speed page has the numbers."""
    description = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["description"]
    for text in (README, description):
        assert not re.search(r"faster than|real time", text.lower())


@pytest.mark.parametrize(
    "line", [line for block in blocks("sh") for line in block.splitlines() if line.startswith("tiengine")]
)
def test_commands_are_understood(line):
    """Every option of an example is in its command's help, and every scenario in the library."""
    words = line.split("#")[0].split()
    program = Path(sys.executable).with_name("tiengine")
    done = subprocess.run([program, words[1], "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    for word in words[2:]:
        if word.startswith("-"):
            assert word in done.stdout
    if words[1] == "run":
        assert words[2] in preset_names("scenarios")
