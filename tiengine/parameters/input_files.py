"""User files: regular files of bounded size, read whole and never executed. All limits are declared here.

A path may be absolute, lead out of the scenario's folder or through a symbolic link: such files are only read. Anything
but a regular file (a folder, a device such as /dev/zero, a pipe) is refused before it is opened, since reading it may
never end.
"""

from __future__ import annotations

import codecs
import math
import os
import re
import stat
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError

__all__ = [
    "DEEPEST",
    "LARGEST_CHECKPOINT",
    "LARGEST_NUMBER",
    "LARGEST_PROFILE",
    "LARGEST_TOML",
    "LARGEST_TRACK",
    "LONGEST_LINE",
    "SMALLEST_NUMBER",
    "check_regular",
    "is_file",
    "load_toml",
    "numbers_of",
    "parse_toml",
    "plain_toml",
    "read_bytes",
    "read_text",
    "read_text_file",
    "to_tuples",
    "user_path",
]

LARGEST_TOML = 5_000_000  # bytes: tomllib reads 1 MB a second; a scenario with its profiles has 0.1 MB
LARGEST_PROFILE = 10_000_000  # bytes
LARGEST_TRACK = 100_000_000  # bytes: about 400 km at 0.25 m
LARGEST_CHECKPOINT = 2**30  # bytes; one of 64 trains has about 50 MB
LONGEST_LINE = 10_000  # characters of a profile or a track
LARGEST_NUMBER, SMALLEST_NUMBER = 1e15, 1e-15
"""Magnitudes of any number of a scenario but zero: products of several of them stay within double precision."""

OVERFLOWING = 1e300

DEEPEST = 20  # levels of nested tables and lists
LONGEST_KEY = 1000  # characters: presets are stored under their paths
WHOLE = 2**63  # TOML's whole numbers have 64 bits
LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{DEEPEST}}}""", flags=re.ASCII
)
"""A dotted key: tomllib takes the square of its length, a minute for 100 kB."""
UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")


def check_regular(path: str | Path, where: str, largest: int) -> None:
    """Refuse anything but a regular file of bounded size.

    Args:
        path: The file; links are followed.
        where: Its name for messages.
        largest: Greatest size [bytes].

    Raises:
        InputError: The file does not exist, is a folder, a device or a pipe, or is too large.
    """
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise InputError(f"{where}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if not stat.S_ISREG(found.st_mode):
        what = "a folder" if stat.S_ISDIR(found.st_mode) else "a device or a pipe"
        raise InputError(f"{where}: cannot be read (is {what}; must be a regular file)")
    if found.st_size > largest:
        raise InputError(
            f"{where}: {found.st_size / 1e6:g} MB, larger than {largest / 1e6:g} MB, which no such file is"
        )


def read_bytes(path: str | Path, where: str, largest: int) -> bytes:
    """Contents of a regular file of bounded size.

    Args:
        path: The file.
        where: Its name for messages.
        largest: Greatest size [bytes].

    Raises:
        InputError: The file cannot be read, or see :func:`check_regular`.
    """
    check_regular(path, where, largest)
    try:
        with open(path, "rb") as file:
            data = file.read(largest + 1)  # the file may have grown since
    except OSError as error:
        raise InputError(f"{where}: cannot be read ({error.strerror or error})") from None
    if len(data) > largest:
        raise InputError(f"{where}: larger than {largest / 1e6:g} MB, which no such file is")
    return data


def read_text_file(path: str | Path, where: str, largest: int) -> str:
    """Read a text file of bounded size, UTF-8 or UTF-16 with a byte-order mark, else Latin-1.

    Args:
        path: The file.
        where: Its name for messages.
        largest: Greatest size [bytes].

    Raises:
        InputError: The file cannot be read, is too large, is no text, or has an overlong line.
    """
    data = read_bytes(path, where, largest)
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data = data.decode("utf-16", errors="replace").encode()
    if b"\0" in data:
        raise InputError(f"{where}: line {data[: data.index(0)].count(10) + 1}: not a text file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > LONGEST_LINE:
            raise InputError(f"{where}: line {number}: {len(line)} characters; at most {LONGEST_LINE} expected")
    return text


def numbers_of(fields: Sequence[str]) -> list[float] | None:
    """The fields as numbers, None if one is not.

    Args:
        fields: Texts. ``1_000`` and non-ASCII digits, which Python's ``float`` accepts, are not numbers; a magnitude
            that a change of units might take beyond double precision becomes infinite.
    """
    if any("_" in field or not field.isascii() for field in fields):
        return None
    try:
        return [math.copysign(math.inf, x) if abs(x) > OVERFLOWING else x for x in map(float, fields)]
    except ValueError:
        return None


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Tables of a TOML text; arrays become tuples.

    Args:
        text: The text.
        where: Its name for messages.

    Raises:
        InputError: It is not TOML, nested too deep, or holds a value no scenario has.
    """
    try:
        tables = plain_toml(text, where)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        message = " ".join(str(error).split())
        raise InputError(f"{where}: not valid TOML: {message[:1].lower()}{message[1:]}") from None
    try:
        return {key: to_tuples(value, key) for key, value in tables.items()}
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def plain_toml(text: str, where: str) -> dict[str, Any]:
    """Tables as tomllib gives them, nesting bounded.

    Args:
        text: The text.
        where: Its name for messages.

    Raises:
        ValueError: It is not TOML, or a whole number has thousands of digits.
        InputError: It is nested too deep.
    """
    if (found := LONG_KEY.search(text)) is not None:
        line = text[: found.start()].count("\n") + 1
        raise InputError(f"{where}: line {line}: a key of more than {DEEPEST} parts, which no scenario has")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{where}: not valid TOML: nested deeper than {DEEPEST} tables and lists") from None


