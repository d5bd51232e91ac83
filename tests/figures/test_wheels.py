"""Figures of wheel channels: what is drawn is what the file holds, limits stand where the standards put them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from tiengine.figures import compare, contact, ensemble, forces, ride, spectrum
from tiengine.figures.curve import BINS, Band, Curve
from tiengine.indices.filters import low_pass, sliding_mean
from tiengine.indices.train_record import SLICE, AbsentError, Train
from tiengine.parameters.errors import InputError

from .. import hand_made as by

rng = np.random.default_rng(5)


def noise(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Q about the static load and Y about zero [N]."""
    shape = (samples, 4, 2)
    return 70e3 + 5e3 * rng.standard_normal(shape), 2e3 * rng.standard_normal(shape)


def labelled(axes, label):
    """The line of that label."""
    (line,) = [line for line in axes.get_lines() if line.get_label() == label]
    return line.get_xydata().T


def heights(axes):
    """Ordinates of horizontal lines."""
    return {round(float(line.get_ydata()[0]), 6) for line in axes.get_lines() if len(line.get_xdata()) == 2}


def test_short_curves_are_drawn_as_they_are():
    """Piece by piece, every sample."""
    x, y = np.linspace(0.0, 1.0, 2 * BINS), rng.standard_normal(2 * BINS)
    curve = Curve(0.0, 1.0)
    for part in (slice(0, 7), slice(7, None)):
        curve.add(x[part], y[part])
    np.testing.assert_array_equal(curve.line, (x, y))
    assert Curve(0.0, 1.0).line[0].size == 0


def test_long_curves_keep_their_extremes():
    """Least and largest of every bin, wherever the pieces end; one spike in a million samples is seen."""
    x, y = np.linspace(0.0, 10.0, 100_000), rng.standard_normal(100_000)
    y[54_321] = 50.0
    curve = Curve(0.0, 10.0, bins=100)
    for part in np.array_split(np.arange(100_000), 7):
        curve.add(x[part], y[part])
    at, drawn = curve.line
    place = np.minimum((x / 0.1).astype(int), 99)
    expected = [[y[place == i].min(), y[place == i].max()] for i in range(100)]
    np.testing.assert_array_equal(drawn.reshape(-1, 2), expected)
    assert drawn.max() == 50.0
    assert np.abs(at[np.argmax(drawn)] - x[54_321]) <= 0.05 + 1e-9  # half a bin


def test_bands_take_several_values_a_place():
    """Both columns count; a bin without samples stays empty."""
    band = Band(0.0, 3.0, bins=3)
    band.add(np.array([0.1, 0.2, 2.5]), np.array([[1.0, 5.0], [-2.0, 0.0], [3.0, 4.0]]))
    np.testing.assert_array_equal(band.low, [-2.0, np.nan, 3.0])
    np.testing.assert_array_equal(band.high, [5.0, np.nan, 4.0])


def test_forces_are_those_of_the_file(tmp_path):
    """Low pass and means equal those of the indices; bands span all wheels; the chainage is that of the wheelset."""
    Q, Y = noise(1000)
    with by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(Q, Y)}) as result:
        figure = forces.draw(result)
    x = by.START + by.OFFSET[0] + by.V * 1e-3 * np.arange(1000)
    for side, word in enumerate(("left", "right")):
        for axes, force in zip(figure.axes[:2], (Q, Y), strict=True):
            drawn = labelled(axes, f"leading wheelset {word}, 20 Hz")
            np.testing.assert_allclose(drawn, (x, 1e-3 * low_pass(force[:, 0, side], 1e-3, 20.0)), rtol=1e-12)
    smooth = low_pass(Y[:, 0], 1e-3, 20.0).sum(axis=1)
    np.testing.assert_allclose(labelled(figure.axes[2], "leading wheelset"), sliding_mean(x, 1e-3 * smooth), atol=1e-9)
    band = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == pytest.approx((1e-3 * Q.min(), 1e-3 * Q.max()))


def test_limits_of_the_forces(tmp_path):
    """By hand at 350 km/h, Q0 of the leading wheelset: min(90 + Q0, 160), Q0/5, 10 + 2 Q0/3, 15 + 2 Q0/3, 0.8."""
    of = by.scenario()
    Q0 = 1e-3 * by.static_loads(of)[0].mean()
    with by.made(tmp_path / "a.h5", of, {"wheel": by.wheel(*noise(300))}) as result:
        figure = forces.draw(result)
    near = lambda *values: {round(float(value), 6) for value in values}  # noqa: E731
    assert near(min(90.0 + Q0, 160.0), Q0, 0.2 * Q0) <= heights(figure.axes[0])
    axle = 2.0 * Q0 / 3.0
    assert near(10.0 + axle, -10.0 - axle, 15.0 + axle, -15.0 - axle) == heights(figure.axes[2])
    assert near(0.8, -0.8) == heights(figure.axes[3])


