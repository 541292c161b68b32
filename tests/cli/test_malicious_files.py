"""Malicious files, one for each kind of attack: one line, nothing executed, nothing revealed."""

import io
import json
import os
import pickle
import struct
import zipfile

import numpy as np
import pytest
import torch
import yaml
from safetensors.torch import save

from drone_rl.config import MOVES_SETTINGS
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.policies.zoo.description import ActionSpace
from drone_rl.sweeps.manifest import Sweep
from drone_rl.utils.limits import CHECKPOINT_BYTES
from tests.cli.running import error_line

SECRET = "the canary's secret 4711"
TASK = {"num_cubes": 1, "first_distance": 8.0, "step_limit": 60}
IMAGE = {
    "camera": {"horizontal_fov": 135.0},
    "size": [8, 16],
    "transforms": [{"name": "gray"}, {"name": "standardize", "mean": 0.5, "std": 0.2}],
}
DESCRIPTION = {
    "format": "drone_rl policy",
    "format_version": 3,
    "task": {"name": "collect_cubes", "parameters": TASK},
    "inputs": {"pixels": IMAGE},
    "actions": ActionSpace.of(MOVES_SETTINGS).model_dump(mode="json"),
    "network": {"name": "small_cnn", "patch": 4, "channels": [2], "hidden": []},
}
PROGRESS = {"frames": 1, "episodes": 1, "updates": 1, "seconds": 1.0, "running_reward": 0.5}
ORIGIN = {"versions": {"torch": "2"}, "git_revision": None}
SWEEP = {
    **{
        "format": Sweep.model_fields["format"].default,
        "command": "drone-rl train -m seed=0,1",
        "settings": {},
    },
    **{"versions": {}, "git_revision": None, "machine": {}},
    "runs": [{"number": 0, "overrides": ["seed=0"], "folder": "0"}],
}
NOT_REGULAR = {
    "folder": lambda path: path.mkdir(),
    "pipe": os.mkfifo,
    "zeros": lambda path: path.symlink_to("/dev/zero"),
    "loop": lambda path: path.symlink_to(path),
    "sparse": lambda path: os.truncate(os.open(path, os.O_WRONLY | os.O_CREAT), 2**40),
}


class Call:
    """An object that calls a function when it is unpickled."""

    def __init__(self, function, *args):
        self.call = function, args

    def __reduce__(self):
        return self.call


@pytest.fixture
def refused(in_process, tmp_path, monkeypatch):
    """Runs a command that must end with one line of error and leave the canary alone."""
    (tmp_path / "canary").write_text(SECRET)
    monkeypatch.setenv("HOSTILE_SECRET", SECRET)

    def run(*args):
        done = in_process(*args)
        assert error_line(done) and len(done.stderr.splitlines()) == 1, done.stderr
        assert done.returncode == 2
        assert SECRET not in done.stderr + done.stdout
        assert (tmp_path / "canary").read_text() == SECRET
        assert not (tmp_path / "ran").exists()
        return done.stderr

    return run


def weights(value=0.1):
    expected = PolicyDescription.read(DESCRIPTION).expected_weights()
    return {name: torch.full(tensor.shape, value) for name, tensor in expected.items()}


def exported(description=DESCRIPTION, tensors=None, **about):
    about = {"progress": PROGRESS, "provenance": ORIGIN, "command": "drone-rl train", **about}
    text = json.dumps({**about, "description": description})
    return with_text(text, tensors)


def with_text(text, tensors=None):
    return save(tensors or weights(), {"format": "drone_rl policy", "policy": text})


def with_part(**parts):
    return exported({**DESCRIPTION, **parts})


def checkpoint(**changes):
    state = {
        **{"format": "drone_rl checkpoint", "format_version": 4, "policy": weights()},
        **{"config": {}, "description": DESCRIPTION, "progress": PROGRESS, "best": 0.5},
        "provenance": ORIGIN,
    }
    file = io.BytesIO()
    torch.save({**state, **changes}, file)
    return file.getvalue()


