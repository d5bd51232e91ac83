"""Shapes of single rails by chainage: corrugation, welds, joints, a series from a file (MODEL §14).

They add to the vertical irregularity of one rail or both. A shape of one rail moves that rail's head alone: it is not a
cross level, and turns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Protocol

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import CubicSpline

from tiengine.irregularity.measured_files import read_series
from tiengine.irregularity.measured_track import smooth_step
from tiengine.irregularity.patch_filter import felt_shape, felt_wave
from tiengine.irregularity.wave_content import shortest_content
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["Heights", "RailShape", "RailShapes", "SettledRail", "check_rail_shapes"]

SIDES = {"left": (0,), "right": (1,), "both": (0, 1)}
STEP = 1e-3  # m between the points of a filtered shape: a sixth of the patch
MARGIN = 0.5  # m beyond a weld or joint, where the filter's tail has fallen to 1e-6 of the depth
END = 0.1  # m over which what is left of the tail fades
MOST_POINTS = 4_000_000  # of a filtered series
NEEDED = {
    "corrugation": ("reach", "wavelength", "depth"),
    "weld": ("at", "length", "depth"),
    "joint": ("at", "length", "depth"),
    "file": ("file",),
}
OPTIONAL = {"corrugation": ("phase", "taper"), "file": ("taper", "scale")}

Chainage = Annotated[float, Q("m", "chainage", ge=0, le=1e7)]


class RailShape(Params):
    """A shape of the running surface of one rail or both, down positive; it adds to the irregularity.

    `corrugation` is a sine over `reach` that grows and fades over `taper`; `weld` one wave 1 - cos; `joint` two
    straight ramps that meet at an angle. A negative depth stands up: a raised weld, a peaked joint. `file` is a series
    with the columns `x` and `vertical`, as a measured track has them (docs/files.md). Waves that are short against the
    contact patch are weakened as those of rail roughness are.
    """

    kind: Annotated[Literal["corrugation", "weld", "joint", "file"], Field(description="shape")]
    rail: Annotated[Literal["left", "right", "both"], Field(description="rail that has it")] = "both"
    reach: Annotated[tuple[Chainage, Chainage] | None, Field(description="where a corrugation begins and ends")] = None
    wavelength: Annotated[float | None, Q("m", "wavelength of a corrugation", gt=0, le=100)] = None
    depth: Annotated[
        float | None, Q("m", "trough below crest of a corrugation; depth of a weld or joint", ge=-0.05, le=0.05)
    ] = None
    phase: Annotated[float, Q("rad", "phase of a corrugation where it begins", ge=-1e4, le=1e4)] = 0.0
    at: Annotated[float | None, Q("m", "chainage of the middle of a weld or joint", ge=0, le=1e7)] = None
    length: Annotated[float | None, Q("m", "length of a weld or joint", ge=0.01, le=50)] = None
    taper: Annotated[float, Q("m", "length over which a corrugation or file grows and fades", gt=0, le=1e4)] = 1.0
    file: Annotated[
        str | None, Field(description="series of chainage and height, relative to the scenario", max_length=4096)
    ] = None
    scale: Annotated[float, Q("-", "factor on the heights of a file", ge=-1e3, le=1e3)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> RailShape:
        needed, kept = NEEDED[self.kind], ("kind", "rail")
        for key in needed:
            if getattr(self, key) is None:
                raise InputError(f"track.rail_shapes.{key}: missing; a {self.kind} needs {', '.join(needed)}")
        for key in sorted(self.model_fields_set - {*kept, *needed, *OPTIONAL.get(self.kind, ())}):
            if getattr(self, key) != type(self).model_fields[key].default:
                raise InputError(
                    f"track.rail_shapes.{key} = {getattr(self, key)!r}: must be left out; a {self.kind} has no {key}"
                )
        if self.reach is not None and not self.reach[0] < self.reach[1]:
            raise InputError(f"track.rail_shapes.reach = {list(self.reach)}: must be [from, to] with from < to")
        return self


class Heights(Protocol):
    """Height of a running surface and its slope at chainages, and its shortest wave."""

    shortest: float

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Heights [m] and slopes at chainages [m], shape (n,) each."""


