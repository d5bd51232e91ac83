"""Figures as files: their paths, and the reasons for figures that cannot be drawn."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tiengine.figures.catalogue import COMPARE, KINDS, kind_named
from tiengine.figures.style import check_suffix, save
from tiengine.indices.train_record import AbsentError
from tiengine.parameters.errors import InputError
from tiengine.result_files.output_file import check_output

if TYPE_CHECKING:
    from tiengine.result import Result

__all__ = ["draw_all", "draw_one"]


def draw_one(result: Result, kind: str, output: Path | None, train: int = 0, other: Result | None = None) -> Path:
    """Draw one figure into a file, which it replaces.

    Args:
        result: An open file.
        kind: Name of the figure.
        output: File or existing folder; the folder of the result if None.
        train: Number of the train.
        other: The second result, for ``compare``.

    Returns:
        Path of the figure.

    Raises:
        InputError: The figure cannot be drawn or written.
    """
    path = _path(result, kind, output)
    check_suffix(path)
    check_output(path, force=True)
    if (kind == COMPARE.name) != (other is not None):
        raise InputError(
            "kind = 'compare': needs the second file: --with FILE" if other is None else "--with: only for kind compare"
        )
    arguments = (train,) if other is None else (other, train)
    save(kind_named(kind).draw(result, *arguments), path)
    return path


def draw_all(result: Result, output: Path | None, train: int = 0) -> Iterator[tuple[str, str]]:
    """Draw every figure that the file has the data for, replacing existing files.

    Args:
        result: An open file.
        output: An existing folder; that of the result if None.
        train: Number of the train.

    Yields:
        Name of the kind, and its path or the reason why it is skipped.

    Raises:
        InputError: A figure cannot be written, or there is no such train or folder.
    """
    if output is not None and not output.is_dir():
        raise InputError(f"output = '{output}': must be an existing folder for all kinds; name a kind for one figure")
    for kind in KINDS:
        try:
            yield kind.name, str(draw_one(result, kind.name, output, train))
        except AbsentError as error:
            yield kind.name, f"skipped: {error}"


def _path(result: Result, kind: str, output: Path | None) -> Path:
    """Path of a figure."""
    if output is not None and not output.is_dir():
        return output
    file = Path(result.name)
    return (output or file.parent) / f"{file.stem}_{kind}.png"
