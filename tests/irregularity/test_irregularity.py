"""Realisations of track irregularity: statistics against the spectra, and the promises of MODEL §6."""

import tracemalloc

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.signal import welch
from scipy.stats import chi2

from tiengine.irregularity.irregularity import (
    HALF_BASE,
    IrregularityParams,
    at_wheels,
    make_irregularity,
)
from tiengine.irregularity.patch_filter import PATCH_HALF_LENGTH
from tiengine.irregularity.spectrum import (
    CHANNELS,
    band_variances,
    contact_filter,
    load_roughness,
    load_spectrum,
    sigma,
)
from tiengine.irregularity.track_checks import check_step
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import explain

FAR = -1e9  # the irregularity has begun long before any chainage of these tests
LOW = load_spectrum("german_low")
JOINT = 960.0  # m, length of a block of coefficients for waves up to 120 m: 16/2 of them


def track(**settings):
    return make_irregularity(IrregularityParams(**settings), FAR)


def density(channel, Omega):
    return LOW.density(channel, Omega)


def wave_moment(channel, power, square=1):
    """Int Omega^power S^square dOmega over 1-120 m."""
    edges = np.geomspace(2 * np.pi / 120.0, 2 * np.pi, 2001)
    return band_variances(lambda Omega: Omega**power * density(channel, Omega) ** square, edges).sum()


def whitened(signal, dx):
    """Fourier amplitudes of pieces (..., n) over waves of 2-60 m, each with unit mean power."""
    n = signal.shape[-1]
    f = np.fft.rfftfreq(n, dx)
    held = (f > 1 / 60.0) & (f < 1 / 2.0)
    A = np.fft.rfft(signal * np.hanning(n), axis=-1)[..., held]
    return A / np.sqrt((np.abs(A) ** 2).mean(axis=tuple(range(A.ndim - 1))))


@pytest.fixture(scope="module")
def long_sample():
    """German low, 24 km at 0.25 m."""
    x = np.arange(0.0, 24e3, 0.25)
    return x, track().sample(x)


@pytest.mark.parametrize("channel", range(4))
def test_standard_deviation_of_a_long_sample(long_sample, channel):
    """The variance of a Gaussian sample scatters by sqrt(2 pi Int S^2 dOmega/L); four times that."""
    name, L = CHANNELS[channel], 24e3
    variance = sigma(LOW, name, 1.0, 120.0) ** 2
    scatter = np.sqrt(2 * np.pi * wave_moment(name, 0, square=2) / L)
    assert np.mean(long_sample[1][:, channel] ** 2) == pytest.approx(variance, abs=4 * scatter)


@pytest.mark.parametrize("channel", range(4))
def test_variance_of_slopes(long_sample, channel):
    """Slopes have the spectrum Omega^2 S: their variance in a long sample, four standard deviations."""
    name, L = CHANNELS[channel], 24e3
    scatter = np.sqrt(2 * np.pi * wave_moment(name, 4, square=2) / L)
    slope = long_sample[1][:, 4 + channel]
    assert np.mean(slope**2) == pytest.approx(wave_moment(name, 2), abs=4 * scatter)


@pytest.mark.parametrize("channel", range(4))
def test_spectrum_within_its_statistical_bounds(long_sample, channel):
    """Welch estimate over 20 km: every bin of 1.2-80 m within chi-square bounds, their mean within 3 %.

    Hann pieces of 960 m, half overlapping: neighbours correlate by 1/6, so K pieces count as K/(1 + 2/36).
    The bounds hold for all bins at once with 99.99 %; 2 % are added for the bias of the window on a falling
    spectrum.
    """
    n, dx = 3840, 0.25
    z = long_sample[1][: int(20e3 / dx), channel]
    f, S = welch(z, 1 / dx, "hann", n, detrend=False)
    held = (f > 1 / 80.0) & (f < 1 / 1.2)
    ratio = S[held] / (2 * np.pi * density(CHANNELS[channel], 2 * np.pi * f[held]))
    freedom = 2 * (2 * z.size / n - 1) / (1 + 2 / 36)
    tail = 0.5e-4 / held.sum()
    assert ratio.max() < 1.02 * chi2.isf(tail, freedom) / freedom
    assert ratio.min() > 0.98 * chi2.ppf(tail, freedom) / freedom
    # 780 bins x 77 degrees of freedom, neighbouring bins correlated: 0.8 %; four of these
    assert ratio.mean() == pytest.approx(1.0, abs=0.03)


