"""What torch saves is read as torch reads it; what lies about itself is not."""

import collections
import io
import os
import pickle
import struct
import zipfile

import pytest
import torch
from torch import nn

from drone_rl.utils.checkpoint import DamagedError, ForeignError, unpickle
from drone_rl.utils.errors import InputError


def saved(value):
    file = io.BytesIO()
    torch.save(value, file)
    return file.getvalue()


def archive(program, storages=(), **members):
    """A file of torch's format with the given instructions."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as target:
        target.writestr("a/data.pkl", program)
        for i, data in enumerate(storages):
            target.writestr(f"a/data/{i}", data)
        for name, data in members.items():
            target.writestr(f"a/{name}", data)
    return file.getvalue()


def tensor(size, stride, *, length=4, offset=0):
    """Instructions for a tensor of a float32 storage."""
    pid = b"(X\x07\x00\x00\x00storagectorch\nFloatStorage\nX\x01\x00\x00\x000X\x03\x00\x00\x00cpu"
    storage = pid + _whole(length) + b"tQ"
    shape = b"".join(b"(" + b"".join(map(_whole, numbers)) + b"t" for numbers in (size, stride))
    hooks = b"\x89ccollections\nOrderedDict\n)R"
    return (
        b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\n("
        + storage
        + _whole(offset)
        + shape
        + hooks
        + b"tR."
    )


def _whole(number):
    if -(2**31) <= number < 2**31:
        return b"J" + struct.pack("<i", number)
    return b"\x8a\x09" + number.to_bytes(9, "little", signed=True)


FOUR = struct.pack("<4f", 1, 2, 3, 4)


def test_as_torch_reads_it():
    network = nn.Conv2d(1, 2, 3).to(memory_format=torch.channels_last)
    optimizer = torch.optim.Adam(network.parameters())
    network(torch.ones(1, 1, 4, 4)).sum().backward()
    optimizer.step()
    state = {
        "policy": network.state_dict(),
        "optimizer": optimizer.state_dict(),
        "bytes": torch.get_rng_state(),
        "shared": [torch.arange(6)[2:4], torch.zeros(0), torch.tensor(3.0), torch.tensor([True])],
        "plain": (None, True, -5, 2**100, 0.5, float("-inf"), "text", [], {}, (1, 2, 3, 4)),
    }
    content = saved(state)
    found, expected = unpickle(content, "x"), torch.load(io.BytesIO(content), weights_only=True)
    assert found["plain"] == expected["plain"]
    assert isinstance(found["policy"], collections.OrderedDict)
    for name, value in expected["policy"].items():
        assert torch.equal(found["policy"][name], value)
        assert found["policy"][name].stride() == value.stride()
    for value, other in zip(found["shared"], expected["shared"], strict=True):
        assert torch.equal(value, other) and value.dtype == other.dtype
    assert torch.equal(found["bytes"], expected["bytes"])
    moments = [s["optimizer"]["state"][0]["exp_avg"] for s in (found, expected)]
    assert torch.equal(*moments)


def test_a_tensor_by_hand():
    assert unpickle(archive(tensor([2, 2], [1, 2]), [FOUR]), "x").tolist() == [[1, 3], [2, 4]]
    assert unpickle(archive(tensor([2], [1], offset=2), [FOUR]), "x").tolist() == [3, 4]


@pytest.mark.parametrize(
    "program",
    [
        tensor([10**6, 10**6], [0, 0]),  # a terabyte made of four numbers
        tensor([5], [1]),
        tensor([2], [1], offset=3),
        tensor([2], [4]),
        tensor([4], [1], length=5),  # beyond the end of the storage
        tensor([4], [1], length=3),
        tensor([-1], [1]),
        tensor([4], [-1]),
        tensor([1] * 9, [1] * 9),
        tensor([2**60, 2**60], [1, 1]),
        tensor([2, 2], [1]),
    ],
)
def test_a_tensor_is_no_larger_than_its_storage(program):
    with pytest.raises(DamagedError):
        unpickle(archive(program, [FOUR]), "x")


class Call:
    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


@pytest.mark.parametrize(
    "value",
    [
        Call(os.mkdir, "ran"),
        Call(bytearray, 10**12),
        Call(torch.Tensor, 10**6, 10**6),
        Call(collections.Counter, "abc"),
        Call(eval, "1"),
        torch.device("cpu"),
        torch.float32,
        nn.Parameter(torch.zeros(1)),
        {1, 2},
    ],
)
def test_nothing_is_called(value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ForeignError):
        unpickle(saved({"x": value}), "x")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("program", "kind"),
    [
        (b"", DamagedError),
        (b"\x80\x02", DamagedError),
        (b"\x80\x02.", DamagedError),
        (b"\x80\x02h\x07.", DamagedError),  # a place in the memo that was never filled
        (b"\x80\x02}}}s.", DamagedError),  # a mapping as a key
        (b"\x80\x02NNR.", DamagedError),  # calls None
        (b"\x80\x02X\xff\xff\xff\xffabc", DamagedError),
        (b"\x80\x04\x96" + struct.pack("<Q", 2**50) + b".", ForeignError),  # BYTEARRAY8
        (b"\x80\x02cos\nsystem\nX\x04\x00\x00\x00true\x85R.", ForeignError),
        (b"\x80\x02ios\nsystem\n.", ForeignError),
        (pickle.dumps(print, protocol=4), ForeignError),
        (b"\x80\x02]" + b"K\x01a" * 2**20 + b".", ForeignError),  # three megabytes of it
    ],
)
def test_nonsense(program, kind):
    with pytest.raises(kind):
        unpickle(archive(program), "x")


def test_other_files_in_the_archive():
    with pytest.raises(ForeignError, match="code"):
        unpickle(archive(b"\x80\x02N.", **{"code/x.py": b""}), "x")
    with pytest.raises(DamagedError, match="byte order"):
        unpickle(archive(b"\x80\x02N.", byteorder=b"big"), "x")
    assert unpickle(archive(b"\x80\x02N.", byteorder=b"little"), "x") is None
    with pytest.raises(InputError, match="is damaged or cut short"):
        unpickle(pickle.dumps(Call(os.mkdir, "ran")), "x")


@pytest.mark.parametrize(("kind", "length"), [("Int", 4), ("Float", 2)])
def test_one_storage_has_one_type_and_length(kind, length):
    one = tensor((4,), (1,))[2:-1]
    other = tensor((2,), (1,), length=length)[2:-1].replace(b"Float", kind.encode())
    with pytest.raises(DamagedError, match="two types or lengths"):
        unpickle(archive(b"\x80\x02]" + one + b"a" + other + b"a.", [FOUR]), "x")
    found = unpickle(archive(b"\x80\x02]" + one + b"a" + one + b"a.", [FOUR]), "x")
    assert found[0].data_ptr() == found[1].data_ptr()


@pytest.mark.parametrize("items", [b"K\x01s", b"K\x01u"])
def test_tuples_are_no_names(items):
    """Python crashes when it hashes a tuple that is nested so deeply."""
    mark = b"(" if items.endswith(b"u") else b""
    program = b"\x80\x02}" + mark + b"N" + b"\x85" * 1_000_000 + items + b"."
    with pytest.raises(ForeignError, match="a tuple as a name"):
        unpickle(archive(program), "x")
