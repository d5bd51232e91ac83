"""Paths of files that are read at every run: relative to the scenario's folder as named, absolute for a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import user_path
from tiengine.scenario.ensemble import Ensemble
from tiengine.track.alignment_file import read_alignment

__all__ = ["absolute_files", "absolute_vary"]

FILES = (
    ("irregularity",),
    ("track", "rail_shapes"),
    ("track", "ground"),
    ("track", "base_motion"),
    ("train", "wheel_shapes"),
    ("train", "forces"),
)
"""Tables, or lists of tables, whose key ``file`` names such a file."""


def absolute_files(tables: dict[str, Any], folder: Path | None) -> dict[str, Any]:
    """Make the paths of such files absolute, and put the rows of an alignment file in the place of its name.

    Args:
        tables: Tables of a scenario, not yet checked.
        folder: Where relative paths start; the working directory if None.

    Returns:
        The tables, copied where a path has changed.

    Raises:
        InputError: A path leads round in circles; an alignment file breaks a rule.
    """
    for keys in FILES:
        tables = _changed(tables, keys, "", folder)
    return _with_alignment(tables, folder)


def _with_alignment(tables: dict[str, Any], folder: Path | None) -> dict[str, Any]:
    """The tables with the rows of an alignment file in the place of its name."""
    track = tables.get("track")
    if not isinstance(track, dict) or not isinstance(track.get("alignment_file"), str):
        return tables
    name = track["alignment_file"]
    if track.get("alignment_rows") or track.get("alignment"):
        raise InputError(f"track.alignment_file = {name!r}: must not be set together with another alignment")
    rows = read_alignment(user_path(name, folder, "track.alignment_file"), f"track.alignment_file = {name!r}")
    kept = {key: value for key, value in track.items() if key != "alignment_file"}
    return {**tables, "track": {**kept, "alignment_rows": rows}}


def _changed(value: Any, keys: tuple[str, ...], where: str, folder: Path | None) -> Any:
    """A table, or a list of tables, with the files below it made absolute; other values as they are."""
    if isinstance(value, tuple):
        return tuple(_changed(each, keys, f"{where}[{i}]", folder) for i, each in enumerate(value))
    if not isinstance(value, dict):
        return value
    if keys:
        if keys[0] not in value:
            return value
        inner = f"{where}.{keys[0]}".removeprefix(".")
        return {**value, keys[0]: _changed(value[keys[0]], keys[1:], inner, folder)}
    if not isinstance(value.get("file"), str):
        return value
    return {**value, "file": _absolute(value["file"], f"{where}.file", folder)}


def _absolute(name: str, where: str, folder: Path | None) -> str:
    """Absolute path of a file."""
    path = user_path(name, folder, where)
    try:
        return str(path.resolve())
    except (OSError, RuntimeError) as error:  # circular links
        raise InputError(f"{where} = {name!r}: {error}") from None


def absolute_vary(ensemble: Ensemble, folder: Path | None) -> Ensemble:
    """Make the paths of the measured irregularities of an ensemble absolute.

    Args:
        ensemble: May vary ``irregularity.file``.
        folder: Where relative paths start.
    """
    files = ensemble.vary.get("irregularity.file")
    if files is None:
        return ensemble
    found = tuple(_absolute(file, "irregularity.file", folder) if isinstance(file, str) else file for file in files)
    return ensemble.model_copy(update={"vary": {**ensemble.vary, "irregularity.file": found}})