def test_power_is_the_same_everywhere():
    """Across 400 blocks the variance is sigma^2 at joints, quarters, middles: windows preserve power."""
    track_ = track(seed=5)
    for offset in (0.0, 240.0, 480.0, 720.0):
        z = track_.sample(offset + JOINT * np.arange(400))[:, 0]
        # 400 values 960 m apart: variance scatters by sqrt(2/400) = 7 %; four of these
        assert np.mean(z**2) == pytest.approx(sigma(LOW, "vertical", 1.0, 120.0) ** 2, rel=0.28)


def test_same_seed_same_track():
    """A new object with the same seed gives the same bits; another seed another track."""
    x = np.linspace(-2e3, 2e3, 999)
    first = track(seed=42).sample(x)
    assert np.array_equal(first, track(seed=42).sample(x))
    other = track(seed=43).sample(x)
    assert not np.isclose(first[:, :4], other[:, :4], rtol=1e-3, atol=0.0).all(axis=1).any()


@pytest.mark.parametrize("settings", [{}, {"short_wave": True}])
@pytest.mark.parametrize("start", [-500.0, 900.0, 1e6])
def test_random_access_equals_sequential_access(settings, start):
    """Any order, any array shape, one by one, over block joints and after a long detour: the same bits."""
    params = IrregularityParams(**settings)
    x = start + np.arange(0.0, 1200.0, 1.7)
    sequential = make_irregularity(params, start + 20.0).sample(x)
    other = make_irregularity(params, start + 20.0)
    order = np.random.default_rng(1).permutation(x.size)
    assert np.array_equal(other.sample(x[order]), sequential[order])
    other.sample(np.linspace(-3e4, 3e4, 50))
    assert np.array_equal(other.sample(x[: 2 * (x.size // 2)].reshape(2, -1))[1, 7], sequential[x.size // 2 + 7])
    for i in order[:40]:
        assert np.array_equal(other.sample(x[i]), sequential[i])


def test_no_two_blocks_are_correlated():
    """Over 100 km, the largest correlation of any two pieces of 960 m at any lag stays below its bound.

    Pieces are whitened to m wave numbers of independent amplitudes; the correlation at a lag is a mean of m
    complex numbers of random phase, so P(|r| > t) = exp(-m t^2). With 5356 pairs x 1920 lags the largest
    exceeds sqrt(ln(1e7/1e-4)/m) once in 10^4 seeds; Hann windows halve the number of independent wave numbers
    at worst. A block that came again would give r near 1.
    """
    dx, n = 0.5, 1920
    z = track(seed=7).sample(np.arange(104 * n) * dx)[:, 0].reshape(104, n)
    A = whitened(z, dx)
    m = A.shape[1]
    largest = 0.0
    for i in range(103):
        product = A[i + 1 :] * A[i].conj()
        norm = np.sqrt((np.abs(A[i + 1 :]) ** 2).sum(axis=1) * (np.abs(A[i]) ** 2).sum())
        largest = max(largest, float((np.abs(np.fft.ifft(product, n, axis=1)) * n / norm[:, None]).max()))
    assert m > 450
    assert largest < np.sqrt(np.log(1e7 / 1e-4) / (m / 2))


def test_channels_are_uncorrelated(long_sample):
    """Whitened channels correlate by no more than four times 1/sqrt(2 m pieces)."""
    pieces = long_sample[1][:, :4].T.reshape(4, -1, 3840)
    A = np.stack([whitened(channel, 0.25) for channel in pieces]).reshape(4, -1)
    r = np.real(A @ A.conj().T) / A.shape[1]
    assert np.diag(r) == pytest.approx(1.0, rel=1e-12)
    # Hann windows make neighbouring wave numbers depend on each other: twice the variance
    assert np.abs(r - np.eye(4)).max() < 4 * np.sqrt(2.0 / (2 * A.shape[1]))


def test_memory_is_constant():
    """After 100 km in chunks no more is held than after 3 km, half a block of coefficients aside."""
    track_ = track()
    tracemalloc.start()
    try:
        for first in range(0, 3000, 500):
            track_.sample(np.linspace(first, first + 500.0, 100))
        early = tracemalloc.get_traced_memory()[0]
        for first in range(3000, 100_000, 500):
            track_.sample(np.linspace(first, first + 500.0, 100))
        late = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert late - early < 0.5 * 7680 * 4 * 8
    assert late < 4e6  # three blocks of 0.5 MB, three halves of 0.25 MB, tables


def test_slope_is_the_derivative():
    """Central differences err by eps^2/6 times the third derivative, taken as six standard deviations."""
    x, eps = np.linspace(1.0, 5e3, 4001), 1e-3
    track_ = make_irregularity(IrregularityParams(), 1000.0)  # the taper included
    difference = (track_.sample(x + eps)[:, :4] - track_.sample(x - eps)[:, :4]) / (2 * eps)
    slope = track_.sample(x)[:, 4:]
    for channel, name in enumerate(CHANNELS):
        tolerance = eps**2 / 6 * 6 * np.sqrt(wave_moment(name, 6)) + 1e-16 / eps
        # in the taper z' T''/2 and z T'''/6 add: T'' < 6/30^2, T''' < 60/30^3
        tolerance += eps**2 / 6 * 6 * (3 * 6 / 900 * np.sqrt(wave_moment(name, 2)))
        tolerance += eps**2 / 6 * 6 * (60 / 27000 * sigma(LOW, name, 1.0, 120.0))
        assert np.abs(difference[:, channel] - slope[:, channel]).max() < tolerance


def test_curvature_is_continuous_over_block_joints():
    """C2: the jump of the slope's one-sided differences goes to zero with eps, at joints as elsewhere."""
    joints = JOINT * np.arange(-20, 21)
    track_ = track(seed=3)
    for eps in (1e-2, 1e-3):
        before, at, after = (track_.sample(joints + s * eps)[:, 4:] for s in (-1.0, 0.0, 1.0))
        jump = np.abs(after - 2 * at + before) / eps
        for channel, name in enumerate(CHANNELS):
            # eps z''' with six standard deviations, and rounding of the slopes
            assert jump[:, channel].max() < 6 * eps * np.sqrt(wave_moment(name, 6)) + 1e-17 / eps


def test_taper():
    """Nothing before its start, a C2 beginning, the bare track from its end on."""
    start, taper = 133.0, 30.0
    tapered = make_irregularity(IrregularityParams(taper=taper), start)
    assert not tapered.sample(np.linspace(-50.0, start, 200)).any()
    beyond = np.linspace(start + taper, 500.0, 200)
    assert np.array_equal(tapered.sample(beyond), track(taper=taper).sample(beyond))
    eps = np.array([1e-1, 1e-2])
    near = np.abs(tapered.sample(start + eps)[:, 4])
    z = abs(track().sample(np.array(start))[0])
    # z T' = 30 z eps^2/taper^3: curvature begins at zero; the next terms are of relative order eps z'/z
    assert near == pytest.approx(30 * z * eps**2 / taper**3, rel=0.1)


def test_reading_scale_and_percentile_multiply_amplitudes():
    """Two-sided reading: sqrt(2); 90th percentile: sqrt(2.3026); scale: itself; otherwise the same track."""
    x = np.linspace(0.0, 3e3, 500)
    rounding = {"rtol": 1e-9, "atol": 1e-15}  # sums of 1e3 waves of millimetres
    np.testing.assert_allclose(track(two_sided=True).sample(x), np.sqrt(2) * track().sample(x), **rounding)
    np.testing.assert_allclose(track(scale=0.25).sample(x), 0.25 * track().sample(x), **rounding)
    china = {"spectrum": "china_ballastless", "wavelength_min": 2.0}
    expected = np.sqrt(-np.log(0.1)) * track(**china).sample(x)
    np.testing.assert_allclose(track(**china, percentile=0.9).sample(x), expected, **rounding)
    assert not track(spectrum="none").sample(x).any()


def test_rail_roughness():
    """Each rail has the filtered ISO 3095 level in every band of 2 km; the rails are independent."""
    L, dx = 2000.0, 0.02
    channels = track(spectrum="none", short_wave=True, seed=11).sample(np.arange(0.0, L, dx))
    z = at_wheels(channels)[:, :, 0]
    assert not channels[:, [1, 3, 5, 7]].any()
    power = np.abs(np.fft.rfft(z, axis=0) * dx) ** 2 * 2 / L  # one-sided, per 1/m
    f = np.fft.rfftfreq(len(z), dx)
    roughness = load_roughness()
    for centre in roughness.wavelengths[:7]:  # 0.4 to 0.1 m; the band of 0.08 m is cut in two
        low, high = 10**-0.05 / centre, 10**0.05 / centre
        bins = (f >= low) & (f < high)
        edges = 2 * np.pi * np.array([low, high])
        exact = band_variances(
            lambda Omega: roughness.density(Omega) * contact_filter(Omega, PATCH_HALF_LENGTH), edges
        )[0]
        # two degrees of freedom a bin: relative scatter 1/sqrt(bins); four of these, 1 % for leakage
        assert power[bins].sum(axis=0) / L == pytest.approx(exact, rel=4 / np.sqrt(bins.sum()) + 0.01)
    r = np.corrcoef(z[:, 0], z[:, 1])[0, 1]
    assert abs(r) < 4 / np.sqrt(2 * L * (1 / 0.3 - 1 / 0.45))  # degrees of freedom of the strongest octave


def test_broad_band():
    """Waves of 0.05-120 m: variance as the spectrum says; the contact filter takes less than 1e-5 of it."""
    track_ = track(wavelength_min=0.05)
    z = track_.sample(np.arange(0.0, 20e3, 0.4))[:, 0]
    scatter = np.sqrt(2 * np.pi * wave_moment("vertical", 0, square=2) / 20e3)
    assert np.mean(z**2) == pytest.approx(sigma(LOW, "vertical", 0.05, 120.0) ** 2, abs=4 * scatter)
    assert track_.shortest_wavelength == 0.05


def test_wheels():
    """z = z_v + sigma b theta, y = y_a + sigma g/2, likewise the slopes (MODEL §6)."""
    sampled = np.arange(1.0, 17.0).reshape(2, 8)
    left, right = at_wheels(sampled)[1]
    z_v, y_a, theta, g, dz_v, dy_a, dtheta, dg = sampled[1]
    assert left == pytest.approx([z_v - HALF_BASE * theta, y_a - g / 2, dz_v - HALF_BASE * dtheta, dy_a - dg / 2])
    assert right == pytest.approx([z_v + HALF_BASE * theta, y_a + g / 2, dz_v + HALF_BASE * dtheta, dy_a + dg / 2])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"spectrum": "german_hi"}, "spectrum = 'german_hi': unknown; did you mean 'german_high'?"),
        ({"wavelength_min": 150.0}, "wavelength_max = 120.0: must be > wavelength_min = 150"),
        ({"wavelength_min": 0.001}, "wavelength_max = 120.0: must be <= 10000 wavelength_min = 10"),
        ({"seed": -1}, "seed = -1: must be greater than or equal to 0"),
        ({"taper": 0.0}, "taper = 0.0: must be greater than 0"),
        (
            {"percentile": 0.9},
            "percentile = 0.9: must not be set: the German low-disturbance spectrum has no percentiles",
        ),
        (
            {"short_wave": True, "short_wave_min": 0.5},
            "short_wave_min = 0.5: must be >= 0.002818 and < 0.4467",
        ),
        (
            {"short_wave": True, "wavelength_min": 0.07},
            "short_wave_min = 0.08: must be >= 0.002818 and < 0.07",
        ),
        ({"sedd": 3}, "sedd: unknown key; did you mean 'seed'?"),
    ],
)
def test_bad_parameters_are_refused(settings, message):
    """Each names key, value and rule."""
    with pytest.raises(ValidationError) as caught:
        IrregularityParams(**settings)
    assert explain(caught.value, IrregularityParams, "irregularity").startswith(f"irregularity.{message}")


def test_bad_use_is_refused():
    """Waves that the step cannot follow, chainages that are no numbers."""
    with pytest.raises(
        InputError,
        match=r"shortest wavelength = 0.05 m: must be at least 8 V dt = 0.0776 m at a time step of 0.0001 s;",
    ):
        check_step(IrregularityParams(), track(wavelength_min=0.05).shortest_wavelength, 97.0, 1e-4)
    check_step(IrregularityParams(), track().shortest_wavelength, 97.0, 1e-3)
    with pytest.raises(InputError, match="chainage must be finite"):
        track().sample(np.array([0.0, np.nan]))
