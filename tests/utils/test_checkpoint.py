import errno
import os
import pickle
import re

import pytest
import torch

from drone_rl.utils.checkpoint import load_checkpoint, save_checkpoint
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
        (b"anything", "is damaged or cut short"),
    ],
)
def test_files_of_other_formats_are_named(tmp_path, content, message):
    path = tmp_path / "last.pt"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(f"{path} {message}")):
        load_checkpoint(path)


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_full_disk_leaves_the_previous_checkpoint_and_no_debris(saved, monkeypatch, step):
    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, step, full)
    with pytest.raises(InputError, match="No space left") as error:
        save_checkpoint(saved, {"name": "second"})
    monkeypatch.undo()
    assert "\n" not in str(error.value)
    assert load_checkpoint(saved)["name"] == "first"
    assert [p.name for p in saved.parent.iterdir()] == ["last.pt"]


def test_a_first_checkpoint_that_fails_claims_no_earlier_one(tmp_path, monkeypatch):
    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="there is none yet") as error:
        save_checkpoint(tmp_path / "last.pt", {})
    assert "intact" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_the_system_says_why_pytorch_could_not_write(tmp_path):
    """A limit on the sizes of files stands in for a full disk."""
    code = (
        "import resource, signal, torch; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "from drone_rl.utils.checkpoint import save_checkpoint\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, -1))\n"
        "save_checkpoint('last.pt', {'a': torch.zeros(10**6)})\n"
    )
    done = run_forked(code, cwd=tmp_path)
    assert "last.pt could not be written (File too large)" in done.stderr
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
    with pytest.raises(InputError, match=r"damaged|cut short"):
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
    with pytest.raises(InputError, match=r"code|damaged"):
        load_checkpoint(path)
    assert not marker.exists()


def test_not_ours_and_of_another_version(tmp_path):
    torch.save({"state_dict": {}}, tmp_path / "a.pt")
    with pytest.raises(InputError, match="not a drone_rl checkpoint"):
        load_checkpoint(tmp_path / "a.pt")
    torch.save({"format": "drone_rl checkpoint", "format_version": 99}, tmp_path / "b.pt")
    with pytest.raises(InputError, match="version 99"):
        load_checkpoint(tmp_path / "b.pt")
    torch.save({"format": "drone_rl checkpoint", "format_version": True}, tmp_path / "c.pt")
    with pytest.raises(InputError, match="version True"):
        load_checkpoint(tmp_path / "c.pt")
