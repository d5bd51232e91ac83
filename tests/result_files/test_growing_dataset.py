"""Appending to a dataset: whole chunks are written at once, the rest with a flush."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from tiengine.result_files.growing_dataset import GrowingDataset


@pytest.mark.parametrize("pieces", [[3, 3, 3, 3], [25], [4, 1, 9, 10, 1], [10, 10], [0, 7, 0]])
def test_pieces_of_any_length_follow_each_other(tmp_path: Path, pieces: list[int]):
    rng = np.random.default_rng(3)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        dataset = file.create_dataset("x", (0, 2), "f4", maxshape=(None, 2), chunks=(10, 2), fletcher32=True)
        growing, expected = GrowingDataset(dataset), np.zeros((0, 2))
        for count in pieces:
            piece = rng.standard_normal((count, 2))
            growing.extend(piece)
            expected = np.concatenate([expected, piece])
            piece[:] = np.nan  # a buffer that is used again
            assert growing.length == len(expected)
            assert dataset.shape[0] == len(expected) // 10 * 10
        growing.flush()
        np.testing.assert_array_equal(dataset[:], expected.astype("f4"))
        growing.flush()
        assert dataset.shape[0] == growing.length == sum(pieces)


def test_continuing_overwrites_what_is_beyond_the_kept_samples(tmp_path: Path):
    """Of 17 samples five are kept; twelve others follow, and what lies beyond them stays until then."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        dataset = file.create_dataset("x", data=np.arange(17.0), maxshape=(None,), chunks=(10,))
        growing = GrowingDataset(dataset, 5)
        growing.extend(-np.arange(4.0))
        growing.flush()
        assert dataset[:].tolist() == [0, 1, 2, 3, 4, 0, -1, -2, -3, *range(9, 17)]
        growing.extend(-np.arange(4.0, 12.0))
        growing.flush()
        assert dataset[:].tolist() == [0, 1, 2, 3, 4, *(-np.arange(12.0))]
        assert growing.length == 17