class _Corrugation:
    """A sine of one length; the taper is at most half of its reach."""

    def __init__(self, shape: RailShape) -> None:
        assert shape.reach is not None
        assert shape.wavelength is not None
        assert shape.depth is not None
        self.start, self.end = shape.reach
        self.shortest, self._phase = shape.wavelength, shape.phase
        self._amplitude = 0.5 * shape.depth * felt_wave(shape.wavelength)
        self._Omega = 2.0 * np.pi / shape.wavelength
        self._taper = min(shape.taper, 0.5 * (self.end - self.start))

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Heights [m] and slopes at chainages [m], shape (n,) each."""
        angle = self._Omega * (x - self.start) + self._phase
        wave, slope = self._amplitude * np.sin(angle), self._amplitude * self._Omega * np.cos(angle)
        up, up_slope = smooth_step((x - self.start) / self._taper)
        down, down_slope = smooth_step((self.end - x) / self._taper)
        T, T_slope = up * down, (up_slope * down - up * down_slope) / self._taper
        return wave * T, slope * T + wave * T_slope


class _Sampled:
    """A spline through filtered heights that are zero at both ends."""

    def __init__(self, x: Reals, z: Reals) -> None:
        self.start, self.end = float(x[0]), float(x[-1])
        ends = smooth_step((x - self.start) / END)[0] * smooth_step((self.end - x) / END)[0]
        felt = felt_shape(z, float(x[1] - x[0])) * ends
        self.shortest = shortest_content(np.column_stack([x, felt]), np.ones(1))
        self._value = CubicSpline(x, felt, bc_type="natural")
        self._slope = self._value.derivative()

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Heights [m] and slopes at chainages [m], shape (n,) each."""
        inside = (x > self.start) & (x < self.end)
        clipped = np.clip(x, self.start, self.end)
        return np.where(inside, self._value(clipped), 0.0), np.where(inside, self._slope(clipped), 0.0)


def _place(shape: RailShape) -> _Sampled:
    """A weld or a joint."""
    assert shape.at is not None
    assert shape.length is not None
    assert shape.depth is not None
    half = 0.5 * shape.length
    count = int(np.ceil((half + MARGIN) / STEP))
    s = STEP * np.arange(-count, count + 1)
    t = np.minimum(np.abs(s) / half, 1.0)
    form = 0.5 * (1.0 + np.cos(np.pi * t)) if shape.kind == "weld" else 1.0 - t
    return _Sampled(np.asarray(shape.at + s, np.float64), shape.depth * form)


def _series(shape: RailShape, where: str) -> _Sampled:
    """A file, at steps short enough for the filter, tapered at both ends."""
    assert shape.file is not None
    values = read_series(shape.file, key=f"{where}.file").values
    x, z = values[:, 0], shape.scale * values[:, 1]
    step = min(float(np.diff(x).min()), 2.0 * STEP)
    count = int(np.ceil((x[-1] - x[0]) / step)) + 1
    if count > MOST_POINTS:
        raise InputError(f"{where}.file = {shape.file!r}: {count} steps of {step:g} m; must be at most {MOST_POINTS}")
    even = np.linspace(x[0], x[-1], count)
    fitted = CubicSpline(x, z, bc_type="natural")(even)
    taper = min(shape.taper, 0.5 * (x[-1] - x[0]))
    grown = smooth_step((even - x[0]) / taper)[0] * smooth_step((x[-1] - even) / taper)[0]
    return _Sampled(even, fitted * grown)


