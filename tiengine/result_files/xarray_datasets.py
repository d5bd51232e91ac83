"""Results as xarray datasets, with the coordinates, units and long names of the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tiengine.parameters.errors import InputError
from tiengine.parameters.optional_packages import needed_by

if TYPE_CHECKING:
    import h5py
    import xarray

    from tiengine.result_files.reader import Reader

__all__ = ["open_dataset", "stacked_dataset"]

ALONG_TRACK = ("time", "seat", "slab")
"""Dimensions along which trains may cover different ranges; missing samples are filled with NaN."""


def open_dataset(result: Reader, file: h5py.File, group: str, train: int) -> xarray.Dataset:
    """Group of one train; channels are read on access, while the result is open.

    Args:
        result: Open result.
        file: HDF5 file of the result.
        group: Name of the group, for example ``"wheel"`` or ``"gauges/bridge"``.
        train: Index of the train.

    Raises:
        InputError: There is no such train or group, or a package is missing.
    """
    xr, h5netcdf = _packages()
    facts = result.facts(train)
    path = f"trains/{train:03d}/{group}"
    if not hasattr(result[path], "keys"):
        raise InputError(f"{result.name}: {path!r} is a channel; name its group")
    store = xr.backends.H5NetCDFStore(h5netcdf.File(file, "r"), group=path)
    dataset: xarray.Dataset = xr.open_dataset(store, decode_times=False)
    return dataset.assign_attrs(train=train, file=result.name, **facts)


def stacked_dataset(result: Reader, file: h5py.File, group: str) -> xarray.Dataset:
    """Group of all trains, read into memory, with the additional dimension ``train``.

    Trains that ran a shorter distance are filled with NaN. A train that failed before its first sample is omitted.
    Seed and status of the trains become coordinates.

    Args:
        result: Open result.
        file: HDF5 file of the result.
        group: Name of the group, as in :func:`open_dataset`.

    Raises:
        InputError: No train has such a group, or trains differ in vehicles, time step or gauges.
    """
    xr, _ = _packages()
    held = [train for train in range(result.trains) if f"trains/{train:03d}/{group}" in file]
    if not held:
        raise InputError(f"{result.name}: no train has a group {group!r}")
    sets = [open_dataset(result, file, group, train).load() for train in held]
    for train, dataset in zip(held, sets, strict=True):
        _check_alike(f"{result.name}: trains {held[0]} and {train}", sets[0], dataset)
    index = xr.Variable("train", np.array(held))
    stacked: xarray.Dataset = xr.concat(
        sets, index, data_vars="all", coords="different", compat="equals", join="outer", combine_attrs="drop_conflicts"
    )
    facts = [result.facts(train) for train in held]
    labels = {key: ("train", [fact[key] for fact in facts]) for key in ("seed", "status") if key in facts[0]}
    return stacked.assign_coords(labels)


def _check_alike(which: str, first: xarray.Dataset, other: xarray.Dataset) -> None:
    """Refuse trains whose coordinates differ."""
    for name in first.dims:
        ours, theirs = first[name].values, other[name].values
        if name in ALONG_TRACK:
            n = min(len(ours), len(theirs))
            if name == "time" and not np.array_equal(ours[:n], theirs[:n]):
                raise InputError(f"{which} have different time steps; open them one by one")
        elif not np.array_equal(ours, theirs):
            raise InputError(f"{which} differ along {name!r}; open them one by one")
    for name in ("wheelset_vehicle", "wheelset_offset"):
        if name in first.coords and not np.array_equal(first[name].values, other[name].values):
            raise InputError(f"{which} have different vehicles; open them one by one")


def _packages() -> tuple[Any, Any]:
    """Import xarray and h5netcdf, which are optional dependencies."""
    with needed_by("to_xarray"):
        import h5netcdf
        import xarray
    return xarray, h5netcdf
