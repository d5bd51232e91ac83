"""Damaged, forged and foreign result files: each command answers in one line."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import strategies as st

import tiengine
from tiengine.cli.commands import main
from tiengine.parameters.errors import RunStoppedError
from tiengine.result_files.reader import RUNNING
from tiengine.result_files.writer import Writer
from tiengine.simulation import simulate
from tiengine.simulation.collector import Collector
from tiengine.simulation.tasks import Task

from ..fuzzing import DAMAGES, EXAMPLES, Damage, deadline, on_many, refused

STRUCTURE = 60_000  # bytes of the file's beginning that hold most of its structure
COMMANDS = (("info",), ("metrics",), ("export", "-o", "{0}.csv"), ("export", "-o", "{0}.mat", "--channel", "body"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result of twelve metres, enough for the indices."""
    path = tmp_path_factory.mktemp("fuzz") / "whole.h5"
    settings = {
        "train.distance": 12.0,
        "output.run_in": 0.0,
        "output.wheel_interval": 1e-3,
        "gauges": ({"name": "a", "on": "rail", "chainage": 20.0, "side": "left"},),
    }
    simulate.run(tiengine.load_scenario("default", settings), path).close()
    return path


@pytest.fixture(scope="module")
def contents(whole: Path) -> dict[str, Any]:
    return everything(whole)


def everything(path: Path) -> dict[str, Any]:
    """Contents of a file by path, without texts, which HDF5 keeps without a checksum."""
    with tiengine.open(path) as result:
        found: dict[str, Any] = {"scenario": result.scenario_toml, "trains": result.trains}
        node = result["trains/000"]
        paths: list[str] = []
        node.visit(paths.append)
        for name in paths:
            if isinstance(node[name], h5py.Dataset) and node[name].dtype.kind in "if":
                values = node[name][()]
                found[name] = (values.shape, values.tobytes())
    return found


def answered(path: Path, command: tuple[str, ...]) -> bool:
    """Whether a command refused a file, in one line and with exit status 2; a crash fails the test."""
    arguments = [command[0], str(path), *(word.format(path) for word in command[1:])]
    with deadline():
        done = CliRunner().invoke(main, arguments)
    assert done.exception is None or isinstance(done.exception, SystemExit), (arguments, repr(done.exception))
    assert done.exit_code in (0, 2), done.output
    if done.exit_code == 2:
        assert done.stderr.startswith("error: "), done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr
    for left in path.parent.glob(f"{path.name}.*"):
        left.unlink()
    return done.exit_code == 2


@EXAMPLES
def test_changed_bytes(examples: int, whole: Path, contents: dict[str, Any], tmp_path: Path) -> None:
    """A changed file is refused or has its numbers and scenario unchanged; new names, since HDF5 caches files."""
    content, count = whole.read_bytes(), itertools.count()

    def check(damage: Damage) -> bool:
        data = damage.of(content, STRUCTURE)
        path = tmp_path / f"{next(count)}.h5"
        path.write_bytes(data)
        found: list[dict[str, Any]] = []
        message = refused(lambda: found.append(everything(path)))
        path.unlink()
        if message is None and b"scenario_crc32" in data:
            assert found[0].items() <= contents.items()
        return message is not None

    on_many(examples, DAMAGES, check)


@EXAMPLES
def test_changed_bytes_on_the_command_line(examples: int, whole: Path, tmp_path: Path) -> None:
    """Commands that read results."""
    content, count = whole.read_bytes(), itertools.count()

    def check(given: tuple[Damage, tuple[str, ...]]) -> bool:
        path = tmp_path / f"{next(count)}.h5"
        path.write_bytes(given[0].of(content, STRUCTURE))
        bad = answered(path, given[1])
        path.unlink()
        return bad

    on_many(examples, st.tuples(DAMAGES, st.sampled_from(COMMANDS)), check)


Forgery = Callable[[h5py.File, str], None]


def replace(make: Callable[[h5py.Group, str], object]) -> Forgery:
    """Replace a group or dataset."""

    def forge(file: h5py.File, path: str) -> None:
        above, _, name = path.rpartition("/")
        del file[path]
        make(file[above or "/"], name)

    return forge


FORGERIES: dict[str, Forgery] = {
    "missing": replace(lambda group, name: None),
    "scalar": replace(lambda group, name: group.create_dataset(name, data=1.0)),
    "empty": replace(lambda group, name: group.create_dataset(name, data=h5py.Empty("f4"))),
    "texts": replace(lambda group, name: group.create_dataset(name, data=["a", "b"])),
    "record": replace(lambda group, name: group.create_dataset(name, (3,), [("a", "f4")])),
    "references": replace(lambda group, name: group.create_dataset(name, (3,), h5py.ref_dtype)),
    "group": replace(lambda group, name: group.create_group(name)),
    "type": replace(lambda group, name: group.__setitem__(name, np.dtype("f4"))),
    "other shape": replace(lambda group, name: group.create_dataset(name, data=np.ones((2, 3, 4, 2)))),
    "not a number": replace(lambda group, name: group.create_dataset(name, data=np.full(12, np.nan))),
    "1e15 samples": replace(lambda group, name: group.create_dataset(name, (10**15,), "f4", chunks=(1000,))),
    "1e15 samples packed": replace(
        lambda group, name: group.create_dataset(name, (10**15,), "f4", chunks=(1000,), compression="gzip")
    ),
    "soft link": replace(lambda group, name: group.__setitem__(name, h5py.SoftLink("/trains"))),
    "circle": replace(lambda group, name: group.__setitem__(name, group)),
    "external link": replace(lambda group, name: group.__setitem__(name, h5py.ExternalLink("/etc/passwd", "/"))),
    "external data": replace(
        lambda group, name: group.create_dataset(name, (8,), "f4", external=[("/etc/hostname", 0, 32)])
    ),
}
ODD_ATTRIBUTES: tuple[Any, ...] = (None, 0, -1, 2.5, np.nan, "", "x", b"\xff", [1, 2], ["a"], h5py.Empty("f4"), 2**62)


