"""Results in xarray: labels, units, laziness, ensembles."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from tiengine import result as results
from tiengine.parameters.errors import InputError
from tiengine.result_files.channels import SEATS, WHEEL
from tiengine.result_files.layout import Block, GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer

OFFSETS = np.array([10.0, 7.5, -7.5, -10.0])
NAMES = ("vertical_force", "lateral_force")
GROUPS = {"wheel": GroupSpec.standard("wheel", NAMES), "seats": GroupSpec.standard("seats", tuple(SEATS))}


def write(path: Path | None, steps=(100, 100), dt=(1e-3, 1e-3), offsets=(OFFSETS, OFFSETS), first=(0, 0)):
    """Trains of so many steps; their wheel forces are 1000 train + sample number."""
    labels = [TrainLabels(["coach"], ["car"], np.zeros(4, np.int64), offset) for offset in offsets]
    with Writer(path, 'name = "fake"\n', {}, labels, GROUPS) as writer:
        for train, (count, step) in enumerate(zip(steps, dt, strict=True)):
            time = np.arange(1, count + 1) * step
            force = np.broadcast_to((1000.0 * train + np.arange(count))[:, None, None], (count, 4, 2))
            seat = first[train] + np.arange(20)
            extremes = {name: np.broadcast_to(seat[:, None] + 0.25 * train, (20, 2)) for name in SEATS}
            writer.write(
                train,
                {
                    "wheel": Block(time, 90.0 * time, dict.fromkeys(NAMES, force)),
                    "seats": Block(seat, 0.63 * (seat + 0.5), extremes),
                },
            )
            writer.describe(train, {"seed": 11 + train, "status": "complete" if count == 100 else "derailed"})
        return results.Result.of(writer.close({"status": "complete"}))


@pytest.mark.parametrize("in_memory", [True, False])
def test_labels_units_and_values(tmp_path, in_memory):
    """From a file and from a run that was kept in memory."""
    with write(None if in_memory else tmp_path / "a.h5") as result:
        wheel = result.to_xarray("wheel", 1)
        assert wheel.vertical_force.dims == ("time", "wheelset", "side")
        assert wheel.vertical_force.attrs == {"units": "N", "long_name": WHEEL["vertical_force"].long_name}
        assert list(wheel.side.values) == ["left", "right"]
        assert set(wheel.coords) == {"time", "position", "wheelset", "side", "wheelset_vehicle", "wheelset_offset"}
        assert wheel.attrs["seed"] == 12
        assert wheel.vertical_force.sel(wheelset=2, side="right").isel(time=7).item() == 1007.0
        seats = result.to_xarray("seats")
        assert seats.chainage.sel(seat=3).item() == 0.63 * 3.5


def test_channels_are_read_when_asked_for(tmp_path):
    """Loaded values remain; others cannot be read from a closed file."""
    with write(tmp_path / "a.h5") as result:
        wheel = result.to_xarray()
        kept = wheel.lateral_force.load()
        assert not wheel.vertical_force.variable._in_memory
    assert kept.max().item() == 99.0
    with pytest.raises(Exception, match=r"[Cc]losed|[Ii]nvalid|Not a dataset"):
        wheel.vertical_force.max()


def test_ensemble_is_stacked():
    """A train that failed is filled with NaN, and so are seats that a train did not pass."""
    with write(None, steps=(100, 60), first=(0, 5)) as result:
        wheel = result.to_xarray("wheel", None)
        seats = result.to_xarray("seats", None)
    assert dict(wheel.sizes) == {"train": 2, "time": 100, "wheelset": 4, "side": 2}
    assert list(wheel.seed.values) == [11, 12]
    assert list(wheel.status.values) == ["complete", "derailed"]
    first, second = wheel.vertical_force.isel(wheelset=0, side=0).values
    assert np.array_equal(first, np.arange(100.0))
    assert np.array_equal(second[:60], 1000.0 + np.arange(60.0))
    assert np.isnan(second[60:]).all()
    assert wheel.vertical_force.attrs["units"] == "N"
    assert list(seats.seat.values) == list(range(25))
    assert np.isnan(seats.factor.sel(train=1, seat=4, side="left").item())
    assert seats.factor.sel(train=1, seat=5, side="left").item() == 5.25


@pytest.mark.parametrize(
    ("differing", "said"),
    [({"dt": (1e-3, 2e-3)}, "different time steps"), ({"offsets": (OFFSETS, OFFSETS + 1.0)}, "different vehicles")],
)
def test_trains_that_differ_are_not_stacked(differing, said):
    with write(None, **differing) as result, pytest.raises(InputError, match=said):
        result.to_xarray("wheel", None)


def test_what_is_not_there(tmp_path, monkeypatch):
    with write(tmp_path / "a.h5") as result:
        with pytest.raises(InputError, match=r"set output\.envelopes = true"):
            result.to_xarray("slabs")
        with pytest.raises(InputError, match="no train has a group 'whel'"):
            result.to_xarray("whel", None)
        with pytest.raises(InputError, match="trains/005"):
            result.to_xarray("wheel", 5)
        with pytest.raises(InputError, match="is a channel; name its group"):
            result.to_xarray("wheel/vertical_force")
        monkeypatch.setitem(sys.modules, "h5netcdf", None)
        with pytest.raises(InputError, match=r"needs h5netcdf; pip install 'tiengine\[xarray\]'"):
            result.to_xarray("wheel")


def test_opens_again_after_it_was_closed(tmp_path):
    """Nothing holds the file: it can be opened, read and closed many times."""
    write(tmp_path / "a.h5").close()
    for _ in range(3):
        with results.open(tmp_path / "a.h5") as result:
            assert result.to_xarray().vertical_force.max().item() == 99.0
