"""Malicious inputs of every kind that the program reads.

Each would run, read, write, delete or allocate something if the program accepted it.
"""

import copy
import io
import json
import os
import pickle
import struct
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save

from benchmarks.hostile_arrays import hostile_arrays
from benchmarks.hostile_case import NOT_REGULAR, Case, Make, nested, zipped, zipped_zeros
from benchmarks.hostile_claims import hostile_claims
from benchmarks.hostile_explanations import hostile_explanations
from benchmarks.hostile_folders import hostile_folders, make_run
from benchmarks.hostile_json import hostile_json
from benchmarks.hostile_policies import hostile_policies
from benchmarks.hostile_runs import hostile_runs
from drone_rl.config import COMPUTER_VISION, MINIMAL, MOVES_SETTINGS
from drone_rl.policies.zoo import parse

DESCRIPTION: dict[str, Any] = {
    "format": "drone_rl policy",
    "format_version": 2,
    "task": {
        "num_cubes": 1,
        "first_distance": 8.0,
        "spacing": 9.0,
        "lateral_bound": 6.0,
        "vertical_bound": 0.0,
        "cube_size": 2.5,
        "cube_color": [0.75, 0.12, 0.08],
        "drone_size": 0.8,
        "altitude": 2.5,
        "step_length": 1.0,
        "step_limit": 60,
        "front_margin": 11.0,
        "side_margin": 20.0,
    },
    "camera": {"width": 16, "height": 8, "horizontal_fov": 135.0},
    "transforms": [{"name": "gray"}, {"name": "standardize", "mean": 0.5, "std": 0.2}],
    "network": {"name": "small_cnn", "patch": 4, "channels": [2], "hidden": []},
}
"""Description of a valid policy."""
_APPEARANCE = MINIMAL.values()
_DYNAMICS = {**COMPUTER_VISION.values(), "mode": "simple_flight"}
_ACTIONS = MOVES_SETTINGS.values()
_PROGRESS = {"frames": 1, "episodes": 1, "updates": 1, "seconds": 1.0, "running_reward": 0.5}
_ORIGIN = {"versions": {"torch": "2"}, "git_revision": None}
ABOUT = {
    "progress": _PROGRESS,
    "provenance": _ORIGIN,
    "command": "drone-rl train",
    "evaluation": {"episodes": 1},
}


def hostile_files(folder: Path) -> list[Case]:
    """Write the files.

    Args:
        folder: Folder of the files; its subfolder `canary` is off limits to all commands.

    Returns:
        For each case its name, the arguments of `drone-rl`, and the attack.
    """
    canary = folder / "canary"
    canary.mkdir(parents=True)
    (canary / "secret.txt").write_text(os.environ.get("HOSTILE_SECRET", "a secret"))
    (canary / "keep").mkdir()
    (canary / "keep" / "me.txt").write_text("keep me")
    state = checkpoint_state()

    def run(path: Path) -> Path:
        return make_run(path, state)

    return [
        *(*_exported(folder), *_old(folder), *_checkpoints(folder), *_not_regular(folder)),
        *hostile_folders(folder, state),
        *hostile_policies(folder, weights(), _about()),
        *hostile_json(folder, run),
        *hostile_arrays(folder),
        *hostile_claims(folder, DESCRIPTION),
        *hostile_explanations(folder),
        *hostile_runs(folder, run),
    ]


def weights() -> dict[str, torch.Tensor]:
    """Return weights of `DESCRIPTION`."""
    expected = parse(DESCRIPTION).expected_weights()
    return {name: torch.full(value.shape, 0.1) for name, value in expected.items()}


def exported(
    description: Any = DESCRIPTION, tensors: Mapping[str, Any] | None = None, **about: Any
) -> bytes:
    """Return the content of an exported policy file."""
    return save(dict(tensors or weights()), _about(description, **about))


def _about(description: Any = DESCRIPTION, **about: Any) -> dict[str, str]:
    """Return the metadata of an exported policy file."""
    return {
        "format": "drone_rl policy",
        "description": description if isinstance(description, str) else json.dumps(description),
        "about": json.dumps({**ABOUT, **about}),
    }


