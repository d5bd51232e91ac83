"""Presets of the library and of the user, found by name or by path.

Every kind of part has a folder ``tiengine/library/<kind>/`` with one file per preset. A preset is referred to by
its bare name (``"CHN60"``) or by the path of a file of the same form (``"my_rail.toml"``).
"""

from __future__ import annotations

from importlib import resources
from itertools import takewhile
from pathlib import Path

from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import (
    is_file,
    load_toml,
    read_text,
    user_path,
)

__all__ = ["KINDS", "LONGEST_PATH", "find_preset", "library_folder", "preset_names", "preset_source"]

KINDS = (
    "vehicles",
    "couplings",
    "aerodynamics",
    "rails",
    "slabs",
    "fastenings",
    "profiles",
    "irregularity",
    "scenarios",
)
"""Folders of the library."""

LONGEST_PATH = 1000  # characters of a name or path in a scenario

_SUFFIXES = {"profiles": (".csv",)}  # every other kind is TOML
_PATH_SUFFIXES = (".toml", ".csv", ".txt", ".dat", ".prw", ".prr", ".whl", ".ban")  # of files named in a scenario


def library_folder(kind: str) -> Path:
    """Folder of the presets of one kind.

    Args:
        kind: One of :data:`KINDS`.

    Returns:
        Path inside the installed package (the package is always installed as plain files).
    """
    if kind not in KINDS:
        raise InputError(f"preset kind = {kind!r}: unknown{nearest(kind, KINDS)}")
    return Path(str(resources.files("tiengine.library"))) / kind


def preset_names(kind: str) -> list[str]:
    """Names of the library's presets of one kind, sorted.

    Args:
        kind: One of :data:`KINDS`.
    """
    folder = library_folder(kind)
    suffixes = _SUFFIXES.get(kind, (".toml",))
    return sorted(file.stem for file in folder.glob("*") if file.suffix in suffixes)


def find_preset(kind: str, name_or_path: str, suffix: str = "", folder: Path | None = None, called: str = "") -> Path:
    """File of a preset of the library or of the user.

    A text with a slash or the kind's suffix is a path, anything else a name of the library. Paths may be absolute,
    begin with ``~`` or lead out of the folder: files are only read (:mod:`tiengine.parameters.input_files`).

    Args:
        kind: One of :data:`KINDS`.
        name_or_path: ``"CHN60"``, or a path, absolute or relative to ``folder``.
        suffix: Suffix of the library's files; the kind's own (``.toml``, profiles ``.csv``) if empty.
        folder: Where relative paths start (the folder of the scenario file); the working directory if None.
        called: Its name for messages (the scenario's key); the kind if empty.

    Returns:
        Path of an existing file.

    Raises:
        InputError: There is no such preset or file; the message names the nearest preset.
    """
    suffix = suffix or _SUFFIXES.get(kind, (".toml",))[0]
    called = called or kind
    if not isinstance(name_or_path, str) or not name_or_path:
        raise InputError(f"{called} = {name_or_path!r}: must be the name of a preset or the path of a file")
    if len(name_or_path) > LONGEST_PATH:
        raise InputError(f"{called} = {name_or_path[:60]!r}...: must have at most {LONGEST_PATH} characters")
    library = library_folder(kind) / f"{name_or_path}{suffix}"
    if _is_path(name_or_path, suffix):
        path = user_path(name_or_path, folder, called)
        if is_file(path):
            return path
        raise InputError(f"{called} = {name_or_path!r}: no such file ({path})")
    if is_file(library):
        return library
    raise InputError(f"{called} = {name_or_path!r}: no such preset{nearest(name_or_path, preset_names(kind))}")


def _is_path(text: str, suffix: str) -> bool:
    """Whether a text means a file rather than a preset (names hold neither slashes nor known suffixes)."""
    return "/" in text or "\\" in text or Path(text).suffix.lower() in {suffix, *_PATH_SUFFIXES}


def preset_source(kind: str, name: str) -> str:
    """Source of a preset's numbers, in one line.

    Args:
        kind: One of :data:`KINDS`.
        name: Name of a preset of the library.

    Returns:
        The ``source`` key of a TOML preset, else the comment lines at its head.
    """
    path = find_preset(kind, name)
    if path.suffix == ".toml":
        source = load_toml(path).get("source", "")
        if isinstance(source, str) and source:
            return " ".join(source.split())
    lines = read_text(path).splitlines()
    head = [line.lstrip("# ") for line in takewhile(lambda line: line.startswith("#"), lines)]
    return " ".join(head[:-1])  # the last line names the columns