def to_tuples(value: Any, where: str = "", depth: int = 0) -> Any:
    """Turn every list into a tuple, at any depth, and refuse values that no scenario holds.

    Args:
        value: A number, a text, a truth value, a list or a table of such.
        where: Its key for messages.
        depth: Number of enclosing tables and lists.

    Raises:
        InputError: A number that is not finite or out of all bounds, a text with control characters, a date, or tables
            nested too deep; the message names the key.
    """
    if depth > DEEPEST:
        raise InputError(f"{where[:80]}: nested deeper than {DEEPEST} tables and lists")
    match value:
        case dict():
            for key in value:
                if not isinstance(key, str) or len(key) > LONGEST_KEY or UNPRINTABLE.search(key):
                    rule = f"must be a printable text of at most {LONGEST_KEY} characters"
                    raise InputError(f"{where[:80]}: key {str(key)[:80]!r}: {rule}")
            return {key: to_tuples(item, f"{where}.{key}".lstrip("."), depth + 1) for key, item in value.items()}
        case list() | tuple():
            return tuple(to_tuples(item, f"{where}[{i}]", depth + 1) for i, item in enumerate(value))
        case bool() | None:
            return value
        case int():
            if not -WHOLE <= value < WHOLE:
                raise InputError(f"{where}: a whole number of {value.bit_length()} bits; must have at most 64")
        case float():
            if value != 0.0 and not SMALLEST_NUMBER <= abs(value) <= LARGEST_NUMBER:
                rule = f"must be a finite number, 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} in magnitude"
                raise InputError(f"{where} = {value}: {rule}")
        case str():
            if (found := UNPRINTABLE.search(value)) is not None:
                raise InputError(f"{where} = {value[:40]!r}: must not hold the control character {found[0]!r}")
        case _ if type(value).__module__ == "datetime":
            raise InputError(f"{where} = {value}: must not be a date or time")
    return value


def user_path(text: str, folder: Path | None, called: str) -> Path:
    """Path of a user file.

    Args:
        text: Absolute, or relative to ``folder``; ``~`` is the home folder.
        folder: The folder of the scenario file; the working directory if None.
        called: Its name for messages.

    Raises:
        InputError: ``~`` has no home folder.
    """
    try:
        return (folder or Path()) / Path(text).expanduser()
    except RuntimeError as error:
        raise InputError(f"{called} = {text!r}: {error}") from None


def is_file(path: Path) -> bool:
    """Whether a regular file exists; False for names that no file can have.

    Args:
        path: The path.
    """
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def load_toml(path: Path | str) -> dict[str, Any]:
    """Read a TOML file; arrays become tuples, since parameters are frozen.

    Args:
        path: The file.

    Returns:
        The tables, nested; numbers, texts, booleans and tuples.

    Raises:
        InputError: The file is missing, unreadable, too large or not TOML; the message names file and line.
    """
    return parse_toml(read_text(path), str(path))


def read_text(path: Path | str) -> str:
    """Contents of a text file.

    Args:
        path: The file.

    Raises:
        InputError: The file is missing, no regular file, too large or not UTF-8.
    """
    try:
        return read_bytes(path, str(path), LARGEST_TOML).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a UTF-8 text file") from None
