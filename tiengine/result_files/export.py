"""Export of results to CSV, Parquet and MATLAB files.

CSV and Parquet files are written in pieces, so that memory does not grow with the length of a run. A MATLAB file of
version 5 is written at once and holds less than 2 GB; for longer runs MATLAB reads the result file by ``h5read``.
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from tiengine.parameters.errors import InputError
from tiengine.parameters.optional_packages import needed_by
from tiengine.result_files.channel_table import ChannelTable, channel_table, select_channels
from tiengine.result_files.output_file import check_output

if TYPE_CHECKING:
    from tiengine.result_files.reader import Reader

__all__ = ["export", "replacing"]

CSV_VALUES = 100_000  # values in memory at once: 13 MB as strings
PARQUET_VALUES = 1_000_000  # values in a row group: at most 8 MB
MAT_BYTES = 2**31 - 1  # limit of a file of version 5
MAT_NAME = 63  # characters of the longest name in MATLAB
MAT_KEYWORDS = frozenset({
    "break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if",
    "otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while",
})  # fmt: skip
"""Reserved words of MATLAB: no name may be one of them."""


def export(
    result: Reader, path: Path | str, *, train: int = 0, channels: Sequence[str] = (), force: bool = False
) -> str:
    """Write channels of one train to a file; its suffix selects the format.

    Args:
        result: Open result.
        path: File to write, ending in ``.csv``, ``.parquet`` or ``.mat``.
        train: Index of the train.
        channels: Groups or channels, for example ``"body"`` or ``"wheel/vertical_force"``; the group ``wheel`` if
            empty. In CSV and Parquet files all channels must be sampled together.
        force: Replace an existing file.

    Returns:
        Description of the contents, such as ``300 rows of 10 columns``.

    Raises:
        InputError: There is no such train or channel, the channels do not fit one table, a package is missing, or the
            file exists already or cannot be written.
    """
    path = Path(path)
    if path.suffix not in _FORMATS:
        raise InputError(f"output = '{path}': must end in {', '.join(_FORMATS)}")
    check_output(path, force)
    return _FORMATS[path.suffix](result, path, train, channels)


def _write_csv(result: Reader, path: Path, train: int, channels: Sequence[str]) -> str:
    table = channel_table(result, train, channels)
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(column.heading for column in table.columns)
        for piece in table.pieces(CSV_VALUES):
            texts = [column.astype(str) for column in piece]  # shortest decimal that reads back to the same number
            writer.writerows(zip(*texts, strict=True))
    return _size(table)


def _write_parquet(result: Reader, path: Path, train: int, channels: Sequence[str]) -> str:
    with needed_by(f"output = '{path}'"):
        import pyarrow as pa
        from pyarrow import parquet
    table = channel_table(result, train, channels)
    datasets = [dataset for dataset in table.datasets for _ in range(_width(dataset))]
    fields = [
        pa.field(column.heading, pa.from_numpy_dtype(dataset.dtype), metadata=_described(column.unit, column.long_name))
        for column, dataset in zip(table.columns, datasets, strict=True)
    ]
    schema = pa.schema(fields, metadata={"scenario": result.scenario_toml, "train": str(train)})
    with replacing(path) as temporary, parquet.ParquetWriter(temporary, schema) as writer:
        for piece in table.pieces(PARQUET_VALUES):
            columns = [np.ascontiguousarray(column) for column in piece]
            writer.write_table(pa.Table.from_arrays([pa.array(column) for column in columns], schema=schema))
    return _size(table)


def _write_mat(result: Reader, path: Path, train: int, channels: Sequence[str]) -> str:
    from scipy.io import savemat

    found = select_channels(result, train, channels)
    size = sum(dataset.nbytes for dataset in found.values())
    if size > MAT_BYTES:
        raise InputError(
            f"output = '{path}': {size / 1e9:.1f} GB: a MATLAB file of version 5 holds less than 2 GB; choose fewer"
            f" channels, or read {result.name} in MATLAB by h5read"
        )
    content: dict[str, Any] = {"facts": _facts(result, train)}
    structs: dict[str, dict[str, Any]] = {"": content}
    for channel, dataset in found.items():
        group, _, name = channel.rpartition("/")
        _add(_struct(structs, group, dataset.parent), name, dataset)
    with replacing(path) as temporary:
        savemat(temporary, content, appendmat=False, long_field_names=True, do_compression=False, oned_as="column")
    return f"{len(found)} channels"


_FORMATS: dict[str, Callable[[Reader, Path, int, Sequence[str]], str]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mat": _write_mat,
}


def _struct(structs: dict[str, dict[str, Any]], path: str, group: Any) -> dict[str, Any]:
    """MATLAB structure of a group, with its coordinates; created at the first call.

    Args:
        structs: Structures created so far, by path.
        path: Path of the group within the train.
        group: HDF5 group.
    """
    if path not in structs:
        above, _, name = path.rpartition("/")
        outer = structs[above] if above in structs else _struct(structs, above, group.parent)
        structs[path] = outer[_matlab_name(name, outer)] = {}
        for label, values in group.items():
            if isinstance(values, h5py.Dataset) and "coordinates" not in values.attrs:
                _add(structs[path], label, values)
    return structs[path]


def _add(struct: dict[str, Any], name: str, dataset: Any) -> None:
    """Add a dataset and its unit to a MATLAB structure; strings become a cell array."""
    is_text = h5py.check_string_dtype(dataset.dtype)
    key = _matlab_name(name, struct)
    struct[key] = np.array(dataset.asstr()[:], dtype=object) if is_text else dataset[()]
    struct.setdefault("units", {})[key] = str(dataset.attrs.get("units", "1"))


def _facts(result: Reader, train: int) -> dict[str, Any]:
    """Origin of the data: file, train, scenario and the attributes of the train."""
    own: dict[str, Any] = {}
    for name, value in result.facts(train).items():
        is_texts = isinstance(value, list) and all(isinstance(item, str) for item in value)
        own[_matlab_name(name, own)] = np.array(value, dtype=object) if is_texts else value
    return {**own, "file": result.name, "train": train, "scenario": result.scenario_toml}


def _matlab_name(name: str, taken: dict[str, Any]) -> str:
    """Valid and unused MATLAB name: letters, digits and underscores, beginning with a letter, no reserved word."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    is_name = plain[:1].isalpha() and plain not in MAT_KEYWORDS
    plain = (plain if is_name else f"x{plain}")[:MAT_NAME]
    stem, count = plain[: MAT_NAME - 4], 2
    while plain in taken:
        plain, count = f"{stem}_{count}", count + 1
    return plain


def _described(unit: str, long_name: str) -> dict[str, str]:
    return {"unit": unit, "long_name": long_name}


def _width(dataset: Any) -> int:
    """Number of columns of a dataset."""
    return int(np.prod(dataset.shape[1:], dtype=np.int64))


def _size(table: ChannelTable) -> str:
    return f"{table.rows} rows of {len(table.columns)} columns"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Temporary file that is renamed to its final name when complete, and removed otherwise."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"output = '{path}': cannot be written ({error.strerror or error})") from None
    finally:
        temporary.unlink(missing_ok=True)