def checkpoint_state(**changes: Any) -> dict[str, Any]:
    """Return the content of a checkpoint, as far as evaluation needs it."""
    state = {
        "format": "drone_rl checkpoint",
        "format_version": 2,
        "policy": weights(),
        "config": {},
        "description": DESCRIPTION,
        "progress": _PROGRESS,
        "provenance": _ORIGIN,
        "best": 0.5,
    }
    return {**state, **changes}


def changed(where: str, value: Any) -> dict[str, Any]:
    """Return `DESCRIPTION` with one value replaced, or removed if the new value is `...`."""
    data, *keys = copy.deepcopy(DESCRIPTION), *where.split(".")
    part: Any = data
    for key in keys[:-1]:
        part = part[int(key) if key.isdigit() else key]
    if value is ...:
        del part[keys[-1]]
    else:
        part[int(keys[-1]) if keys[-1].isdigit() else keys[-1]] = value
    return data


def _exported(folder: Path) -> list[Case]:
    contents = {**_descriptions(folder), **_weights(), **_texts(), **_damages()}
    return [_policy(folder, f"exported_{n}.safetensors", c) for n, c in contents.items()]


def _descriptions(folder: Path) -> dict[str, bytes]:
    """Return files with invalid descriptions, by name."""
    described = {
        "cubes": ("task.num_cubes", 10**9),
        "steps": ("task.step_limit", 0),
        "whole_number_as_float": ("task.num_cubes", 1.0),
        "true_as_number": ("task.num_cubes", True),
        "nan_in_task": ("task.spacing", float("nan")),
        "tiny_steps": ("task.step_length", 1e-320),
        "home": ("task.spacing", "${oc.env:HOSTILE_SECRET}"),
        "camera": ("camera", {"width": 4096, "height": 4096, "horizontal_fov": 90.0}),
        "fog": ("appearance", {**_APPEARANCE, "fog_visibility": 0.0}),
        "texture": (
            "appearance",
            {**_APPEARANCE, "ground_texture": [str(folder / "canary" / "secret.txt")]},
        ),
        "heavy": ("dynamics", {**_DYNAMICS, "mass": 1e9}),
        "no_such_body": ("dynamics", {**_DYNAMICS, "inertia": [1.0, 1.0, 9.0]}),
        "wind_nan": ("dynamics", {**_DYNAMICS, "wind": [float("nan"), 0.0, 0.0]}),
        "wind_of_four": ("dynamics", {**_DYNAMICS, "wind": [0.0] * 4}),
        "endless_step": ("dynamics", {**_DYNAMICS, "control_ticks": 10**9}),
        "no_tick": ("dynamics", {**_DYNAMICS, "tick": 0.0}),
        "mode": ("dynamics", {**_DYNAMICS, "mode": "os.system"}),
        "wind_without_air": ("dynamics", {**COMPUTER_VISION.values(), "wind": [5.0, 0.0, 0.0]}),
        "half_dynamics": ("dynamics", {"mode": "simple_flight"}),
        "no_dynamics": ("dynamics", None),
        "fast": ("actions", {**_ACTIONS, "move_speed": 1e300}),
        "actions_by_import": ("actions", {**_ACTIONS, "kind": "builtins.eval"}),
        "more_actions": ("actions", {**_ACTIONS, "_target_": "os.system"}),
        "wide_layer": ("network.hidden", [10**9]),
        "many_parameters": ("network.hidden", [4096] * 8),
        "many_layers": ("network.hidden", [1] * 10**4),
        "many_channels": ("network.channels", [10**6]),
        "stack": ("transforms", [{"name": "gray"}, {"name": "stack", "N": 10**6}]),
        "stacks": ("transforms", [{"name": "gray"}] + [{"name": "stack", "N": 16}] * 8),
        "many_transforms": ("transforms", [{"name": "gray"}] * 10**4),
        "resize": (
            "transforms",
            [{"name": "gray"}, {"name": "resize", "height": 9**9, "width": 1}],
        ),
        "target_in_network": ("network._target_", "os.system"),
        "network_by_import": ("network.name", "os.system"),
        "transform_by_import": ("transforms", [{"name": "builtins.eval", "N": 1}]),
        "unknown_key": ("hooks", ["os.system"]),
        "missing_key": ("camera", ...),
        "future": ("format_version", 99),
    }
    return {name: exported(changed(*change)) for name, change in described.items()}


