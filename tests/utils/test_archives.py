"""Archives and arrays give what is in them, or one line; never more memory than they may."""

import io
import struct
import tracemalloc
import warnings
import zipfile

import numpy as np
import pytest

from drone_rl.utils.archives import read_array, read_arrays, read_members
from drone_rl.utils.errors import InputError
from drone_rl.utils.limits import Allowance


def archive(members, method=zipfile.ZIP_STORED):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as target, warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Duplicate name")
        for name, data in members:
            target.writestr(name, data)
    return file.getvalue()


def npy(shape, dtype="<f4", data=b"", by_column=False, padding=0):
    header = f"{{'descr': '{dtype}', 'fortran_order': {by_column}, 'shape': {shape}, }}".encode()
    header += b" " * padding
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header + b"\n" + data


def test_members_come_in_order():
    content = archive([("a", b"1"), ("b", b"22")])
    assert list(read_members(content, "x", most=3)) == [("a", b"1"), ("b", b"22")]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"no archive", "is damaged or cut short"),
        (archive([("a", b"1"), ("b", b"22")]), "more than 2 bytes"),
        (archive([("a", b"")] * 10_001), "more than 10000 files"),
        (archive([("a", b""), ("a", b"")]), "two files of one name"),
        (archive([("a", b"11")], zipfile.ZIP_DEFLATED), "not accepted"),
        (archive([("a", b"11")]).replace(b"11", b"12"), "is damaged or cut short"),
        (archive([("a", b"11")])[:-5], "is damaged or cut short"),
    ],
    ids=range(7),  # a name made of the content would tell the time
)
def test_damaged_or_too_large(content, message):
    with pytest.raises(InputError, match=message):
        list(read_members(content, "x", most=2))


def test_an_offset_beyond_any_file():
    content = bytearray(archive([("a", b"1")]))
    entry, end = content.find(b"PK\x01\x02"), content.find(b"PK\x05\x06")
    wide = struct.pack("<HHQ", 1, 8, 2**63)  # the offset of the file, in 64 bits
    content[entry + 30 : entry + 32] = struct.pack("<H", len(wide))
    content[entry + 42 : entry + 46] = b"\xff" * 4
    content[end + 12 : end + 16] = struct.pack("<L", end - entry + len(wide))
    content[end:end] = wide
    with pytest.raises(InputError, match="is damaged or cut short"):
        list(read_members(bytes(content), "x", most=2))


@pytest.mark.parametrize(
    "value",
    [
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.arange(6).reshape(2, 3)),
        np.array("text"),
        np.array(True),
        np.zeros((0, 3), np.float16),
        np.array(7),
    ],
)
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_arrays_come_back(tmp_path, value, save):
    save(tmp_path / "a.npz", a=value)
    found = read_arrays(tmp_path / "a.npz")["a"]
    assert found.dtype == value.dtype
    assert found.flags.writeable
    np.testing.assert_array_equal(found, value)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (npy((10**12,)), "another number of bytes"),
        (npy((2,), data=b"1234"), "another number of bytes"),
        (npy((1,), data=b"12345678"), "another number of bytes"),
        (npy((-1, -1), data=b"1234"), "no array"),
        (npy((1,), dtype="|O", data=b"12345678"), "no array"),
        (npy((1,), dtype="<c8", data=b"12345678"), "no array"),
        (npy((2, 10**14), dtype="<f8"), "no array"),
        (npy((10**12,) * 30, data=b"1234"), "another number of bytes"),
        (npy((0, 10**12)) + b"1", "another number of bytes"),
        (npy("x"), "no array"),
        (b"\x93NUMPY\x09\x00", "no array"),
        (b"\x93NUMPY", "no array"),
        (b"", "no array"),
        (b"\x93NUMPY\x01\x00\x10\x00" + b"(" * 16, "no array"),
        (npy("(2,)", data=b"12345678", padding=2000), "no array"),
    ],
)
def test_arrays_that_lie(tmp_path, data, message):
    (tmp_path / "a.npz").write_bytes(archive([("a.npy", data)]))
    with pytest.raises(InputError, match=message):
        read_arrays(tmp_path / "a.npz")


def test_a_bomb_is_seen_by_its_directory(tmp_path):
    bomb = archive([("a.npy", bytes(10**7))], zipfile.ZIP_DEFLATED)
    assert len(bomb) < 20_000
    (tmp_path / "a.npz").write_bytes(bomb)
    with pytest.raises(InputError, match="more than 1000000 bytes"):
        read_arrays(tmp_path / "a.npz", most=10**6)


def test_a_file_that_is_longer_than_its_directory_says_is_not_unpacked(tmp_path):
    whole = archive([("a.npy", bytes(2**26))], zipfile.ZIP_DEFLATED)
    lying = whole.replace(struct.pack("<L", 2**26), struct.pack("<L", 100))
    tracemalloc.start()
    with pytest.raises(InputError, match="is damaged or cut short"):
        list(read_members(lying, "x", most=1000, methods=(zipfile.ZIP_DEFLATED,)))
    assert tracemalloc.get_traced_memory()[1] < 2**22
    tracemalloc.stop()


def test_archives_share_an_allowance(tmp_path):
    np.savez(tmp_path / "a.npz", a=np.zeros(100))
    allowance = Allowance(1500)
    read_arrays(tmp_path / "a.npz", allowance=allowance)
    with pytest.raises(InputError, match="more than the 572 left of 1500 bytes"):
        read_arrays(tmp_path / "a.npz", allowance=allowance)


def test_an_array_alone(tmp_path):
    np.save(tmp_path / "a.npy", np.arange(3.0))
    assert read_array(tmp_path / "a.npy").tolist() == [0, 1, 2]
    (tmp_path / "a.npy").write_bytes(npy((10**12,)))
    with pytest.raises(InputError, match="another number of bytes"):
        read_array(tmp_path / "a.npy")


@pytest.mark.parametrize("code", [0xD800, 0x110000])
def test_numbers_that_are_no_characters(tmp_path, code):
    (tmp_path / "a.npy").write_bytes(npy((1,), dtype="<U1", data=struct.pack("<L", code)))
    with pytest.raises(InputError, match="no characters"):
        read_array(tmp_path / "a.npy")


def test_dimensions_of_nothing_are_bounded(tmp_path):
    (tmp_path / "a.npy").write_bytes(npy((0, 2**40)))
    with pytest.raises(InputError, match="has the shape"):
        read_array(tmp_path / "a.npy")
