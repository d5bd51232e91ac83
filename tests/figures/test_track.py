"""Figures of the track side: extremes of seats and slabs, defects, deflection, gauges."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from tiengine.figures import envelopes, gauges, waterfall
from tiengine.indices.extremes import read_extremes
from tiengine.indices.key_figures import key_figures
from tiengine.indices.train_record import AbsentError, Train
from tiengine.result import Result

from .. import hand_made as by

FAILED = slice(160, 163)
QUIET = np.zeros((2000, 4, 2))  # 2 s, 194 m: the train stands at 14 m first, 208.3 m last


def track(path: Path, seats: dict, slabs: dict, **changes) -> Result:
    """A run over 194 m with these extremes."""
    return by.made(path, by.scenario(**changes), {"wheel": by.wheel(QUIET, QUIET), "seats": seats, "slabs": slabs})


def line(axes, **look):
    """The line of that look."""
    for each in axes.get_lines():
        if all(getattr(each, f"get_{key}")() == value for key, value in look.items()):
            return each.get_xydata().T
    raise AssertionError(f"no line {look}")


def titles(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


def test_where_the_train_has_been(tmp_path):
    """By hand: wheels came to 8.0 to 222.3 m, all of them to 28.0 to 202.3 m; seats stand at (j + 1/2) 0.63 m."""
    with track(tmp_path / "a.h5", by.seats(400), by.slabs(45)) as result:
        seats = read_extremes(Train(result), "seats", "output.envelopes")
    chainage = (np.arange(400) + 0.5) * 0.63
    end = by.START + by.V * 1.999
    np.testing.assert_array_equal(seats.reached, (chainage >= 8.0) & (chainage <= end + 10.0))
    np.testing.assert_array_equal(seats.passed, (chainage >= 28.0) & (chainage <= end - 10.0))
    assert seats.partly_passed[0] == pytest.approx((13 * 0.63, 44 * 0.63))  # seats 13 to 43, half a pitch more
    assert seats.defects == []


def test_envelopes_are_those_of_the_file(tmp_path):
    """Forces in kN over chainage, from the first to the last seat that a wheel came to."""
    rng = np.random.default_rng(2)
    seats = by.seats(400, **{"largest_vertical_force": 1e4 * rng.random((400, 2))})
    with track(tmp_path / "a.h5", seats, by.slabs(45, void=24)) as result:
        figure = envelopes.draw(result)
        reached = read_extremes(Train(result), "seats", "output.envelopes").reached
    axes = dict(zip(titles(figure), figure.axes, strict=True))
    vertical = next(axes[title] for title in axes if "largest vertical force" in title)
    for label, side in (("left", 0), ("right", 1)):
        x, values = line(vertical, label=label)
        np.testing.assert_allclose(x, seats["chainage"][reached])
        np.testing.assert_allclose(values, 1e-3 * seats["largest_vertical_force"][reached, side])
    mortar = next(axes[title] for title in axes if title.startswith("Mortar: "))
    x, values = line(mortar, linestyle="-")
    assert values[x == 24.5 * by.SLAB] == pytest.approx([80.0])


def test_shapes_of_rails_and_ground_are_drawn_beneath(tmp_path):
    """A settlement and a weld of the left rail in mm over chainage, down positive; nothing where a file has gone."""
    ground = [{"kind": "cosine", "at": 100.0, "length": 40.0, "depth": 0.012}]
    weld = [{"kind": "weld", "rail": "left", "at": 60.0, "length": 1.0, "depth": 5e-4}]
    seats, slabs = by.seats(400), by.slabs(45)
    with track(
        tmp_path / "a.h5", seats, slabs, train__distance=194.0, track__ground=ground, track__rail_shapes=weld
    ) as result:
        figure = envelopes.draw(result)
        figures = {figure.name: figure for figure in key_figures(Train(result))}
    rails, ground = figure.axes[-2:]
    x, values = line(rails, linestyle="-")
    assert values[np.argmin(np.abs(x - 60.0))] == pytest.approx(0.5, rel=0.02)  # the patch's filter rounds it
    assert not line(rails, linestyle="--")[1].any()
    x, values = line(ground, linestyle="-")
    assert x[np.argmax(values)] == pytest.approx(100.0, abs=0.2)
    assert values.max() == pytest.approx(12.0, rel=1e-4)
    assert ground.yaxis_inverted()
    assert figures["largest vertical displacement of the ground"].value == pytest.approx(12.0, rel=1e-4)
    with track(tmp_path / "b.h5", seats, slabs, track__ground=[{"kind": "file", "file": "no.csv"}]) as bare:
        assert len(envelopes.draw(bare).axes) == 4


def test_load_shed_to_the_neighbours(tmp_path):
    """Neighbours bear 25 kN, sound seats 10 kN: 2.50 is written at seats 159 and 163, the ratio's axis agrees."""
    with track(tmp_path / "a.h5", by.seats(400, FAILED), by.slabs(45)) as result:
        figure = envelopes.draw(result)
    near = figure.axes[0]
    assert near.get_title(loc="left") == "Load on the neighbours of seats 160 to 162"
    assert [(text.get_text(), *text.xy) for text in near.texts] == [("2.50", 159, 25.0), ("2.50", 163, 25.0)]
    index, values = line(near, label="left")
    np.testing.assert_array_equal(index, np.arange(150, 173))
    np.testing.assert_array_equal(values[10:13], 0.0)
    figure.draw_without_rendering()  # sets the second axis
    (ratio,) = near.child_axes
    assert np.array(ratio.get_ylim()) == pytest.approx(np.array(near.get_ylim()) / 10.0)