def nodes(path: Path) -> list[str]:
    found = ["trains", "trains/000"]
    with h5py.File(path) as file:
        file["trains/000"].visit(lambda name: found.append(f"trains/000/{name}"))
    return found


def forge(path: Path, given: tuple[str, str, str, Any]) -> None:
    """Change one node, or one attribute of the root or the train."""
    kind, node, key, value = given
    with h5py.File(path, "r+") as file:
        if kind in FORGERIES:
            FORGERIES[kind](file, node)
            return
        attributes = (file if kind == "root" else file["trains/000"]).attrs
        if key in attributes:
            del attributes[key]
        if value is not None:
            attributes[key] = value


@pytest.fixture(scope="module")
def forged(whole: Path) -> st.SearchStrategy[tuple[str, str, str, Any]]:
    with h5py.File(whole) as file:
        keys = sorted({*file.attrs, *file["trains/000"].attrs})
    kinds = st.sampled_from([*FORGERIES, *FORGERIES, "root", "train"])
    return st.tuples(kinds, st.sampled_from(nodes(whole)), st.sampled_from(keys), st.sampled_from(ODD_ATTRIBUTES))


@EXAMPLES
def test_forged_structure(examples: int, whole: Path, forged: st.SearchStrategy[Any], tmp_path: Path) -> None:
    """A missing or replaced group, dataset or attribute is refused; no other file is read."""
    content, count = whole.read_bytes(), itertools.count()

    def check(given: tuple[tuple[str, str, str, Any], tuple[str, ...]]) -> bool:
        path = tmp_path / f"{next(count)}.h5"
        path.write_bytes(content)
        forge(path, given[0])
        bad = answered(path, given[1])
        path.unlink()
        return bad

    on_many(examples, st.tuples(forged, st.sampled_from(COMMANDS)), check)


@EXAMPLES
def test_forged_structure_resumed(
    examples: int, whole: Path, forged: st.SearchStrategy[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``tiengine resume`` refuses before it computes; the file remains unchanged."""

    def stop(self: object, writer: Writer, collector: Collector, tasks: list[Task]) -> None:
        for train in writer.facts():
            writer.rewind(train, {})
        raise RunStoppedError("here")

    monkeypatch.setattr(simulate._Job, "do", stop)
    content, count = whole.read_bytes(), itertools.count()

    def check(given: tuple[str, str, str, Any]) -> bool:
        path = tmp_path / f"{next(count)}.h5"
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            file.attrs["status"] = RUNNING
        forge(path, given)
        with deadline():
            done = CliRunner().invoke(main, ["resume", str(path), "--quiet"])
        assert isinstance(done.exception, SystemExit), (given, repr(done.exception))
        if done.exit_code == 2:
            assert len(done.stderr.splitlines()) == 1, done.stderr
        assert path.exists()
        path.unlink()
        return done.exit_code == 2

    on_many(examples, forged, check)


def foreign(kind: str, path: Path) -> None:
    if kind == "text":
        path.write_text("no result")
    elif kind == "empty":
        path.write_bytes(b"")
    elif kind == "signature":
        path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(2000))
    else:
        with h5py.File(path, "w") as file:
            if kind != "HDF5":
                file.attrs["format"] = "tiengine"
                file.attrs["format_version"] = {"old": 0, "new": 3, "odd": [1, 2], "words": "1"}[kind]
                file.attrs["tiengine_version"] = "9.8"


@pytest.mark.parametrize("kind", ["text", "empty", "signature", "HDF5", "old", "new", "odd", "words"])
def test_foreign_files(kind: str, tmp_path: Path) -> None:
    """The message states that it is no result, or its version and the remedy."""
    path = tmp_path / "foreign.h5"
    foreign(kind, path)
    for command in (*COMMANDS, ("resume",)):
        assert answered(path, command)
    message = refused(lambda: tiengine.open(path))
    assert message is not None
    other_version = kind in ("old", "new", "odd", "words")
    assert ("tiengine that wrote it (9.8), or run its scenario again" in message) == other_version
    assert ("not a tiengine result" in message) != other_version


def test_a_file_in_a_file_is_not_followed(whole: Path, tmp_path: Path) -> None:
    """Links to other files and data kept in them are named."""
    path = tmp_path / "linked.h5"
    for kind, words in (
        ("external link", "is a link to another place or file"),
        ("soft link", "is a link to another place or file"),
        ("external data", "stored in another file"),
        ("1e15 samples", "declares 4e+09 MB of samples, the file holds 0 MB"),
    ):
        path.write_bytes(whole.read_bytes())
        forge(path, (kind, "trains/000/wheel/vertical_force", "", None))
        message = refused(lambda: everything(path))
        assert message is not None
        assert words in message
        assert "wheel/vertical_force" in message
        path.unlink()


def test_a_changed_scenario_is_found_out(whole: Path, tmp_path: Path) -> None:
    """A changed digit of the scenario, which HDF5 itself would not detect, is detected."""
    path = tmp_path / "changed.h5"
    data = whole.read_bytes()
    assert data.count(b"friction = 0.3") == 1
    path.write_bytes(data.replace(b"friction = 0.3", b"friction = 0.4"))
    with tiengine.open(path) as result:
        assert refused(lambda: result.scenario_toml) == f"{path}: scenario: damaged: its checksum does not match"
