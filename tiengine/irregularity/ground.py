"""Ground that has settled, heaved or slid under the slabs: its shape over chainage (MODEL §14)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from tiengine.irregularity.measured_files import read_series
from tiengine.irregularity.measured_track import MeasuredTrack
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["LATERAL", "VERTICAL", "Ground", "check_ground", "ground_shape", "reach_of"]

VERTICAL, LATERAL = 0, 1
"""Directions of a displacement of the ground: down, to the right."""

FORMS = {
    "cosine": lambda s: 0.5 * (1.0 + np.cos(np.pi * np.minimum(np.abs(s), 1.0))),
    "angles": lambda s: 1.0 - np.minimum(np.abs(s), 1.0),
    "ramp": lambda s: 0.5 * (1.0 + np.clip(s, -1.0, 1.0)),
}
"""Displacement of each kind over its amplitude, by the place s from -1 at its rear end to 1 at its front end."""


class Ground(Params):
    """A displacement of the ground under the slabs: a settlement, a heave (negative depth), a slide to one side.

    `cosine` is one wave depth (1 + cos)/2; `angles` are two straight ramps that meet in the middle, as where a pier has
    sunk between its neighbours; `ramp` is one straight ramp, with an angle at either end, behind which the ground stays
    displaced. `file` is a series with the columns `x`, `vertical` (down positive) and `alignment` (to the right), one
    of these or both, as a measured track has them (docs/files.md). Slabs and rails follow with their stiffness; on a
    bed that transmits no tension slabs may bridge a part of it and leave a gap. Entries add.
    """

    kind: Annotated[Literal["cosine", "angles", "ramp", "file"], Field(description="shape")]
    at: Annotated[float | None, Q("m", "chainage of the middle", ge=0, le=1e7)] = None
    length: Annotated[float | None, Q("m", "length of the whole displacement, or of the ramp", ge=1, le=500)] = None
    depth: Annotated[float, Q("m", "largest displacement downwards; negative for a heave", ge=-0.2, le=0.2)] = 0.0
    lateral: Annotated[float, Q("m", "largest displacement to the right; negative: left", ge=-0.2, le=0.2)] = 0.0
    file: Annotated[
        str | None, Field(description="series of chainage and displacement, relative to the scenario", max_length=4096)
    ] = None
    taper: Annotated[float, Q("m", "length over which a file grows and fades", gt=0, le=1e4)] = 10.0
    scale: Annotated[float, Q("-", "factor on the displacements of a file", ge=-1e3, le=1e3)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> Ground:
        of_file = self.kind == "file"
        needed = ("file",) if of_file else ("at", "length")
        for key in needed:
            if getattr(self, key) is None:
                raise InputError(f"track.ground.{key}: missing; kind = '{self.kind}' needs {', '.join(needed)}")
        if not of_file and self.depth == 0.0 and self.lateral == 0.0:
            raise InputError(f"track.ground.depth: missing; kind = '{self.kind}' needs depth, lateral or both")
        own = ("taper", "scale", "file") if of_file else ("at", "length", "depth", "lateral")
        for key in sorted(self.model_fields_set - {"kind", *own}):
            if getattr(self, key) != type(self).model_fields[key].default:
                raise InputError(
                    f"track.ground.{key} = {getattr(self, key)!r}: must be left out with kind = '{self.kind}'"
                )
        return self


def reach_of(ground: Ground) -> tuple[float, float]:
    """Chainage of the ends of a displacement [m]; behind the front end of a ramp it stays as it is there.

    Args:
        ground: Entry of the scenario; its file is read.
    """
    if ground.file is not None:
        series = _series(ground)
        return series.start, series.end
    assert ground.at is not None
    assert ground.length is not None
    return ground.at - 0.5 * ground.length, ground.at + 0.5 * ground.length


def ground_shape(ground: Ground, x: Reals, direction: int = VERTICAL) -> Reals:
    """Displacement of the ground at chainages [m], down or to the right, shape as x.

    Args:
        ground: Entry of the scenario; its file is read once.
        x: Chainages [m].
        direction: ``VERTICAL`` or ``LATERAL``.

    Raises:
        InputError: The file breaks a rule.
    """
    if ground.file is not None:
        values = _series(ground).evaluate(np.asarray(x, np.float64).reshape(-1))[0][:, direction]
        return np.asarray(ground.scale * values.reshape(np.shape(x)), np.float64)
    assert ground.at is not None
    assert ground.length is not None
    largest = ground.lateral if direction == LATERAL else ground.depth
    return np.asarray(largest * FORMS[ground.kind]((x - ground.at) / (0.5 * ground.length)), np.float64)


def _series(ground: Ground) -> MeasuredTrack:
    """The file of an entry; read again if it has changed."""
    assert ground.file is not None
    try:
        changed = Path(ground.file).stat().st_mtime_ns
    except (OSError, ValueError):
        changed = 0  # the reader says what is wrong
    return _read(ground.file, ground.taper, changed)


@lru_cache(maxsize=16)
def _read(path: str, taper: float, changed: int) -> MeasuredTrack:
    """Read a file as it was changed at a time [ns]."""
    return MeasuredTrack(read_series(path, key="track.ground.file").values, taper)


def check_ground(entries: Sequence[Ground], *, begin: float, end: float) -> None:
    """Refuse displacements that no wheel reaches.

    Args:
        entries: Entries of the scenario.
        begin: Chainage of the leading wheel at the start [m].
        end: Its chainage at the end of the run [m].

    Raises:
        InputError: Names the entry, its value and the rule.
    """
    for i, each in enumerate(entries):
        if each.file is not None:
            continue
        rear, front = reach_of(each)
        if front <= begin or rear >= end:
            raise InputError(
                f"track.ground[{i}].at = {each.at:g}: must lie between {begin:g} and {end:g} m, which the leading"
                " wheel covers in this run"
            )
