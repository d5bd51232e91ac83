"""Packages that only some features need, and the extra of this package that installs each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tiengine.parameters.errors import InputError

__all__ = ["EXTRAS", "needed_by"]

EXTRAS = {
    "xarray": "xarray",
    "h5netcdf": "xarray",
    "pyarrow": "parquet",
    "distributed": "dask",
    "submitit": "slurm",
    "SALib": "sensitivity",
    "zarr": "datasets",
}
"""Extra of each optional package."""


@contextmanager
def needed_by(feature: str) -> Iterator[None]:
    """Import optional packages within; a missing one is named with the extra that installs it.

    Args:
        feature: Key and value, or the feature that needs them, for the message.

    Raises:
        InputError: A package is missing.
    """
    try:
        yield
    except ImportError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        raise InputError(f"{feature}: needs {package}; pip install 'tiengine[{EXTRAS[package]}]'") from None