def zipped(members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def npz(**arrays):
    file = io.BytesIO()
    np.savez_compressed(file, **(arrays or {"a": np.zeros(3)}))
    return file.getvalue()


POLICIES = {
    "description_names_a_function.safetensors": lambda: with_part(
        network={**DESCRIPTION["network"], "_target_": "os.system"}
    ),
    "unknown_key.safetensors": lambda: with_part(hooks=["os.system"]),
    "interpolation.safetensors": lambda: with_part(
        task={"name": "collect_cubes", "parameters": {"spacing": "${oc.env:HOSTILE_SECRET}"}}
    ),
    "not_finite.safetensors": lambda: with_part(
        task={"name": "collect_cubes", "parameters": {"spacing": float("nan")}}
    ),
    "huge_image.safetensors": lambda: with_part(inputs={"pixels": {**IMAGE, "size": [4096, 4096]}}),
    "huge_network.safetensors": lambda: with_part(
        network={**DESCRIPTION["network"], "hidden": [10**9]}
    ),
    "scene_of_a_path.safetensors": lambda: with_part(
        task={**DESCRIPTION["task"], "scene": {"name": "/etc/passwd"}}
    ),
    "future_version.safetensors": lambda: with_part(format_version=99),
    "weights_not_finite.safetensors": lambda: exported(tensors=weights(float("nan"))),
    "weights_missing.safetensors": lambda: exported(tensors=dict([*weights().items()][:1])),
    "deep_json.safetensors": lambda: with_text('{"a":' * 50_000 + "1" + "}" * 50_000),
    "name_twice.safetensors": lambda: with_text('{"seed": 1, "seed": 2}'),
    "escape_sequence.safetensors": lambda: exported(command="drone-rl train \x1b]0;owned\x07"),
    "truncated.safetensors": lambda: exported()[:500],
    "header_of_a_terabyte.safetensors": lambda: struct.pack("<Q", 2**40) + b"{}",
    "pickle.pt": lambda: pickle.dumps(Call(os.system, "touch ran")),
    "function_in_checkpoint.pt": lambda: checkpoint(x=Call(os.system, "touch ran")),
    "allocation.pt": lambda: checkpoint(x=Call(bytearray, 10**11)),
    "strides_of_zero.pt": lambda: checkpoint(
        policy={**weights(), "layers.logits.bias": torch.zeros(1).expand(10**6, 10**6)}
    ),
    "module.pt": lambda: checkpoint(policy=torch.nn.Linear(2, 2)),
    "many_members.pt": lambda: zipped({f"a/data/{i}": b"" for i in range(10_001)}),
    "bomb.pt": lambda: zipped({"a/data.pkl": bytes(CHECKPOINT_BYTES)}),
}


@pytest.mark.parametrize("name", POLICIES)
def test_policy_files(refused, tmp_path, name):
    (tmp_path / name).write_bytes(POLICIES[name]())
    refused("verdict", f"policy={name}")


def test_the_same_policy_without_an_attack_is_read(in_process, tmp_path):
    (tmp_path / "x.safetensors").write_bytes(exported())
    (tmp_path / "x.pt").write_bytes(checkpoint())
    for name in ("x.safetensors", "x.pt"):
        assert in_process("export", f"policy={name}", "name=copy", "episodes=4").returncode == 0


@pytest.mark.parametrize(
    ("kind", "command"),
    [
        ("folder", ["verdict", "policy=x.pt"]),
        ("pipe", ["verdict", "policy=x.safetensors"]),
        ("zeros", ["verdict", "policy=x.pt"]),
        ("loop", ["verdict", "policy=good", "require_domain=x.yaml"]),
        ("sparse", ["check", "policy=good", "certificate=x.json"]),
        ("pipe", ["verdict", "policy=good", "require_domain=x.yaml"]),
        ("zeros", ["check", "policy=good", "certificate=x.json"]),
    ],
)
def test_files_that_are_not_regular(refused, tmp_path, kind, command):
    NOT_REGULAR[kind](tmp_path / command[-1].rpartition("=")[2])
    refused(*command)


def make_run(folder, overrides):
    (folder / "run" / ".hydra").mkdir(parents=True)
    (folder / "run" / "checkpoints").mkdir()
    (folder / "run" / "checkpoints" / "last.pt").write_bytes(checkpoint())
    (folder / "run" / ".hydra" / "overrides.yaml").write_text(overrides)


@pytest.mark.parametrize(
    "overrides",
    [
        yaml.safe_dump(["policy._target_=os.system"]),
        "- !!python/object/apply:os.system ['touch ran']\n",
    ],
)
def test_overrides_of_a_run_that_is_resumed(refused, tmp_path, overrides):
    make_run(tmp_path, overrides)
    refused("train", "resume=run")


def test_links_out_of_a_run_that_is_resumed(refused, tmp_path):
    make_run(tmp_path, "- seed=0\n")
    (tmp_path / "run" / "metrics.csv").symlink_to(tmp_path / "canary")
    refused("train", "resume=run")


@pytest.mark.parametrize(
    "content",
    [
        json.dumps({**SWEEP, "runs": [{**SWEEP["runs"][0], "folder": "../x"}]}),
        json.dumps({**SWEEP, "plugins": ["os.system"]}),
        "[" * 10**5,
    ],
)
def test_sweeps(refused, tmp_path, content):
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "sweep.json").write_text(content)
    refused("sweep-report", "folder=sweep")


ARCHIVES = {
    "objects": lambda: npz(a=np.array([{}], dtype=object)),
}


@pytest.mark.parametrize(
    ("reader", "name"),
    [
        *(("demonstration", name) for name in ARCHIVES),
        ("explanation", "objects"),
    ],
)
def test_arrays(refused, tmp_path, reader, name):
    (tmp_path / "x").mkdir()
    if reader == "explanation":
        about = {"format": "drone_rl explanation", "format_version": 3, "name": "x"}
        (tmp_path / "x" / "explanation.json").write_text(json.dumps(about))
        (tmp_path / "x" / "dataset.npz").write_bytes(npz())
        (tmp_path / "x" / "arrays.npz").write_bytes(ARCHIVES[name]())
        refused("report", "explanations=x")
    else:
        (tmp_path / "x" / "flight_00000.npz").write_bytes(ARCHIVES[name]())
        refused("train", "demonstrations=x", "logger=csv")


@pytest.mark.parametrize(
    "content",
    [
        b"a: !!python/name:os.system",
    ],
)
def test_required_domains(refused, tmp_path, content):
    (tmp_path / "x.yaml").write_bytes(content)
    refused("verdict", "policy=good", "require_domain=x.yaml")


@pytest.mark.parametrize("name", ["../x", "/tmp/x"])
def test_output_names_that_are_paths(refused, tmp_path, name):
    refused("export", "policy=good", f"name={name}")
