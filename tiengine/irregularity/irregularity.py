"""Track irregularity as a function of chainage (MODEL §6).

Channels, in this order: vertical z_v [m], alignment y_a [m], cross level theta [rad], gauge g [m], then their
slopes by chainage. With sigma = -1 on the left and +1 on the right, the railheads lie at
z = z_v + sigma b_i theta and y = y_a + sigma g/2, b_i = 0.75 m.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Protocol

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from tiengine.irregularity.measured_files import MeasuredSeries, read_series
from tiengine.irregularity.measured_track import MeasuredTrack, smooth_step
from tiengine.irregularity.patch_filter import PATCH_HALF_LENGTH
from tiengine.irregularity.random_track import BlockSpline, noise_spline
from tiengine.irregularity.spectrum import (
    CHANNELS,
    Density,
    contact_filter,
    load_roughness,
    load_spectrum,
    spectrum_names,
)
from tiengine.irregularity.track_columns import FileColumns
from tiengine.irregularity.track_function import TrackFunction
from tiengine.irregularity.track_text import Encoding
from tiengine.irregularity.wave_content import band_passed, shortest_content
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.quantity import Params, Q

__all__ = [
    "HALF_BASE",
    "Irregularity",
    "IrregularityParams",
    "at_wheels",
    "make_irregularity",
]

HALF_BASE = 0.75
"""b_i [m]: half the distance over which the cross level is an angle."""

_ROUGHNESS_BLOCK = 64.0  # m, half a block at least: a train then lies in a few blocks, not hundreds
_RAIL_SCALES = np.array([1.0, 1.0, HALF_BASE, 0.5])  # of z_v, y_a, theta, gauge to the displacement of a rail
_MOST_BANDWIDTH = 1e4  # longest over shortest wave; a block then takes 40 MB


class IrregularityParams(Params):
    """Parameters of the track irregularity; a ``file`` replaces the ``spectrum``.

    A Python function replaces both: ``tiengine.run(scenario, irregularity=f)`` sets ``function`` to its name, which
    records in the result that the track was given by a function; it cannot be run from a file.

    The columns of a file and the keys ``file_...`` are described in docs/files.md.

    ``short_wave`` adds the ISO 3095 limit to the vertical of each rail, from its longest band (0.45 m) or
    ``wavelength_min``, whichever is shorter, down to ``short_wave_min``.
    """

    spectrum: Annotated[
        str, Field(description='preset of kind irregularity (`tiengine list irregularity`), or "none"')
    ] = "german_low"
    seed: Annotated[int, Q("-", "selects the realisation", ge=0, le=2**63 - 1)] = 1
    wavelength_min: Annotated[float, Q("m", "shortest wave of the spectrum", gt=0, le=1e4)] = 1.0
    wavelength_max: Annotated[float, Q("m", "longest wave of the spectrum", gt=0, le=1e4, validate_default=True)] = (
        120.0
    )
    two_sided: Annotated[
        bool, Field(description="the constants of the spectrum are read as those of a two-sided density")
    ] = False
    scale: Annotated[float, Q("-", "factor on all amplitudes", ge=0)] = 1.0
    percentile: Annotated[float | None, Q("-", "percentile of the Chinese spectrum; 0.632 is its mean", gt=0, lt=1)] = (
        None
    )
    short_wave: Annotated[bool, Field(description="adds rail roughness at the ISO 3095 limit, see above")] = False
    short_wave_min: Annotated[float, Q("m", "shortest wave of the rail roughness", gt=0, validate_default=True)] = 0.08
    taper: Annotated[float, Q("m", "length over which the irregularity grows to full amplitude", gt=0)] = 30.0
    file: Annotated[
        str | None,
        Field(description="measured track as CSV (docs/files.md), relative to the scenario", max_length=4096),
    ] = None
    function: Annotated[
        str | None, Field(description="name of the Python function that gives the track; set by `tiengine.run`")
    ] = None
    file_columns: FileColumns = FileColumns()
    file_encoding: Annotated[Encoding, Field(description='"auto" detects UTF-8, UTF-16, GBK and Latin-1')] = "auto"
    file_bridge: Annotated[float, Q("m", "longest gap of the file that is filled", ge=0, le=100)] = 0.0
    file_unit: Annotated[Literal["m", "mm"], Field(description="unit of columns that state none")] = "m"
    file_start: Annotated[float | None, Q("m", "mileage of the file at chainage zero")] = None
    file_reverse: Annotated[bool, Field(description="the train passes the rows from last to first")] = False
    file_vertical_up: Annotated[bool, Field(description="vertical columns are positive upwards")] = False
    file_band_pass: Annotated[
        bool, Field(description="keeps only wavelengths from wavelength_min to wavelength_max")
    ] = False

    @field_validator("spectrum")
    @classmethod
    def _is_known(cls, spectrum: str) -> str:
        known = (*spectrum_names(), "none")
        if spectrum not in known:
            raise ValueError(f"unknown{nearest(spectrum, known)}")
        return spectrum

    @field_validator("wavelength_max")
    @classmethod
    def _is_longer(cls, wavelength_max: float, info: ValidationInfo) -> float:
        shortest = info.data.get("wavelength_min", 0.0)
        if wavelength_max <= shortest:
            raise ValueError(f"must be > wavelength_min = {shortest:g}")
        if shortest and wavelength_max > _MOST_BANDWIDTH * shortest:
            raise ValueError(f"must be <= {_MOST_BANDWIDTH:g} wavelength_min = {_MOST_BANDWIDTH * shortest:g}")
        return wavelength_max

    @field_validator("percentile")
    @classmethod
    def _has_percentiles(cls, percentile: float | None, info: ValidationInfo) -> float | None:
        if percentile is not None and info.data.get("spectrum", "none") != "none":
            load_spectrum(info.data["spectrum"]).mean_factor(percentile)
        return percentile

    @field_validator("function")
    @classmethod
    def _is_alone(cls, function: str | None, info: ValidationInfo) -> str | None:
        if function is not None and info.data.get("file") is not None:
            raise ValueError("must not be set together with irregularity.file")
        return function

    @field_validator("short_wave_min")
    @classmethod
    def _is_within_limit(cls, short_wave_min: float, info: ValidationInfo) -> float:
        low, high = load_roughness().shortest, _longest_roughness(info.data.get("wavelength_min", np.inf))
        if info.data.get("short_wave", False) and not low <= short_wave_min < high:
            raise ValueError(f"must be >= {low:.4g} and < {high:.4g}")
        return short_wave_min

    @property
    def has_spectrum(self) -> bool:
        """Whether the track, apart from rail roughness, is random."""
        return self.spectrum != "none" and self.file is None and self.function is None

    @property
    def short_wave_max(self) -> float:
        """Longest wave of the rail roughness [m]."""
        return _longest_roughness(self.wavelength_min)

    @property
    def shortest_wavelength(self) -> float:
        """Shortest wavelength generated from spectra [m]; infinite where none is used."""
        track = self.wavelength_min if self.has_spectrum else np.inf
        return min(track, self.short_wave_min if self.short_wave else np.inf)


def _longest_roughness(wavelength_min: float) -> float:
    """Longest wavelength of the roughness [m]: that of the limit, or the shortest of the track spectrum."""
    return min(wavelength_min, load_roughness().longest)


class _Track(Protocol):
    """Contribution to a track: values and slopes of its channels at chainages."""

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]: ...


class _Roughness:
    """Roughness of the two railheads, independent of each other, as vertical and cross level."""

    def __init__(self, rails: BlockSpline) -> None:
        self._rails = rails

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels, each of shape (n, 4)."""
        value, slope = self._rails.evaluate(x)
        return _from_rails(value), _from_rails(slope)


