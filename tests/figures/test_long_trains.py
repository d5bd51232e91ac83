"""Figures of trains of many wheelsets: the worst one named and drawn, bands for the others, few lines."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from tiengine import result as results
from tiengine.figures import contact, ensemble, forces, gauges, ride, spectrum

from .. import hand_made as by
from .. import long_trains as long

RUN_IN = 10.0
rng = np.random.default_rng(1)


def pushing(cars: int, samples: int, wheelset: int, force: float) -> dict:
    """One wheelset (from 0) pushes to the right with its left wheel."""
    found = long.wheel(cars, samples)
    found["lateral_force"][:, wheelset, 0] = force
    return found


def test_forces_show_the_worst_wheelset(tmp_path):
    """Wheelset 7 pushes with 20 kN and is named; wheelset 11 is worse only before its run-in ends at 60 m."""
    wheel = pushing(3, 1200, 6, 20e3)
    early = by.V * 1e-3 * np.arange(1200) < 50.0  # the 20 Hz filter settles within 5 m, a mean has 2 m
    wheel["lateral_force"][early, 10, 1] = 90e3
    with by.made(tmp_path / "a.h5", long.train_of(3, output__run_in=RUN_IN), {"wheel": wheel}) as result:
        figure = forces.draw(result)
    main, by_vehicle = figure.axes[::2], figure.axes[1::2]
    assert [axes.get_title(loc="left").endswith("wheelset 7, vehicle 2") for axes in main] == [False, True, True, True]
    (line,) = (line for line in main[2].lines if line.get_label() == "worst wheelset")
    np.testing.assert_allclose(line.get_ydata(), 20.0, rtol=1e-6)
    assert line.get_xdata()[0] == pytest.approx(by.START + long.offsets(3)[6] + 1.0, abs=0.1)
    assert main[0].get_xlim()[0] == pytest.approx(by.START + by.OFFSET[0])
    ranges, worst = by_vehicle[2].collections
    assert len(ranges.get_segments()) == 12
    np.testing.assert_allclose(worst.get_segments()[0], [[2.15, 20.0], [2.15, 20.0]], atol=0.2)


def test_no_figure_has_a_line_for_every_wheelset(tmp_path):
    """16 cars: 64 wheelsets are bands, ranges and at most eight lines a panel."""
    wheel = long.wheel(16, 1500)
    shape = wheel["vertical_force"].shape
    more = {name: 1e-3 * rng.standard_normal(shape) for name in ("contact_position_wheel", "contact_position_rail")}
    wheel |= {"normal_force": wheel["vertical_force"], **more}
    groups = {"wheel": wheel, "body": long.body(16, 1500)}
    with by.made(tmp_path / "a.h5", long.train_of(16), groups) as result:
        figures = [each.draw(result) for each in (forces, contact, spectrum)]
    assert max(len(axes.lines) for figure in figures for axes in figure.axes) <= 8


def test_contact_positions_leave_the_run_in_of_each_vehicle_out(tmp_path):
    """The second car's left wheels run at 3 mm before 35 m and at 1 mm after it, like all others."""
    wheel = long.wheel(2, 900)
    position = np.full(wheel["vertical_force"].shape, 1.1e-3)
    position[by.V * 1e-3 * np.arange(900) < 34.9, 4:] = 3.1e-3
    wheel |= {"normal_force": wheel["vertical_force"]}
    wheel |= {"contact_position_wheel": position, "contact_position_rail": position}
    with by.made(tmp_path / "a.h5", long.train_of(2, output__run_in=RUN_IN), {"wheel": wheel}) as result:
        figure = contact.draw(result)
    shares, edges, _ = figure.axes[0].patches[0].get_data()
    assert shares[np.searchsorted(edges, 1.1) - 1] == pytest.approx(100.0)


def test_spectra_of_all_vehicles(tmp_path):
    """Cars heave at 8 Hz with 0.5, 1 and 1.5 m/s^2: the line is the mean of their densities, the band their range."""
    time = 1e-3 * np.arange(5000)
    moving = long.body(3, 5000)
    for k in range(3):
        moving["acceleration"][:, 7 * k, 1] = 0.5 * (k + 1) * np.sin(16.0 * np.pi * time)
    wheel = long.wheel(3, 5000)
    wheel["vertical_force"] += 1e3 * rng.standard_normal(wheel["vertical_force"].shape)
    with by.made(tmp_path / "a.h5", long.train_of(3), {"wheel": wheel, "body": moving}) as result:
        figure = spectrum.draw(result)
    axes = figure.axes[1]
    (line,) = (line for line in axes.lines if line.get_label() == "car, vertical")
    f, S = line.get_data()
    assert S.sum() * (f[1] - f[0]) == pytest.approx((0.125 + 0.5 + 1.125) / 3.0, rel=1e-6)  # whole periods in a window
    assert "vehicles 1 to 3" in axes.get_title(loc="left")
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert band.max() / S.max() == pytest.approx(1.125 * 3.0 / 1.75, rel=1e-6)


