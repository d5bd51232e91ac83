"""A random track as a function of (seed, chainage): cubic B-splines with coefficients made block by block.

The coefficients live on one global grid of spacing h; block b of the noise covers the grid points
[bN, bN + 2N) and every point is under exactly two blocks, whose windows satisfy w_b^2 + w_(b-1)^2 = 1. The
blocks are independent, so the sum has the power of one of them everywhere, and any stretch of track can be
made without what lies before it.

Each block is Sum Re[a_m exp(2 pi i m j/2N)] with complex Gaussian a_m, E|a_m|^2 = 2 Int S dOmega over the
m-th interval of wave numbers, divided by the B-spline's own response [sin(Omega h/2)/(Omega h/2)]^8 (power).
Numbers come from the counter-based generator Philox 4x64, key (seed, channel), counter from (0, 0, 0, b) on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tiengine.irregularity.spectrum import Density, band_variances
from tiengine.parameters.arrays import Reals

__all__ = ["BlockSpline", "NoiseBlocks", "noise_spline", "sampled_spline"]

POINTS_PER_WAVE = 8
"""Grid points per shortest wave: the spline's images of a wave then hold (1/7)^8 = 2e-7 of its power."""

WAVES_PER_BLOCK = 16
"""Longest waves in a block; the windows smear the spectrum by about 1/16 of its lowest wave number."""

CACHED_LENGTH = 600.0
"""Track [m] kept in memory behind and around a train; longer than any train."""

_PREFILTER_REACH = 28  # (2 - sqrt 3)^28 = 1e-16