def test_defects_are_marked(tmp_path):
    """Failed seats from 100.8 to 102.69 m, a void under 136.08 to 141.75 m, in every panel of the whole run."""
    with track(tmp_path / "a.h5", by.seats(400, FAILED), by.slabs(45, void=24)) as result:
        figure = envelopes.draw(result)
    below = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(("Fastenings", "Mortar: ", "Slabs"))]
    assert len(below) == 4
    for axes in below:
        spans = {patch.get_label(): patch.get_x() for patch in axes.patches}
        widths = {patch.get_label(): patch.get_width() for patch in axes.patches}
        assert spans["fastenings with a defect"] == pytest.approx(160 * 0.63)
        assert widths["fastenings with a defect"] == pytest.approx(3 * 0.63)
        assert spans["slab over a void"] == pytest.approx(24 * 5.67)
        assert widths["slab over a void"] == pytest.approx(5.67)
    assert "Mortar around slab 24" in titles(figure)
    assert ["1.60"] == [text.get_text() for text in figure.axes[1].texts]  # 80 over 50 kPa


def test_sound_seats_are_far_from_defects(tmp_path):
    """Neighbours within ten seats bear 25 kN: the median stays 10 kN. If no seat is far, all sound ones count."""
    wide = by.seats(400, FAILED)
    wide["largest_vertical_force"][150:160] = wide["largest_vertical_force"][163:173] = 25e3
    with track(tmp_path / "a.h5", wide, by.slabs(45)) as result:
        assert read_extremes(Train(result), "seats", "output.envelopes").sound_median("largest_vertical_force") == 10e3
    every = by.seats(400)
    every["factor"][::5] = 0.0
    with track(tmp_path / "b.h5", every, by.slabs(45)) as result:
        seats = read_extremes(Train(result), "seats", "output.envelopes")
    assert (seats.sound == seats.passed & (every["factor"] == 1.0).all(axis=1)).all()


def deflected(count: int, spacing: float = 5.0) -> dict:
    """Snapshots every 5 m: the rail goes down by k mm in the k-th, the slab by a tenth, not a number over joints."""
    position = by.START + spacing * np.arange(count)
    offset = np.linspace(-14.0, 14.0, 113)
    rail = 1e-3 * np.arange(1.0, count + 1)[:, None, None] * np.ones((1, 2, 113))
    slab = 0.1 * rail
    slab[:, :, 5] = np.nan
    return {"time": position / by.V, "position": position, "offset": offset, "rail": rail, "slab": slab}