def test_spectra_of_vehicles_after_their_run_in(tmp_path):
    """60 m after 10 m of run-in: 0.62 s for the first car, 0.36 s for the second, which is too short."""
    samples = int(70.0 / by.V / 1e-3)
    wheel = long.wheel(2, samples)
    wheel["vertical_force"] += 1e3 * rng.standard_normal(wheel["vertical_force"].shape)
    with by.made(tmp_path / "a.h5", long.train_of(2, output__run_in=RUN_IN), {"wheel": wheel}) as result:
        title = spectrum.draw(result).axes[0].get_title(loc="left")
    assert title == "Wheel forces, mean over all wheels of the leading vehicle"


def test_ride_shows_the_worst_vehicle(tmp_path):
    """The third car sways by 1 m/s^2 at 2 Hz, the second heaves by 2 m/s^2."""
    time = 1e-3 * np.arange(6000)
    moving = long.body(3, 6000)
    moving["acceleration"][:, 14, 0] = np.sin(4.0 * np.pi * time)
    moving["acceleration"][:, 7, 1] = 2.0 * np.sin(4.0 * np.pi * time)
    with by.made(tmp_path / "a.h5", long.train_of(3), {"wheel": long.wheel(3, 6000), "body": moving}) as result:
        figure = ride.draw(result)
    lateral, vertical = figure.axes
    assert lateral.get_title(loc="left") == "Lateral acceleration; vehicle 3"
    assert vertical.get_title(loc="left") == "Vertical acceleration; vehicle 2"
    (line,) = (line for line in vertical.lines if line.get_label() == "worst vehicle, floor over front bogie left")
    assert np.abs(line.get_ydata()).max() == pytest.approx(2.0, rel=0.02)  # band pass at 2 Hz
    centre = by.START - long.PITCH
    assert line.get_xdata()[0] == pytest.approx(centre + 1.25 * by.V, abs=by.V * 1e-3)  # the filter's settling


def test_ensemble_shows_all_wheelsets(tmp_path):
    """The last wheelset of every train has 99 kN on the track that it reaches."""
    trains = []
    for _ in range(3):
        wheel = long.wheel(2, 900)
        wheel["vertical_force"][:, 7, 0] = 99e3
        trains.append({"wheel": wheel})
    with by.made(tmp_path / "a.h5", long.train_of(2, ensemble__size=3), *trains) as result:
        figure = ensemble.draw(result)
    assert "all wheelsets of 3 trains" in figure.get_suptitle()
    (line,) = (line for line in figure.axes[0].lines if line.get_label() == "median")
    x, largest = line.get_data()
    assert x[0] > by.START + by.OFFSET[0]
    last = by.START + by.V * 1e-3 * 899 + long.offsets(2)[7]  # chainage of the last wheelset at the end
    np.testing.assert_allclose(largest[x < last - 2.0], 99.0)
    np.testing.assert_allclose(largest[x > last + 2.0], 1e-3 * long.STATIC)


def test_gauges_mark_passing_vehicles(tmp_path):
    """A gauge at 60 m: each of two cars is a stretch of 20 m of the train, 25 m apart."""
    samples = 900
    shape = np.zeros((samples, 2))
    motion = {"displacement": shape, "velocity": shape, "acceleration": shape, "direction": np.arange(2)}
    path = by.written(tmp_path / "a.h5", long.train_of(2), {"wheel": long.wheel(2, samples)})
    with h5py.File(path, "a") as file:
        group = file.create_group("trains/000/gauges/a")
        group.attrs.update({"on": "rail", "chainage": 60.0, "side": "left"})
        for key, values in {**by.clock(samples, 1e-3), **motion}.items():
            group[key] = values
    with results.open(path) as result:
        figure = gauges.draw(result)
    assert "passing vehicles in grey" in figure.get_suptitle()
    spans = figure.axes[0].patches
    first = (60.0 - by.START - by.OFFSET[0]) / by.V
    np.testing.assert_allclose([span.get_x() for span in spans], [first, first + long.PITCH / by.V], atol=1e-9)
    np.testing.assert_allclose([span.get_width() for span in spans], 20.0 / by.V, atol=1e-9)