class BlockSpline:
    """Cubic B-splines on the global grid j h; coefficients are generated in blocks, the last few of which are kept."""

    def __init__(
        self, spacing: float, size: int, channels: int, coefficients: Callable[[int], Reals], keep: int
    ) -> None:
        """Describe the grid.

        Args:
            spacing: Grid spacing h [m].
            size: Grid intervals N in a block.
            channels: Number of functions C.
            coefficients: ``coefficients(k)`` gives the coefficients g = kN ... kN+N+2, shape (N+3, C); the
                B-spline of coefficient g is centred at (g - 1) h.
            keep: Blocks kept in memory.
        """
        self.spacing, self.size, self.channels, self.keep = spacing, size, channels, keep
        self._block = lru_cache(maxsize=keep)(coefficients)

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Evaluate values and slopes; each depends on its own x alone, not on the rest of the array.

        Args:
            x: Chainages [m], shape (n,).

        Returns:
            Values and derivatives by x, each of shape (n, C).
        """
        q = x / self.spacing
        j = np.floor(q)
        weights, slopes = _weights(q - j, self.spacing)
        index = j.astype(np.int64)
        block = index // self.size
        local = index - block * self.size
        if x.size and block.min() == block.max():
            return _combine(self._block(int(block[0])), local, weights, slopes)
        value, slope = np.empty((x.size, self.channels)), np.empty((x.size, self.channels))
        for k in np.unique(block):
            at = np.flatnonzero(block == k)
            value[at], slope[at] = _combine(self._block(int(k)), local[at], weights[:, at], slopes[:, at])
        return value, slope


def _weights(t: Reals, h: float) -> tuple[Reals, Reals]:
    """The four cubic B-splines over an interval and their derivatives at t in [0, 1), each (4, n, 1)."""
    s = 1.0 - t
    value = np.stack(
        [
            s * s * s,
            4.0 + 3.0 * t * t * (t - 2.0),
            4.0 + 3.0 * s * s * (s - 2.0),
            t * t * t,
        ]
    )
    slope = np.stack([-s * s, t * (3.0 * t - 4.0), s * (4.0 - 3.0 * s), t * t])
    return value[..., None] / 6.0, slope[..., None] / (2.0 * h)


def _combine(c: Reals, i: NDArray[np.int64], weights: Reals, slopes: Reals) -> tuple[Reals, Reals]:
    """Sum of four terms in a fixed order: a chainage gives the same bits in any array, unlike einsum."""
    value, slope = 0.0, 0.0
    for shift in range(4):
        near = c.take(i + shift, axis=0)
        value = value + weights[shift] * near
        slope = slope + slopes[shift] * near
    return np.asarray(value), np.asarray(slope)


class NoiseBlocks:
    """Coefficients of Gaussian noise with given densities, see the module docstring."""

    def __init__(
        self,
        seed: int,
        streams: Sequence[int],
        densities: Sequence[Density],
        band: tuple[float, float],
        spacing: float,
        size: int,
    ) -> None:
        """Prepare the amplitudes.

        Args:
            seed: Seed of the track.
            streams: Number of the random stream of every channel; different streams are independent.
            densities: S(Omega) of every channel, one-sided.
            band: Shortest and longest wavelength [m].
            spacing: Grid spacing h [m].
            size: Grid intervals N in half a block.
        """
        self.seed, self.streams, self.size = seed, tuple(streams), size
        step = np.pi / (size * spacing)  # 2 pi over the block's length 2 N h
        low, high = 2 * np.pi / band[1], 2 * np.pi / band[0]
        self.bins = np.arange(round(low / step), round(high / step) + 1)
        edges = np.clip((np.arange(self.bins[0], self.bins[-1] + 2) - 0.5) * step, low, high)
        response = np.sinc(self.bins * step * spacing / (2 * np.pi)) ** 4
        self.amplitudes = np.array([np.sqrt(2 * band_variances(S, edges)) for S in densities]) / response
        t = (np.arange(size) + 0.5) / size
        # Vorbis' power-complementary window: its zero slope at the ends keeps kinks out of the short waves
        self.rise = np.sin(0.5 * np.pi * np.sin(0.5 * np.pi * t) ** 2)[:, None]
        self.fall = np.cos(0.5 * np.pi * np.sin(0.5 * np.pi * t) ** 2)[:, None]
        self._noise = lru_cache(maxsize=3)(self._make_noise)

    def __call__(self, k: int) -> Reals:
        """Coefficients kN ... kN+N+2 of all channels, shape (N+3, C)."""
        N = self.size
        own = self.fall * self._noise(k - 1)[N:] + self.rise * self._noise(k)[:N]
        ahead = self.fall[:3] * self._noise(k)[N : N + 3] + self.rise[:3] * self._noise(k + 1)[:3]
        return np.concatenate([own, ahead])

    def _make_noise(self, b: int) -> Reals:
        """Block b before the window, periodic over its 2N points, shape (2N, C)."""
        X = np.zeros((len(self.streams), self.size + 1), dtype=np.complex128)
        for row, stream in enumerate(self.streams):
            X[row, self.bins] = self.size * self.amplitudes[row] * self._gaussian(stream, b)
        return np.ascontiguousarray(fft.irfft(X, n=2 * self.size, axis=-1).T)

    def _gaussian(self, stream: int, b: int) -> NDArray[np.complex128]:
        """Draw independent complex Gaussian numbers of unit mean power, one for each bin (Box and Muller).

        They are computed from the raw integers of the generator, whose stream NumPy guarantees; that of its normal
        numbers it does not.
        """
        key = np.array([self.seed, stream], dtype=np.uint64)
        counter = np.array([0, 0, 0, b % 2**64], dtype=np.uint64)
        raw = np.random.Philox(key=key, counter=counter).random_raw(2 * self.bins.size) >> np.uint64(11)
        uniform = (raw + np.uint64(1)).astype(np.float64).reshape(-1, 2) * 2.0**-53  # (0, 1]
        a: NDArray[np.complex128] = np.sqrt(-np.log(uniform[:, 0])) * np.exp(2j * np.pi * uniform[:, 1])
        return a


def noise_spline(
    seed: int,
    streams: Sequence[int],
    densities: Sequence[Density],
    band: tuple[float, float],
    shortest_block: float = 0.0,
) -> BlockSpline:
    """Stationary Gaussian noise in a band of wavelengths.

    Args:
        seed: Seed of the track.
        streams: Random stream of every channel.
        densities: One-sided S(Omega) of every channel.
        band: Shortest and longest wavelength [m].
        shortest_block: Least half length of a block [m].

    Returns:
        Spline with one channel for each density.
    """
    h = band[0] / POINTS_PER_WAVE
    half = max(0.5 * WAVES_PER_BLOCK * band[1], shortest_block)
    size = int(fft.next_fast_len(int(np.ceil(half / h)), real=True))
    noise = NoiseBlocks(seed, streams, densities, band, h, size)
    return BlockSpline(h, size, len(streams), noise, _keep(h * size))


def _keep(length: float) -> int:
    """Number of blocks of this length [m] to keep so that they cover all wheels of a train."""
    return int(np.ceil(CACHED_LENGTH / length)) + 2


def sampled_spline(f: Callable[[Reals], Reals], spacing: float, channels: int) -> BlockSpline:
    """The cubic spline through the values of a function at all multiples of ``spacing``.

    The coefficients c_j = Sum sqrt(3) z^|i| f_(j-i), z = sqrt(3) - 2, need 28 intervals on either side: further
    terms are below rounding.

    Args:
        f: Function of chainages, (n,) to (n, channels).
        spacing: Grid spacing [m].
        channels: Number of columns of f.
    """
    size, reach = 4096, _PREFILTER_REACH
    kernel = np.sqrt(3.0) * (np.sqrt(3.0) - 2.0) ** np.abs(np.arange(-reach, reach + 1))

    def coefficients(k: int) -> Reals:
        first = k * size - 1 - reach
        y = f(spacing * np.arange(first, first + size + 3 + 2 * reach, dtype=np.float64))
        return np.stack([np.convolve(y[:, c], kernel, mode="valid") for c in range(channels)], axis=-1)

    return BlockSpline(spacing, size, channels, coefficients, _keep(size * spacing))