def _weights() -> dict[str, bytes]:
    """Return files with weights that are not finite or do not fit the network, by name."""
    own = weights()
    bias, weight = "layers.logits.bias", "layers.logits.weight"
    return {
        "weights_nan": exported(tensors={**own, bias: own[bias] * float("nan")}),
        "weights_infinite": exported(tensors={**own, bias: own[bias] / 0.0}),
        "weights_whole": exported(tensors={**own, bias: own[bias].long()}),
        "weights_double": exported(tensors={n: v.double() for n, v in own.items()}),
        "weights_complex": exported(tensors={n: v.to(torch.complex64) for n, v in own.items()}),
        "weights_missing": exported(tensors={weight: own[weight]}),
        "weights_extra": exported(tensors={**own, "layers.more": torch.zeros(2)}),
        "weights_large": exported(tensors={**own, bias: torch.zeros(10**6)}),
        "weights_of_another": exported(tensors={n: torch.zeros(1) for n in own}),
        "weights_empty": exported(tensors={n: torch.zeros(0) for n in own}),
    }


def _texts() -> dict[str, bytes]:
    """Return files with invalid or huge JSON, or text for a terminal or a shell, by name."""
    return {
        "deep": exported('{"a":' * 50_000 + "1" + "}" * 50_000),
        "huge_number": exported('{"format": 1' + "0" * 400 + "}"),
        "key_twice": exported('{"format": 1, "format": "drone_rl policy"}'),
        "no_json": exported("{"),
        "unicode": exported(changed("network.name", "small\u202e_cnn\ud800\x1b[2J")),
        "command": exported(command="drone-rl train; touch canary/ran"),
        "escape": exported(command="drone-rl train \x1b]0;owned\x07"),
        "negative_progress": exported(progress={**_PROGRESS, "frames": -1}),
        "huge_progress": exported(progress={**_PROGRESS, "seconds": 10**400}),
    }


