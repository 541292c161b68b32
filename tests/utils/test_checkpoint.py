import errno
import os
import pickle
import re
import zipfile

import pytest
import torch
from torch import nn

from drone_rl.utils.checkpoint import check_weights, load_checkpoint, save_checkpoint
from drone_rl.utils.errors import InputError
from tests.forked import run_forked


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "last.pt"
    save_checkpoint(path, {"value": torch.arange(3), "name": "first"})
    return path


def test_round_trip(saved):
    state = load_checkpoint(saved)
    assert state["value"].tolist() == [0, 1, 2]
    assert state["name"] == "first"
    assert [p.name for p in saved.parent.iterdir()] == ["last.pt"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'\x08\x01\0\0\0\0\0\0{"__metadata__"', "is a safetensors file; name it NAME.safetensors"),
        (b"\x08\n\x12\x07pytorch\x1a\x0a2.1", "is an ONNX model; give the policy's .pt or .s"),
        (b"version https://git-lfs.github.com/spec/v1\noid", "is a Git LFS pointer; replace it by"),
        (b"anything", "is damaged"),
    ],
)
def test_files_of_other_formats_are_named(tmp_path, content, message):
    path = tmp_path / "last.pt"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(message)):
        load_checkpoint(path)


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_full_disk_leaves_the_previous_checkpoint_and_no_other_file(saved, monkeypatch, step):
    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, step, full)
    with pytest.raises(InputError, match="No space left"):
        save_checkpoint(saved, {"name": "second"})
    monkeypatch.undo()
    assert load_checkpoint(saved)["name"] == "first"
    assert [p.name for p in saved.parent.iterdir()] == ["last.pt"]


def test_the_system_error_is_named(tmp_path):
    """A limit on the sizes of files stands in for a full disk."""
    code = (
        "import resource, signal, torch; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "from drone_rl.utils.checkpoint import save_checkpoint\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, -1))\n"
        "save_checkpoint('last.pt', {'a': torch.zeros(10**6)})\n"
    )
    assert "(File too large)" in run_forked(code, cwd=tmp_path).stderr
    assert list(tmp_path.iterdir()) == []


def test_folder_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match=r"hydra\.run\.dir"):
        save_checkpoint(tmp_path / "no" / "last.pt", {})


@pytest.mark.parametrize("name", ["last.pt", "x" * 300 + ".pt"])
def test_missing(tmp_path, name):
    with pytest.raises(InputError, match="does not exist"):
        load_checkpoint(tmp_path / name)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_truncated(saved, share):
    data = saved.read_bytes()
    saved.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match="damaged"):
        load_checkpoint(saved)


@pytest.mark.parametrize("how", ["torch", "pickle"])
def test_code_is_not_run(tmp_path, how):
    path = tmp_path / "evil.pt"
    marker = tmp_path / "ran"

    class Evil:
        def __reduce__(self):
            return (os.mkdir, (str(marker),))

    if how == "torch":
        torch.save({"format": "drone_rl checkpoint", "x": Evil()}, path)
    else:
        path.write_bytes(pickle.dumps(Evil()))
    with pytest.raises(InputError, match="could run code"):
        load_checkpoint(path)
    assert not marker.exists()


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"state_dict": {}}, "not a drone_rl checkpoint"),
        ({"format": "drone_rl checkpoint", "format_version": 99}, "version 99"),
        ({"format": "drone_rl checkpoint", "format_version": 2}, "drone-rl convert"),
    ],
)
def test_other_formats_and_versions_are_refused(tmp_path, state, message):
    torch.save(state, tmp_path / "a.pt")
    with pytest.raises(InputError, match=message):
        load_checkpoint(tmp_path / "a.pt")


def test_the_unpacked_size_is_limited(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.pt", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a/data.pkl", bytes(2**28 + 1))
    with pytest.raises(InputError, match="unpacked"):
        load_checkpoint(tmp_path / "a.pt")


EXPECTED = nn.Linear(4, 2, device="meta").state_dict()


def test_weights_of_the_network_are_accepted():
    weights = nn.Linear(4, 2).state_dict()
    assert check_weights(weights, EXPECTED) == weights


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weight": torch.zeros(3, 4)}, r"weight' is \(3, 4\) in the file and \(2, 4\) by"),
        ({"bias": None}, "bias' is absent in the file"),
        ({"more": torch.zeros(1)}, "more"),
        ({"weight": torch.zeros(2, 4, dtype=torch.float64)}, "float64"),
        ({"bias": torch.tensor([0.0, float("nan")])}, "bias hold NaN"),
        ({"bias": torch.tensor([0.0, -float("inf")])}, "bias hold NaN or infinity"),
        ({"bias": [0.0, 0.0]}, r"no tensor \(list\)"),
        ({3: torch.zeros(2)}, "mapping"),
    ],
)
def test_the_first_difference_of_weights_is_named(changes, message):
    weights = {**nn.Linear(4, 2).state_dict(), **changes}
    with pytest.raises(InputError, match=message):
        check_weights({k: v for k, v in weights.items() if v is not None}, EXPECTED)
