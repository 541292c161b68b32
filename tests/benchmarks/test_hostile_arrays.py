"""Malicious archives have the defects that their names state."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from benchmarks import hostile_arrays
from drone_rl.training.demonstrations import read_demonstration, read_demonstrations
from drone_rl.utils.errors import InputError


def test_a_directory_that_declares_too_few_bytes():
    with zipfile.ZipFile(io.BytesIO(hostile_arrays._shorter(10**6))) as archive:
        (member,) = archive.infolist()
        assert member.file_size == 100
        with pytest.raises(zipfile.BadZipFile):
            archive.open(member).read(100)


def test_a_thousand_entries_share_one_content():
    content = hostile_arrays._overlapping()
    assert len(content) < 100_000
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert sum(member.file_size for member in archive.infolist()) == 1000 * 2**20


@pytest.mark.parametrize(("head", "zeros"), [(b"abc", 5), (b"", 2**22), (b"abc" * 9, 2**21 + 1)])
def test_zeros_are_compressed_block_by_block(head, zeros):
    content = hostile_arrays.zipped_zeros("x", head, zeros)
    assert len(content) < 300 + zeros / 900
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        assert archive.read("x") == head + bytes(zeros)


def test_a_hand_written_array_is_valid():
    content = hostile_arrays.zipped(
        {"a.npy": hostile_arrays._npy((2,), "<f8", np.array([1.0, 2.0]).tobytes())}
    )
    assert np.load(io.BytesIO(content))["a"].tolist() == [1.0, 2.0]
    assert (
        np.load(io.BytesIO(hostile_arrays._data()["episode_2_40"]))["flights/episode"].max()
        == 2**40
    )


def test_demonstrations_are_valid_except_for_their_defect(tmp_path):
    flight = hostile_arrays._flight()
    np.savez(tmp_path / "flight_00000.npz", **flight)
    assert len(read_demonstration(tmp_path / "flight_00000.npz")) == 1
    (tmp_path / "cases").mkdir()
    archives = {"no_array": hostile_arrays.zipped({"a.npy": b"hello"})}
    cases = hostile_arrays._demonstrations(tmp_path / "cases", archives)
    assert len(cases) == 21 and len({name for name, *_ in cases}) == len(cases)
    for _, command, _ in cases:
        folder = Path(command[1].partition("=")[2])
        with pytest.raises(InputError) as error:
            read_demonstrations(folder)
        assert "\n" not in str(error.value)