def test_forces_beyond_the_limits_stay_in_the_picture(tmp_path):
    """300 kN on every wheel, sideways too: ten times the limits."""
    force = np.full((300, 4, 2), 300e3)
    with by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(force, force)}) as result:
        figure = forces.draw(result)
    for axes, value in zip(figure.axes, (300.0, 300.0, 600.0, 1.0), strict=True):
        assert axes.get_ylim()[1] > value


def test_slices_are_filtered_as_one(tmp_path):
    """Two and a half slices equal one piece: after ten periods the filter's response is below 1e-12."""
    force = rng.standard_normal((5 * SLICE // 2, 4, 2))
    with by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(force, force, 2e-4)}) as result:
        samples = Train(result).samples("wheel", "vertical_force")
        pieces = [values["vertical_force"][:own] for own, _, values in samples.low_passed(20.0, ahead=2.0)]
        ahead = [position[-1] - position[own - 1] for own, position, _ in samples.low_passed(20.0, ahead=2.0)]
    np.testing.assert_allclose(np.concatenate(pieces), low_pass(force, 2e-4, 20.0), atol=1e-12)
    assert min(ahead[:-1]) >= 2.0


@pytest.mark.parametrize(("interval", "message"), [(0.01, "output.wheel_interval to 0.005"), (1e-3, "vertical_force")])
def test_forces_that_cannot_be_drawn(tmp_path, interval, message):
    """Samples too rare, or no channel: the key to set is named."""
    group = by.wheel(*noise(100), interval=interval)
    if interval == 1e-3:
        del group["vertical_force"]
    with (
        by.made(tmp_path / "a.h5", by.scenario(), {"wheel": group}) as result,
        pytest.raises(AbsentError, match=message),
    ):
        forces.draw(result)


def test_comparison_of_a_file_with_itself_shifted(tmp_path):
    """The second file carries 3 kN more, is sampled twice as often and begins 5 m later: the difference is 3 kN."""
    time = 1e-3 * np.arange(1000)
    shape = np.ones((1, 4, 2))
    a = by.wheel((70e3 + 1e3 * time)[:, None, None] * shape, 0.0 * time[:, None, None] * shape)
    later = 5.0 / by.V
    time = 0.5e-3 * np.arange(2000)
    b = by.wheel((73e3 + 1e3 * (time + later))[:, None, None] * shape, 0.0 * time[:, None, None] * shape, 0.5e-3,
                 start=by.START + 5.0)  # fmt: skip
    with (
        by.made(tmp_path / "a.h5", by.scenario(), {"wheel": a}) as first,
        by.made(tmp_path / "b.h5", by.scenario(), {"wheel": b}) as second,
    ):
        figure = compare.draw(first, second)
    x, difference = labelled(figure.axes[1], "b - a, leading left wheel")
    np.testing.assert_allclose(difference, 3.0, rtol=1e-9)
    first_common = np.ceil(later / 1e-3)  # sample of a
    assert x[0] == pytest.approx(by.START + by.OFFSET[0] + by.V * 1e-3 * first_common)
    peak, spread = 71e3 - 1.0, np.sqrt(np.mean((np.arange(first_common, 1000) - 0.5 * (first_common + 999)) ** 2))
    words = f"largest 3 kN ({100 * 3e3 / peak:.2g} % of a's largest), rms 3 kN ({100 * 3e3 / spread:.2g} % of a's"
    assert words in figure.axes[1].get_title(loc="left")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": 5000.0}, "overlap by less than 1 m"),
        ({"wheelset_offset": by.OFFSET + 1.0}, "wheelsets at different places"),
    ],
)
def test_files_that_cannot_be_compared(tmp_path, change, message):
    """Another stretch of track, another train."""
    with (
        by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(*noise(100))}) as first,
        by.made(tmp_path / "b.h5", by.scenario(), {"wheel": {**by.wheel(*noise(100), **change)}}) as second,
        pytest.raises(InputError, match=message),
    ):
        compare.draw(first, second)


def test_welch_by_slices_is_welch(tmp_path):
    """SciPy's own over the whole; mean over the wheels is what the figure shows, the run-in left out."""
    Q, Y = noise(3 * SLICE)
    of = by.scenario(output__run_in=5.0)
    with by.made(tmp_path / "a.h5", of, {"wheel": by.wheel(Q, Y)}) as result:
        samples = Train(result).samples("wheel", "vertical_force")
        f, S = spectrum.welch(samples, 52, 0.5)
        figure = spectrum.draw(result)
    expected = signal.welch(Q[52:], 1e3, nperseg=500, axis=0)
    np.testing.assert_allclose(f, expected[0])
    np.testing.assert_allclose(S["vertical_force"], expected[1], rtol=1e-9)
    begin = int(np.ceil(5.0 / by.V / 1e-3))
    drawn = labelled(figure.axes[0], "vertical, Q")
    expected = signal.welch(Q[begin:], 1e3, nperseg=1000, axis=0)
    np.testing.assert_allclose(drawn[1], expected[1].mean(axis=(1, 2))[1:], rtol=1e-9)


