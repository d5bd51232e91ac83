"""Profiles of a scenario: a table with the points as text, made from a file when the scenario is loaded.

The table holds ``points``, the text of two columns (y and z in mm), so that a resolved scenario needs no other files.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from tiengine.contact.point_list import ROUNDING_LENGTH, Kind, Placement, PointList
from tiengine.contact.profile import Profile
from tiengine.contact.profile_files import MOST_POINTS, read_profile
from tiengine.contact.profile_frame import mirrored, placed
from tiengine.contact.profile_kinks import check_kinks
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import numbers_of
from tiengine.parameters.quantity import Name, Params, Q, Source, build

__all__ = ["ProfilePoints", "build_profile", "profile_table"]


class ProfilePoints(Params):
    """A wheel's or a rail's profile as a table; docs/files.md explains when a key must be stated."""

    name: Name = "profile"
    source: Source = ""
    points: Annotated[str, Field(description="y and z in mm, one pair per line")]
    has_cant: Annotated[
        bool | None, Field(description="whether a rail's points are those of a rail already inclined")
    ] = None
    smoothing: Annotated[float, Q("m", "length of the smoothing spline", ge=0, le=5e-3)] = ROUNDING_LENGTH
    mirror: Annotated[bool | None, Field(description="whether the rail's gauge face is at positive y")] = None
    tape_circle: Annotated[
        float | None, Q("m", "distance of a wheel's tape circle outward from the points' y = 0", ge=-0.2, le=0.2)
    ] = None
    allow_kinks: Annotated[
        bool, Field(description="accept kinks of a file's surface where wheel and rail can touch")
    ] = False
    rail_axis: Annotated[float | None, Q("m", "y of the points at an upright rail's axis", ge=-0.2, le=0.2)] = None

    @property
    def placement(self) -> Placement:
        """Statements about the points."""
        return Placement(self.has_cant, self.smoothing, self.mirror, self.tape_circle, self.allow_kinks, self.rail_axis)


def profile_table(path: Path, kind: Kind, where: str, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Table of a profile from a file, which is read, placed and checked with the file's lines in messages.

    Args:
        path: The file.
        kind: ``"wheel"`` or ``"rail"``.
        where: Key and value of the scenario for messages.
        stated: Keys that the scenario states of this profile; others than those of a placement are ignored.

    Returns:
        ``name`` and ``points``, oriented but not placed.

    Raises:
        InputError: The file breaks a rule, or its shape contradicts what is stated.
    """
    keys = Placement.__dataclass_fields__
    known = {key: value for key, value in stated.items() if key in keys}
    placement = build(ProfilePoints, {"points": "", **known}, where.split(" = ")[0]).placement
    found = read_profile(path, kind, where)
    placed(found, kind, placement)
    check_kinks(mirrored(found, kind, placement), kind, placement)
    return {"name": path.stem, "points": "\n".join(f"{y:.12g} {z:.12g}" for y, z in found.points)}


def build_profile(table: Mapping[str, Any], where: str, kind: Kind) -> Profile:
    """Build a profile from its table.

    Args:
        table: Keys of :class:`ProfilePoints`.
        where: Key of the scenario for messages.
        kind: ``"wheel"`` or ``"rail"``.

    Raises:
        InputError: A value breaks a rule, or the points' shape contradicts what is stated.
    """
    stated = build(ProfilePoints, table, where)
    lines = stated.points.strip().splitlines()
    rows = [numbers_of(line.replace(",", " ").replace(";", " ").split()) for line in lines]
    if len(rows) > MOST_POINTS:
        raise InputError(f"{where}: {len(rows)} points; at most {MOST_POINTS} expected")
    if not all(row is not None and len(row) == 2 for row in rows):
        raise InputError(f"{where}: every line of its points must hold two numbers, y and z in mm")
    listed = PointList(np.array(rows, dtype=np.float64).reshape(-1, 2), np.arange(1, len(rows) + 1), where)
    points = placed(listed, kind, stated.placement)
    return Profile(stated.name, kind, points[:, 0].copy(), points[:, 1].copy(), bool(stated.has_cant), stated.smoothing)
