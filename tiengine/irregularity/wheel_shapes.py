"""Wheels out of round: radius deviation over the rotation angle of single wheels (MODEL §14).

The angle is that by which a wheel has turned since the start of the run, so that the tread point at angle 0 touches the
rail there. Deviations are positive outward. All shapes of a wheel add; their sum is tabulated once per different wheel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tiengine.irregularity.patch_filter import felt_shape
from tiengine.irregularity.wave_content import NEGLIGIBLE_SHARE
from tiengine.irregularity.wheel_files import read_polygon
from tiengine.kernels.layout import ROUND_POINTS
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["WheelShape", "WheelTables", "check_wheel_shapes", "flat_depth", "radius_deviation", "wheel_tables"]

SIDES = {"left": (0,), "right": (1,), "both": (0, 1)}
HIGHEST_ORDER = 256  # sixteen points of the table a wave: its cubics are then 2e-4 of the amplitude off at most
NEEDED = {"harmonics": ("order", "amplitude"), "flat": ("length",), "file": ("file",)}
OPTIONAL = {"harmonics": ("phase",), "flat": ("form", "angle"), "file": ("angle", "scale")}

Order = Annotated[int, Q("-", "waves per revolution", ge=1, le=HIGHEST_ORDER)]
Amplitude = Annotated[float, Q("m", "half of crest to trough", ge=0, le=5e-3)]
Phase = Annotated[float, Q("rad", "phase at the start", ge=-1e4, le=1e4)]


class WheelShape(Params):
    """A deviation from the round of single wheels; shapes of the same wheel add.

    `harmonics` is a sum of A cos(n angle + phase). `flat` is a flat of the given length: a `new` one has sharp edges,
    and the wheel's centre falls as it turns about one edge and rises about the other, by length^2/(8 r0) in the middle;
    a `worn` one has the same depth as one wave 1 - cos. `file` is a measured polygon (docs/files.md). Waves that are
    short against the contact patch are weakened as those of rail roughness are. With the irregularity's `taper` the
    shapes grow in from a round wheel at the start.
    """

    kind: Annotated[Literal["harmonics", "flat", "file"], Field(description="shape")]
    wheelsets: Annotated[
        tuple[Annotated[int, Q("-", "number", ge=1, le=1000)], ...] | Literal["all"],
        Field(description="wheelsets that have it, counted from the front of the train from 1"),
    ] = "all"
    side: Annotated[Literal["left", "right", "both"], Field(description="their wheels")] = "both"
    order: Annotated[tuple[Order, ...], Field(description="orders n of harmonics", max_length=HIGHEST_ORDER)] = ()
    amplitude: Annotated[tuple[Amplitude, ...], Field(description="amplitude A of each", max_length=HIGHEST_ORDER)] = ()
    phase: Annotated[
        tuple[Phase, ...], Field(description="phase of each; 0 where none is stated", max_length=HIGHEST_ORDER)
    ] = ()
    length: Annotated[float | None, Q("m", "length of a flat along the tread", gt=0, le=0.2)] = None
    form: Annotated[Literal["new", "worn"], Field(description="edges of a flat: sharp or rolled over")] = "new"
    angle: Annotated[
        float, Q("rad", "turn of the wheel until the middle of a flat, or angle 0 of a file, touches", ge=-1e4, le=1e4)
    ] = 0.0
    file: Annotated[str | None, Field(description="measured polygon, relative to the scenario", max_length=4096)] = None
    scale: Annotated[float, Q("-", "factor on the deviations of a file", ge=-1e3, le=1e3)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> WheelShape:
        needed = NEEDED[self.kind]
        for key in needed:
            if getattr(self, key) in (None, ()):
                raise InputError(f"train.wheel_shapes.{key}: missing; shape {self.kind!r} needs {', '.join(needed)}")
        for key in sorted(self.model_fields_set - {"kind", "wheelsets", "side", *needed, *OPTIONAL[self.kind]}):
            if getattr(self, key) != type(self).model_fields[key].default:
                value = getattr(self, key)
                raise InputError(
                    f"train.wheel_shapes.{key} = {value!r}: must be left out; shape {self.kind!r} has no {key}"
                )
        for key in ("amplitude", "phase"):
            given = getattr(self, key)
            if len(given) != len(self.order) and (given or key == "amplitude"):
                raise InputError(
                    f"train.wheel_shapes.{key} = {list(given)}: must have {len(self.order)} numbers, one per order"
                )
        return self


def flat_depth(length: float, radius: float) -> float:
    """Depth of a flat of the given length [m] on a wheel of the given radius [m]: l^2/(8 r0) but for (l/r0)^4."""
    return radius * (1.0 - float(np.cos(0.5 * length / radius)))


def radius_deviation(shape: WheelShape, radius: float, angle: Reals, where: str = "train.wheel_shapes") -> Reals:
    """Deviation by which a wheel of one shape raises its centre above a rigid rail, before the filter [m].

    Args:
        shape: The shape.
        radius: r0 [m].
        angle: Angles by which the wheel has turned [rad], any shape.
        where: Names the entry in messages.

    Raises:
        InputError: A file breaks a rule, or a flat is too long for the wheel.
    """
    if shape.kind == "harmonics":
        phases = shape.phase or (0.0,) * len(shape.order)
        total = np.zeros(np.shape(angle))
        for n, A, phase in zip(shape.order, shape.amplitude, phases, strict=True):
            total += A * np.cos(n * angle + phase)
        return total
    turned = angle - shape.angle
    if shape.kind == "file":
        assert shape.file is not None
        return shape.scale * read_polygon(shape.file, f"{where}.file")(turned)
    assert shape.length is not None
    half = 0.5 * shape.length / radius
    if half > 0.5:
        raise InputError(f"{where}.length = {shape.length:g}: must be at most r0 = {radius:g} m")
    off = np.minimum(np.abs(np.mod(turned + np.pi, 2.0 * np.pi) - np.pi), half)
    if shape.form == "worn":
        return -0.5 * flat_depth(shape.length, radius) * (1.0 + np.cos(np.pi * off / half))
    return -radius * (1.0 - np.cos(half - off))  # it turns about the nearer edge


@dataclass(frozen=True, eq=False)
class WheelTables:
    """Tables of all wheels out of round.

    Attributes:
        number: Table of each wheel, -1 for a round one, shape (W, 2).
        values: Deviation [m] and its derivative by the angle [m/rad], shape (tables, ROUND_POINTS, 2).
        waves: Shortest wave of each table along the tread [m], and its order.
    """

    number: NDArray[np.int32]
    values: Reals
    waves: tuple[tuple[float, int], ...]

    def name(self, table: int) -> str:
        """The first wheel that has a table, in words."""
        w, side = np.argwhere(self.number == table)[0]
        return f"wheelset {w + 1} {('left', 'right')[side]}"


def wheel_tables(shapes: Sequence[WheelShape], radius: Sequence[float]) -> WheelTables:
    """Tabulate all wheels.

    Args:
        shapes: Entries of the scenario.
        radius: r0 of every wheelset [m], shape (W,).

    Raises:
        InputError: A file breaks a rule, or a flat is too long.
    """
    number = np.full((len(radius), 2), -1, dtype=np.int32)
    angle: Reals = (2.0 * np.pi / ROUND_POINTS * np.arange(ROUND_POINTS)).astype(np.float64)
    felt: dict[tuple[float, tuple[int, ...]], Reals] = {}
    for w, r0 in enumerate(radius):
        for side in range(2):
            own = tuple(i for i, shape in enumerate(shapes) if _has(shape, w, side))
            if not own:
                continue
            key = (float(r0), own)
            if key not in felt:
                parts = [radius_deviation(shapes[i], r0, angle, f"train.wheel_shapes[{i}]") for i in own]
                felt[key] = felt_shape(np.sum(parts, axis=0), 2.0 * np.pi * r0 / ROUND_POINTS)
            number[w, side] = list(felt).index(key)
    values = np.zeros((len(felt), ROUND_POINTS, 2))
    waves = []
    for table, ((r0, _), deviation) in enumerate(felt.items()):
        waves_of = np.fft.rfft(deviation)
        order = np.arange(len(waves_of))
        values[table, :, 0] = deviation
        values[table, :, 1] = np.fft.irfft(1j * order * waves_of, ROUND_POINTS)
        highest = _highest_order(waves_of)
        waves.append((2.0 * np.pi * r0 / highest, highest))
    return WheelTables(number, values, tuple(waves))


def _has(shape: WheelShape, w: int, side: int) -> bool:
    """Whether a wheel has a shape."""
    return (shape.wheelsets == "all" or w + 1 in shape.wheelsets) and side in SIDES[shape.side]


def _highest_order(waves: NDArray[np.complex128]) -> int:
    """Order beyond which a negligible share of the slope's variance lies, as for a measured track."""
    power = (np.arange(len(waves)) * np.abs(waves)) ** 2
    beyond = np.cumsum(power[::-1])[::-1]
    kept = np.flatnonzero(beyond > NEGLIGIBLE_SHARE * beyond[0])
    return max(int(kept[-1]), 1) if kept.size else 1


def check_wheel_shapes(shapes: Sequence[WheelShape], wheelsets: int) -> None:
    """Refuse shapes of wheelsets that the train does not have.

    Args:
        shapes: Entries of the scenario.
        wheelsets: Wheelsets of the train.

    Raises:
        InputError: Names the entry, its value and the range.
    """
    for i, shape in enumerate(shapes):
        if shape.wheelsets != "all" and (not shape.wheelsets or max(shape.wheelsets) > wheelsets):
            raise InputError(
                f"train.wheel_shapes[{i}].wheelsets = {list(shape.wheelsets)}: must be numbers from 1 to {wheelsets},"
                ' or "all"'
            )