def test_waterfall_shows_the_snapshots(tmp_path):
    """Four pictures in mm, one scale a row; chainage at the edges between snapshots."""
    snapshots = deflected(6)
    snapshots["rail"][:, 1] *= 0.5
    groups = {"wheel": by.wheel(QUIET, QUIET), "deflection": snapshots}
    with by.made(tmp_path / "a.h5", by.scenario(), groups) as result:
        figure = waterfall.draw(result)
    pictures = [axes.collections[0] for axes in figure.axes[2:6]]
    for side in range(2):
        np.testing.assert_allclose(pictures[side].get_array(), 1e3 * snapshots["rail"][:, side])
        assert pictures[side].norm is pictures[0].norm
    assert np.ma.masked_invalid(pictures[2].get_array()).mask.sum() == 6
    edges = pictures[0].get_coordinates()[:, 0, 1]
    np.testing.assert_allclose(edges, [18.0, 20.5, 25.5, 30.5, 35.5, 40.5, 43.0])


def test_long_waterfalls_keep_the_largest(tmp_path):
    """1000 snapshots in 40 rows: the largest of each 25, which is neither the first nor the last."""
    snapshots = deflected(1000)
    snapshots["rail"] = snapshots["rail"].reshape(40, 25, 2, 113)[:, np.random.default_rng(1).permutation(25)]
    snapshots["rail"] = snapshots["rail"].reshape(1000, 2, 113)
    edges, rail = waterfall.largest_by_stretch(
        {key: np.asarray(value) for key, value in snapshots.items()}, "rail", rows=40
    )
    np.testing.assert_allclose(rail[:, 0, 0], 1e-3 * 25.0 * np.arange(1, 41))
    assert edges.shape == (41,)
    assert (np.diff(edges) > 0.0).all()


def test_gauges_are_those_of_the_file(tmp_path):
    """Displacement in mm, forces in kN; the four wheels of a train that passes 60 m are marked."""
    times = by.clock(1000, 1e-3)
    shape = np.random.default_rng(3).standard_normal((1000, 2))
    motion = {"displacement": 1e-3 * shape, "velocity": shape, "acceleration": shape, "direction": np.arange(2)}
    where = {"on": "rail", "chainage": 60.0, "side": "left"}
    force = {"vertical_force": 1e3 * shape[:, 1], "lateral_force": 1e3 * shape[:, 0]}
    path = by.written(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(QUIET, QUIET)})
    with h5py.File(path, "a") as file:
        for name, channels, on in (("a", motion, "rail"), ("b", force, "fastening")):
            group = file.create_group(f"trains/000/gauges/{name}")
            group.attrs.update({**where, "on": on})
            for key, values in {**times, **channels}.items():
                group[key] = values
    with Result(h5py.File(path), str(path)) as result:
        figure = gauges.draw(result)
    rail, fastening = figure.axes[:3], figure.axes[3:5]
    np.testing.assert_allclose(rail[0].get_lines()[0].get_ydata(), shape[:, 1])  # vertical first
    np.testing.assert_allclose(rail[0].get_lines()[1].get_ydata(), shape[:, 0])
    np.testing.assert_allclose(rail[1].get_lines()[0].get_ydata(), 1e3 * shape[:, 1])  # mm/s
    np.testing.assert_allclose(fastening[0].get_lines()[0].get_ydata(), shape[:, 1])
    passing = [each.get_xdata()[0] for each in rail[0].get_lines()[2:]]
    assert passing == pytest.approx([(60.0 - offset - by.START) / by.V for offset in by.OFFSET])


@pytest.mark.parametrize(
    ("figure", "key"),
    [(envelopes, r"output\.envelopes"), (waterfall, r"output\.deflection_interval"), (gauges, r"\[\[gauges\]\]")],
)
def test_older_files_lack_groups(tmp_path, figure, key):
    """One sentence that names the key."""
    with (
        by.made(tmp_path / "a.h5", by.scenario(), {"wheel": by.wheel(QUIET, QUIET)}) as result,
        pytest.raises(AbsentError, match=key),
    ):
        figure.draw(result)
