"""Archives that lie, each in its own way."""

import io
import zipfile

import numpy as np
import pytest

from benchmarks import hostile_arrays as made


def test_a_directory_that_says_less_than_there_is():
    with zipfile.ZipFile(io.BytesIO(made._shorter(10**6))) as archive:
        (member,) = archive.infolist()
        assert member.file_size == 100
        with pytest.raises(zipfile.BadZipFile):
            archive.open(member).read(100)


def test_a_thousand_files_of_one_content():
    content = made._overlapping()
    assert len(content) < 100_000
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert sum(member.file_size for member in archive.infolist()) == 1000 * 2**20


def test_an_array_made_by_hand_is_one():
    content = made.zipped({"a.npy": made._npy((2,), "<f8", np.array([1.0, 2.0]).tobytes())})
    assert np.load(io.BytesIO(content))["a"].tolist() == [1.0, 2.0]
    assert np.load(io.BytesIO(made._data()["episode_2_40"]))["flights/episode"].max() == 2**40