class _Scaled:
    """A contribution times a factor."""

    def __init__(self, track: _Track, factor: float) -> None:
        self._track, self._factor = track, factor

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels, each of shape (n, 4)."""
        value, slope = self._track.evaluate(x)
        return self._factor * value, self._factor * slope


def _from_rails(z: Reals) -> Reals:
    """Convert heights of the left and right railhead to the four channels, (n, 2) to (n, 4)."""
    channels = np.zeros((len(z), len(CHANNELS)))
    channels[:, 0] = 0.5 * (z[:, 0] + z[:, 1])
    channels[:, 2] = (z[:, 1] - z[:, 0]) / (2.0 * HALF_BASE)
    return channels


class Irregularity:
    """Irregularity at any chainage; build it with :func:`make_irregularity`."""

    def __init__(
        self,
        parts: list[_Track],
        taper_start: float,
        taper: float,
        shortest: float,
        reach: tuple[float, float] = (-np.inf, np.inf),
        description: str = "",
    ) -> None:
        """Sum contributions.

        Args:
            parts: Contributions to be summed.
            taper_start: Chainage before which the track is smooth [m].
            taper: Length over which the irregularity begins [m].
            shortest: Shortest wavelength of the contributions [m]; infinite where unknown.
            reach: Chainages where a measured track begins and ends [m].
            description: How a measured track was read, in words.
        """
        self.description = description
        self.start, self.end = reach
        self._parts = parts
        self.taper_start, self.taper, self.shortest_wavelength = taper_start, taper, shortest

    def sample(self, x: Reals) -> Reals:
        """Evaluate at chainages; a chainage gives the same bits in any array and any order.

        Args:
            x: Chainages [m], any shape, any order, any sign.

        Returns:
            z_v, y_a, theta, g [m, m, rad, m] and their slopes [-, -, rad/m, -], shape (..., 8).

        Raises:
            InputError: A chainage is not finite.
        """
        chainage = np.asarray(x, dtype=np.float64)
        if not np.isfinite(chainage).all():
            raise InputError("irregularity: chainage must be finite")
        flat = chainage.reshape(-1)
        out = np.zeros((flat.size, 2 * len(CHANNELS)))
        value, slope = out[:, : len(CHANNELS)], out[:, len(CHANNELS) :]
        for part in self._parts:
            v, s = part.evaluate(flat)
            value += v
            slope += s
        if flat.size and ((flat - self.taper_start) / self.taper).min() < 1.0:
            T, T_slope = self.grown(flat)
            slope *= T[:, None]
            slope += value * T_slope[:, None]
            value *= T[:, None]
        return out.reshape(*chainage.shape, -1)

    def grown(self, x: Reals) -> tuple[Reals, Reals]:
        """Share of its full amplitude to which the irregularity has grown, and the share's slope [1/m].

        Args:
            x: Chainages [m], any shape.
        """
        T, T_slope = smooth_step((x - self.taper_start) / self.taper)
        return T, T_slope / self.taper


def make_irregularity(
    params: IrregularityParams, taper_start: float, function: TrackFunction | None = None
) -> Irregularity:
    """Build the irregularity of a scenario: a function, a file or a spectrum, plus the rail roughness.

    Args:
        params: Parameters; a ``file`` replaces the spectrum.
        taper_start: Chainage where the irregularity begins [m], ahead of the leading wheel.
        function: Function that the parameters name.

    Raises:
        InputError: The file breaks a rule, or the function is missing.
    """
    parts: list[_Track] = []
    shortest, reach, description = params.shortest_wavelength, (-np.inf, np.inf), ""
    if params.file is not None:
        series = _measured_series(params, params.file)
        measured = MeasuredTrack(series.values, params.taper)
        description = f"{Path(params.file).name}: {series.description}"
        if measured.end <= taper_start:
            raise InputError(
                f"irregularity.file = {params.file!r}: ends at chainage {measured.end:g} m, before the run"
                " begins; set file_start to the mileage of chainage zero"
            )
        parts.append(measured)
        reach = (measured.start, measured.end)
        content = shortest_content(series.values, _RAIL_SCALES)
        shortest = min(shortest, max(content, params.wavelength_min if params.file_band_pass else 0.0))
    elif params.function is not None:
        if function is None:
            raise InputError(
                f"irregularity.function = {params.function!r}: the Python function itself is missing; pass it as"
                " tiengine.run(scenario, irregularity=function)"
            )
        parts.append(_Scaled(function.track(), params.scale))
    elif params.spectrum != "none":
        band = (params.wavelength_min, params.wavelength_max)
        parts.append(noise_spline(params.seed, range(4), _track_densities(params), band))
    if params.short_wave:
        roughness = load_roughness()

        def filtered(Omega: Reals) -> Reals:
            return params.scale**2 * roughness.density(Omega) * contact_filter(Omega, PATCH_HALF_LENGTH)

        band = (params.short_wave_min, params.short_wave_max)
        rails = noise_spline(params.seed, (4, 5), (filtered, filtered), band, shortest_block=_ROUGHNESS_BLOCK)
        parts.append(_Roughness(rails))
    return Irregularity(parts, taper_start, params.taper, shortest, reach, description)


def _measured_series(params: IrregularityParams, file: str) -> MeasuredSeries:
    """Read, filter and scale a file."""
    series = read_series(
        file,
        unit=params.file_unit,
        start=params.file_start,
        reverse=params.file_reverse,
        vertical_up=params.file_vertical_up,
        columns=params.file_columns,
        encoding=params.file_encoding,
        bridge=params.file_bridge,
    )
    values = series.values
    if params.file_band_pass:
        values = band_passed(values, params.wavelength_min, params.wavelength_max)
    return MeasuredSeries(np.column_stack([values[:, 0], params.scale * values[:, 1:]]), series.description)


def _track_densities(params: IrregularityParams) -> list[Density]:
    """Densities of the realisation: scaled, one- or two-sided, rail heights filtered by the contact patch."""
    spectrum = load_spectrum(params.spectrum)
    factor = params.scale**2 * (2.0 if params.two_sided else 1.0)
    if params.percentile is not None:
        factor *= spectrum.mean_factor(params.percentile)

    def density(channel: str) -> Density:
        a = PATCH_HALF_LENGTH if channel in ("vertical", "cross_level") else 0.0
        return lambda Omega: factor * spectrum.density(channel, Omega) * contact_filter(Omega, a)

    return [density(channel) for channel in CHANNELS]


def at_wheels(channels: Reals) -> Reals:
    """Convert the channels to the irregularity of the left and right railhead.

    Args:
        channels: Result of :meth:`Irregularity.sample`, shape (..., 8).

    Returns:
        z, y, z', y' of each side (0 left, 1 right), shape (..., 2, 4).
    """
    side = np.array([-1.0, 1.0])
    z_v, y_a, theta, gauge, *slopes = np.moveaxis(channels, -1, 0)[..., None]
    rails = [z_v + side * HALF_BASE * theta, y_a + side * 0.5 * gauge]
    rails += [slopes[0] + side * HALF_BASE * slopes[2], slopes[1] + side * 0.5 * slopes[3]]
    return np.stack(rails, axis=-1)