class SettledRail:
    """Static shape of both rails over displaced ground; what it has at its front end it keeps."""

    shortest = float("inf")

    def __init__(self, shape: CubicSpline) -> None:
        """Keep the shape.

        Args:
            shape: Down and to the right [m] over chainage [m]; zero before it begins.
        """
        self._start, self._end = float(shape.x[0]), float(shape.x[-1])
        self._value, self._slope = shape, shape.derivative()

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Heights [m] and slopes at chainages [m], shape (n,) each."""
        value, slope = self.both(x)
        return value[:, 0], slope[:, 0]

    def both(self, x: Reals) -> tuple[Reals, Reals]:
        """Displacements down and to the right [m] and their slopes at chainages [m], shape (n, 2) each."""
        clipped = np.clip(x, self._start, self._end)
        begun, inside = x > self._start, (x > self._start) & (x < self._end)
        value = np.where(begun[:, None], self._value(clipped), 0.0)
        return value, np.where(inside[:, None], self._slope(clipped), 0.0)


class RailShapes:
    """All shapes of both rails.

    Attributes:
        waves: Shortest wave of each shape [m], in the order of the scenario.
    """

    def __init__(
        self, shapes: Sequence[RailShape], settled: Sequence[SettledRail] = (), laid: Sequence[Heights] = ()
    ) -> None:
        """Read files and filter shapes.

        Args:
            shapes: Entries of the scenario.
            settled: Shapes of both rails over displaced ground.
            laid: Shapes that the state at rest of a bed without tension leaves to the left and the right rail.

        Raises:
            InputError: A file breaks a rule.
        """
        made: list[tuple[RailShape, Heights]] = []
        for i, shape in enumerate(shapes):
            where = f"track.rail_shapes[{i}]"
            made.append((shape, _made(shape, where)))
        self.waves = tuple(heights.shortest for _, heights in made)
        self._settled = tuple(settled)
        self._sides = tuple(
            [*(heights for shape, heights in made if side in SIDES[shape.rail]), *settled, *laid[side : side + 1]]
            for side in range(2)
        )

    def sample(self, x: Reals) -> tuple[Reals, Reals]:
        """Heights [m] and slopes of the left and right rail at chainages [m] of any shape; shape (..., 2) each."""
        flat = np.asarray(x, np.float64).reshape(-1)
        value, slope = np.zeros((flat.size, 2)), np.zeros((flat.size, 2))
        for side, shapes in enumerate(self._sides):
            for shape in shapes:
                v, s = shape.evaluate(flat)
                value[:, side] += v
                slope[:, side] += s
        return value.reshape(*np.shape(x), 2), slope.reshape(*np.shape(x), 2)

    def lateral(self, x: Reals) -> tuple[Reals, Reals]:
        """Displacement of both rails to the right over displaced ground [m] and its slope, shape as x each."""
        flat = np.asarray(x, np.float64).reshape(-1)
        both = [settled.both(flat) for settled in self._settled]
        value, slope = (sum((each[k][:, 1] for each in both), np.zeros(flat.size)) for k in range(2))
        return value.reshape(np.shape(x)), slope.reshape(np.shape(x))


def _made(shape: RailShape, where: str) -> Heights:
    """Heights of one shape."""
    if shape.kind == "corrugation":
        return _Corrugation(shape)
    return _series(shape, where) if shape.kind == "file" else _place(shape)


def check_rail_shapes(shapes: Sequence[RailShape], *, begin: float, end: float) -> None:
    """Refuse shapes that no wheel reaches.

    Args:
        shapes: Entries of the scenario.
        begin: Chainage of the leading wheel at the start [m].
        end: Its chainage at the end of the run [m].

    Raises:
        InputError: Names the entry, its value and the range.
    """
    for i, shape in enumerate(shapes):
        if shape.kind == "corrugation" and shape.reach is not None:
            key, first, last = "reach", shape.reach[0], shape.reach[1]
        elif shape.at is not None and shape.length is not None:
            key, first, last = "at", shape.at - 0.5 * shape.length, shape.at + 0.5 * shape.length
        else:
            continue
        if last <= begin or first >= end:
            value = list(shape.reach) if shape.reach is not None else shape.at
            raise InputError(
                f"track.rail_shapes[{i}].{key} = {value}: must lie between {begin:g} and {end:g} m, which the leading"
                " wheel covers in this run"
            )
