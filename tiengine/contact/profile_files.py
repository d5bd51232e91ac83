"""Profiles from files: SIMPACK ``.prw`` and ``.prr``, MiniProf ``.whl`` and ``.ban``, columns of text.

The suffix selects the reader. Text and MiniProf hold millimetres or metres, distinguished by the profile's width unless
a header row states the unit. No content is ever evaluated. How a file was interpreted is reported as a warning of class
:class:`tiengine.parameters.errors.InputNote` wherever its format left a choice.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tiengine.contact.column_files import Lines, read_columns
from tiengine.contact.miniprof_files import read_miniprof
from tiengine.contact.point_list import FEWEST_POINTS, Kind, PointList, without_repeats
from tiengine.contact.profile_frame import oriented
from tiengine.contact.simpack_files import read_simpack
from tiengine.parameters.errors import InputError, InputNote
from tiengine.parameters.input_files import LARGEST_PROFILE, read_text_file

__all__ = ["FORMATS", "MOST_POINTS", "read_profile"]

MOST_POINTS = 20_000  # laser scans have some thousand
WIDTH = {"wheel": (50.0, 400.0), "rail": (20.0, 400.0)}  # mm: a tread with its flange, half a head
HIGHEST = 400.0  # mm by which a point may stand out from the others
MOST_NOTES = 5  # of one file


def read_profile(path: str | Path, kind: Kind, where: str = "") -> PointList:
    """Read the points of a file and orient them.

    Args:
        path: A file; its suffix selects the format, columns of text for any suffix not in :data:`FORMATS`.
        kind: ``"wheel"`` or ``"rail"``.
        where: Name of the profile for messages; kind and path if empty.

    Returns:
        y and z in mm, y outward and z down, as a wheel's flange or a rail's head shows.

    Raises:
        InputError: The file breaks a rule; the message names the file, the line and the rule.
    """
    where = where or f"{kind} profile {str(path)!r}"
    lines = list(enumerate(read_text_file(path, where, LARGEST_PROFILE).splitlines(), start=1))
    found = without_repeats(FORMATS.get(Path(path).suffix.lower(), read_columns)(lines, kind, where))
    if len(found.points) < FEWEST_POINTS:
        raise InputError(f"{where}: {len(found.points)} points; at least {FEWEST_POINTS} pairs expected")
    if len(found.points) > MOST_POINTS:
        raise InputError(f"{where}: {len(found.points)} points; at most {MOST_POINTS} expected")
    width = float(np.ptp(found.points[:, 0]))
    least, most = WIDTH[kind]
    if not least <= width <= most:
        raise InputError(
            f"{where}: {width:g} mm wide; {least:g} to {most:g} mm expected: are its units right?"
            " A header row such as 'y [in]; z [in]' states the unit of columns of text"
        )
    away = np.abs(found.points[:, 1] - np.median(found.points[:, 1]))
    if away.max() > HIGHEST:
        i = int(np.argmax(away))
        raise InputError(
            f"{where}: line {found.lines[i]}: z lies {away[i]:g} mm from the other points';"
            f" at most {HIGHEST:g} mm expected"
        )
    for note in found.notes[:MOST_NOTES]:
        warnings.warn(f"{where}: {note}", InputNote, stacklevel=2)
    return oriented(found, kind)


FORMATS: dict[str, Callable[[Lines, Kind, str], PointList]] = {
    ".prw": read_simpack,
    ".prr": read_simpack,
    ".whl": read_miniprof,
    ".ban": read_miniprof,
}
"""Readers by suffix."""