def _damages() -> dict[str, bytes]:
    """Return truncated or extended files and files with a false size, by name."""
    whole = exported()
    return {
        "truncated": whole[: len(whole) // 2],
        "longer": whole + bytes(100),
        "header_of_a_terabyte": struct.pack("<Q", 2**40) + b"{}",
        "only_a_header": struct.pack("<Q", 2) + b"{}",
        "wrong_magic": b"GIF89a" + whole,
    }


def _old(folder: Path) -> list[Case]:
    """Write files in an old format whose settings name Python objects."""
    canary = folder / "canary"
    config = {
        "task": {"_target_": "drone_rl.config.TaskSettings", **DESCRIPTION["task"]},
        "camera": {"_target_": "drone_rl.config.CameraSettings", **DESCRIPTION["camera"]},
        "transforms": {"gray": {"_target_": "drone_rl.envs.transforms.GrayPixels"}},
        "policy": {"_target_": "drone_rl.policies.SmallCNN", "_partial_": True, "channels": [2]},
    }
    touch = f"touch {canary}/ran"
    parts = {
        "system": {"_target_": "os.system", "command": touch},
        "popen": {"_target_": "subprocess.Popen", "args": touch, "shell": True},
        "rmtree": {"_target_": "shutil.rmtree", "path": str(canary / "keep")},
        "eval": {"_target_": "builtins.eval", "_args_": [f"open('{canary}/ran', 'w')"]},
        "instantiate": {"_target_": "hydra.utils.call", "_args_": [{"_target_": "os.system"}]},
        "interpolation": {"_target_": "drone_rl.policies.${oc.env:HOSTILE_SECRET}"},
    }
    cases = []
    for name, part in parts.items():
        for where in ("policy", "task", "gray"):
            transforms = {"gray": part} if where == "gray" else config["transforms"]
            hostile = {
                **config,
                "transforms": transforms,
                **({} if where == "gray" else {where: part}),
            }
            texts = {
                "format": "drone_rl policy",
                "about": json.dumps({**ABOUT, "config": hostile}),
            }
            content = save(weights(), texts)
            cases.append(_policy(folder, f"old_{where}_{name}.safetensors", content))
    first = checkpoint_state(format_version=1, config={**config, "policy": parts["system"]})
    return [*cases, _policy(folder, "old_checkpoint.pt", _saved(first))]


def _checkpoints(folder: Path) -> list[Case]:
    canary = folder / "canary"
    own, large = weights(), torch.zeros(1).expand(10**6, 10**6)
    states: dict[str, Any] = {
        "runs": checkpoint_state(x=_Call(os.system, f"touch {canary}/ran")),
        "opens": checkpoint_state(x=_Call(open, str(canary / "ran"), "w")),
        "evaluates": checkpoint_state(x=_Call(eval, "1 + 1")),
        "allocates": checkpoint_state(x=_Call(bytearray, 10**11)),
        "allocates_a_tensor": checkpoint_state(x=_Call(torch.Tensor, 10**6, 10**6)),
        "zero_strides": checkpoint_state(policy={**own, "layers.logits.bias": large}),
        "whole_module": checkpoint_state(policy=torch.nn.Linear(2, 2)),
        "no_weights": checkpoint_state(policy={}),
        "weights_no_tensors": checkpoint_state(policy={n: [0.0] for n in own}),
        "weights_nan": checkpoint_state(policy={n: v * float("nan") for n, v in own.items()}),
        "weights_double": checkpoint_state(policy={n: v.double() for n, v in own.items()}),
        "other_format": checkpoint_state(format="drone_rl policy"),
        "future": checkpoint_state(format_version=99),
        "no_description": checkpoint_state(description=None),
        "target": checkpoint_state(description=changed("network.name", "os.system")),
        "tensor_in_config": checkpoint_state(config={"a": torch.zeros(2)}),
        "deep_config": checkpoint_state(config={"a": nested(50)}),
        "state_dict_alone": own,
        "list": [1, 2, 3],
    }
    contents = {name: _saved(state) for name, state in states.items()}
    whole = _saved(checkpoint_state())
    contents |= {
        "pickle": pickle.dumps(_Call(os.system, f"touch {canary}/ran")),
        "truncated": whole[: len(whole) // 2],
        "text": b"print('hello')",
        "bomb": zipped_zeros("a/data.pkl", b"", 2**29),
        "many_files": zipped({f"a/data/{i}": b"" for i in range(10_001)}),
        "code": zipped({"a/data.pkl": b"\x80\x02N.", "a/code/x.py": b"import os"}),
        "memo": zipped({"a/data.pkl": b"\x80\x02Nr\xff\xff\xff\x7f."}),
        "long_text": zipped({"a/data.pkl": b"\x80\x02X\xff\xff\xff\x7fabc."}),
        "beyond_its_storage": _longer_storage(whole),
    }
    return [_policy(folder, f"checkpoint_{name}.pt", c) for name, c in contents.items()]


def _not_regular(folder: Path) -> list[Case]:
    """Create objects that are not regular files."""
    here = folder / "no_files"
    here.mkdir()
    secret = folder / "canary" / "secret.txt"
    makers: dict[str, Make] = {**NOT_REGULAR, "secret": lambda path: path.symlink_to(secret)}
    cases = []
    for name, make in makers.items():
        for ending in ("pt", "safetensors"):
            path = here / f"{name}.{ending}"
            make(path)
            cases.append((f"no_file_{path.name}", _command(path, len(cases)), "not a regular file"))
    return cases


def _policy(folder: Path, name: str, content: bytes) -> Case:
    (folder / name).write_bytes(content)
    return name, _command(folder / name, sum(map(ord, name))), name.rpartition(".")[0]


def _command(path: Path, number: int) -> list[str]:
    """Return one of the commands that open a policy."""
    commands = ("verdict", "evaluate", "explain", "play", "export")
    return [commands[number % len(commands)], f"policy={path}"]


class _Call:
    """An object that calls a function when it is unpickled."""

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self.call = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple]:
        return self.call


def _saved(state: Any) -> bytes:
    file = io.BytesIO()
    torch.save(state, file)
    return file.getvalue()


def _longer_storage(content: bytes) -> bytes:
    """Return a checkpoint whose first convolution declares 65,535 instead of 32 numbers."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    (program,) = (name for name in members if name.endswith("data.pkl"))
    members[program] = members[program].replace(b"K\x20tq", b"M\xff\xfftq", 1)
    return zipped(members)
