"""Tracks given by a Python function: splines through it, its own slopes, pickling, and functions that are refused."""

import functools
import pickle

import numpy as np
import pytest

from tiengine.irregularity.irregularity import Irregularity, IrregularityParams, make_irregularity
from tiengine.irregularity.track_function import TrackFunction, recorded_name, track_functions
from tiengine.parameters.errors import InputError

FAR = -1e9  # the irregularity has begun long before any chainage of these tests


def made(f, taper_start: float = FAR, taper: float = 30.0, scale: float = 1.0, **how) -> Irregularity:
    """The irregularity of a scenario whose track is a function."""
    params = IrregularityParams(function="f", taper=taper, scale=scale)
    return make_irregularity(params, taper_start, TrackFunction(f, **how))


def wave(x, k=np.pi):
    """A wave of 2 m."""
    return np.sin(k * x), 0.0, np.cos(k * x), 1.0


def test_user_function_as_spline():
    """A wave of 2 m on a grid of 0.05 m: value within (kh)^4/384, slope 0.02 (kh)^3 k; exact on the grid."""
    k, h = np.pi, 0.05
    track = made(wave, spacing=h)
    x = np.random.default_rng(0).uniform(-500.0, 500.0, 3000)
    sampled = track.sample(x)
    exact = np.stack(
        [np.sin(k * x), 0 * x, np.cos(k * x), 1 + 0 * x, k * np.cos(k * x), 0 * x, -k * np.sin(k * x), 0 * x],
        -1,
    )
    error = np.abs(sampled - exact).max(axis=0)
    assert (error[:4] < 1.1 * (k * h) ** 4 / 384 + 1e-13).all()  # a tenth for the next order
    assert (error[4:] < 0.02 * (k * h) ** 3 * k + 1e-12).all()
    nodes = h * np.arange(-5000, 5000, 37)
    assert np.abs(track.sample(nodes)[:, 0] - np.sin(k * nodes)).max() < 1e-12  # rounding


def test_user_function_with_slopes():
    """The user's own slopes are used, the taper's product rule on top; the scale multiplies both."""

    def parabola(x):
        return x**2, x, 0.0, 0.0

    def slopes(x):
        return 2 * x, 1.0, 0.0, 0.0

    track = made(parabola, slopes=slopes, taper_start=0.0, taper=10.0, scale=2.0)
    sampled = track.sample(np.array([5.0, 20.0])) / 2.0
    T, dT = 0.5, 30 / 16 / 10.0  # the step's middle
    assert sampled[0] == pytest.approx([25 * T, 5 * T, 0, 0, 10 * T + 25 * dT, T + 5 * dT, 0, 0])
    assert sampled[1] == pytest.approx([400, 20, 0, 0, 40, 1, 0, 0])


def test_a_pickled_function_gives_the_same_bits():
    """A copy made by pickle, and a copy of that copy before it is used."""
    x = np.linspace(0.0, 100.0, 999)
    copy = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(TrackFunction(wave)))))
    track = make_irregularity(IrregularityParams(function="wave"), FAR, copy)
    np.testing.assert_array_equal(track.sample(x), made(wave).sample(x))
    assert copy.name == "wave"


def test_a_function_that_cannot_be_pickled_is_named():
    with pytest.raises(InputError, match=r"function '.*lambda.*' cannot be sent to worker processes .* workers=1"):
        pickle.dumps(TrackFunction(lambda x: (x, x, x, x)))


def test_a_function_that_cannot_be_imported_is_named(monkeypatch):
    """As in a worker of an interactive session: the name is not in the module it finds."""
    sent = pickle.dumps(TrackFunction(wave))
    monkeypatch.delattr(f"{__name__}.wave")
    copy = pickle.loads(sent)  # by itself it imports nothing
    with pytest.raises(InputError, match=r"function 'wave' cannot be loaded in a worker process .* workers=1"):
        make_irregularity(IrregularityParams(function="wave"), FAR, copy)


def test_names():
    """Names of a function, a partial one, and a callable object."""

    class Hill:
        def __call__(self, x):
            return x, x, x, x

    partial = functools.partial(wave, k=1.0)
    found = track_functions([wave, partial, TrackFunction(Hill())], 3)
    assert recorded_name(found) == "wave, test_names.<locals>.Hill"
    assert track_functions(wave, 3)[2].name == "wave"


def test_bad_functions_are_refused():
    """No function, spacing, number of functions; and what shows when it is sampled."""
    with pytest.raises(InputError, match=r"irregularity = 3: must be a function of chainage"):
        TrackFunction(3)
    with pytest.raises(InputError, match=r"spacing = 0: must be > 0"):
        TrackFunction(wave, spacing=0.0)
    with pytest.raises(InputError, match=r"2 functions; must be one, or one for each of 3 trains"):
        track_functions([wave, wave], 3)
    for f, words in (
        (lambda x: (x, x), "returns 2 series; must return 4"),
        (lambda x: (x, x, x, x * np.nan), "must be finite everywhere"),
        (lambda x: (x, x, x, x[:3]), "every series must be numbers in the shape of the chainages"),
        (lambda x: (x, x, x, "a"), "every series must be numbers in the shape of the chainages"),
        (lambda x: x[0] / None, r"fails between -\S+ and \S+ m \(TypeError"),
    ):
        with pytest.raises(InputError, match=rf"irregularity: function '.*lambda.*': {words}"):
            made(f).sample(np.zeros(1))


def test_a_function_replaces_spectrum_and_file():
    """The shortest wave is not known; a file beside it is refused; the function itself must be there."""
    params = IrregularityParams(function="f")
    assert params.shortest_wavelength == np.inf
    assert not params.has_spectrum
    with pytest.raises(ValueError, match=r"must not be set together with irregularity\.file"):
        IrregularityParams(function="f", file="track.csv")
    with pytest.raises(InputError, match=r"irregularity\.function = 'f': the Python function itself is missing"):
        make_irregularity(params, FAR)