def test_passing_frequencies(tmp_path):
    """V over the distances of the data sheets: 0.63 m, 5.67 m, 2.5 m in a bogie, 17.5 m between bogies."""
    with by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(*noise(1000))}) as result:
        found = spectrum.passing_frequencies(Train(result))
        words = [text.get_text() for text in spectrum.draw(result).axes[0].texts]
    distances = {"seats": 0.63, "2 x seats": 0.315, "slabs": 5.67, "wheelsets": 2.5, "bogies": 17.5}
    for name, distance in distances.items():
        assert found[name] == pytest.approx((by.V / distance,) * 2, rel=1e-9)
    assert {"seats 154 Hz", "slabs 17.1 Hz", "wheelsets 38.9 Hz"} <= set(words)
    assert any(word.startswith("P2 ") for word in words)


def test_spectra_of_bodies(tmp_path):
    """The car heaves by 0.5 m/s^2 at 8 Hz: the line's area is 0.125 m^2/s^4."""
    time = 1e-3 * np.arange(4000)
    acceleration = np.zeros((4000, 7, 5))
    acceleration[:, 0, 1] = 0.5 * np.sin(16.0 * np.pi * time)
    groups = {"wheel": by.wheel(*noise(4000)), "body": by.body(acceleration)}
    with by.made(tmp_path / "a.h5", by.scenario(), groups) as result:
        f, S = labelled(spectrum.draw(result).axes[1], "car, vertical")
    assert f[np.argmax(S)] == pytest.approx(8.0)
    assert S.sum() * (f[1] - f[0]) == pytest.approx(0.125, rel=1e-6)  # whole periods in a window: no leakage beyond it


def test_runs_too_short_for_a_spectrum(tmp_path):
    """0.1 s."""
    with (
        by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(*noise(100))}) as result,
        pytest.raises(AbsentError, match=r"0\.1 s after the run-in are too short"),
    ):
        spectrum.draw(result)


def test_contact_histogram(tmp_path):
    """Left wheels a quarter of the time at 2.1 mm, else at -3.1 mm; right ones at 5.1 mm; time in the air is not."""
    position = np.full((400, 4, 2), 5.1e-3)
    position[:, :, 0] = -3.1e-3
    position[:100, :, 0] = 2.1e-3
    N = np.full((400, 4, 2), 70e3)
    N[300:, :, 1], position[300:, :, 1] = 0.0, 9.0e-3  # in the air
    more = {"normal_force": N, "contact_position_wheel": position, "contact_position_rail": 0.5 * position}
    with by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(*noise(400), **more)}) as result:
        figure = contact.draw(result)
    for axes, factor in ((figure.axes[0], 1.0), (figure.axes[2], 0.5)):
        for patch, shares in zip(axes.patches, ({2.1: 25.0, -3.1: 75.0}, {5.1: 100.0}), strict=True):
            values, edges, _ = patch.get_data()
            assert values.sum() == pytest.approx(100.0)
            for place, share in shares.items():
                assert values[np.searchsorted(edges, factor * place) - 1] == pytest.approx(share)


def test_ride_is_that_of_the_floor(tmp_path):
    """The car sways by 1 m/s^2 at 2 Hz, in the middle of the band; limits at 2.5 m/s^2."""
    time = 1e-3 * np.arange(6000)
    acceleration = np.zeros((6000, 7, 5))
    acceleration[:, 0, 0] = np.sin(4.0 * np.pi * time)
    groups = {"wheel": by.wheel(*noise(6000)), "body": by.body(acceleration)}
    with by.made(tmp_path / "a.h5", by.scenario(), groups) as result:
        figure = ride.draw(result)
    _, values = labelled(figure.axes[0], "floor over front bogie left")
    assert np.abs(values[1000:-1000]).max() == pytest.approx(1.0, abs=0.01)  # band pass: 1/(1 + 0.2^4 + 0.2^4)
    assert heights(figure.axes[0]) == {2.5, -2.5}


def test_ensemble_bands(tmp_path):
    """Trains at 1, 2, ... 21 kN, constant: median 11, 5 % at 2, 95 % at 20; a failed one at 99 kN is left out."""
    trains = [{"wheel": by.wheel(np.full((300, 4, 2), k * 1e3), np.full((300, 4, 2), -k * 1e3))} for k in
              (*range(1, 22), 99)]  # fmt: skip
    of = by.scenario(ensemble__size=22)
    with by.made(tmp_path / "a.h5", of, *trains, status="derailed") as result:
        figure = ensemble.draw(result)
    for axes in figure.axes:
        np.testing.assert_allclose(labelled(axes, "median")[1], 11.0)
        whole, band = (c.get_paths()[0].vertices[:, 1] for c in axes.collections)
        assert (whole.min(), whole.max()) == (1.0, 21.0)
        assert (band.min(), band.max()) == pytest.approx((2.0, 20.0))


def test_one_train_is_no_ensemble(tmp_path):
    """The key is named."""
    with (
        by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(*noise(100))}) as result,
        pytest.raises(AbsentError, match=r"ensemble\.size"),
    ):
        ensemble.draw(result)
