import io
import struct
import zipfile

import numpy as np
import pytest

from drone_rl.utils.archives import read_array, read_arrays
from drone_rl.utils.errors import InputError


def archive(data, method=zipfile.ZIP_STORED):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as target:
        target.writestr("a.npy", data)
    return file.getvalue()


def npy(shape, dtype="<f4", data=b""):
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


@pytest.mark.parametrize(
    "value",
    [
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.arange(6).reshape(2, 3)),
        np.array("text"),
        np.zeros((0, 3), np.float16),
    ],
)
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_arrays_round_trip(tmp_path, value, save):
    save(tmp_path / "a.npz", a=value)
    arrays = read_arrays(tmp_path / "a.npz")
    assert list(arrays) == ["a"]
    assert arrays["a"].dtype == value.dtype
    assert arrays["a"].flags.writeable
    np.testing.assert_array_equal(arrays["a"], value)


@pytest.mark.parametrize(
    "content",
    [
        archive(npy((10**12,))),
        archive(npy((2,), data=b"1234")),
        archive(npy((-1, -1), data=b"1234")),
        archive(npy((1,), dtype="|O", data=b"12345678")),
        archive(npy("x")),
        archive(npy((1,), data=b"1234"))[:-5],
        b"no archive",
    ],
    ids=range(7),
)
def test_damaged_files_and_objects_are_refused(tmp_path, content):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match="is damaged, or holds more than numbers"):
        read_arrays(tmp_path / "a.npz")


def test_the_unpacked_size_is_limited(tmp_path):
    bomb = archive(bytes(10**7), zipfile.ZIP_DEFLATED)
    assert len(bomb) < 20_000
    (tmp_path / "a.npz").write_bytes(bomb)
    with pytest.raises(InputError, match="10000000 bytes, unpacked"):
        read_arrays(tmp_path / "a.npz", most=10**6)


def test_an_array_alone(tmp_path):
    np.save(tmp_path / "a.npy", np.arange(3.0))
    assert read_array(tmp_path / "a.npy").tolist() == [0, 1, 2]
    (tmp_path / "a.npy").write_bytes(npy((10**12,)))
    with pytest.raises(InputError, match="is damaged"):
        read_array(tmp_path / "a.npy")
