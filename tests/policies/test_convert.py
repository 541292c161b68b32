"""Policies of version 0.1 are converted, and act as before."""

import json

import pytest
import torch
from safetensors.torch import save

import drone_rl
from drone_rl.policies.convert import convert
from drone_rl.policies.zoo import policy_path
from drone_rl.utils.errors import InputError


def former_description(policy):
    """Return a description as version 0.1 laid it out."""
    described = policy.description
    task = described.task.parameters.values()
    del task["reward"]
    parts = {"transforms": described.transforms, "network": [described.network]}
    parts = {name: [part.model_dump(mode="json") for part in of] for name, of in parts.items()}
    return {
        "format": "drone_rl policy",
        "format_version": 2,
        "task": task,
        "camera": described.camera.values(),
        "transforms": parts["transforms"],
        "network": parts["network"][0],
    }


def former_about(policy):
    about = policy.state.model_dump(mode="json", exclude={"description"})
    about["progress"]["running_cubes"] = about["progress"].pop("running_reward")
    return about


def former_export(folder, **changes):
    """Return a shipped policy as version 0.1 exported it."""
    policy = drone_rl.load_policy("good")
    about = {**former_about(policy), "evaluation": {"success": 1.0}}
    description = {**former_description(policy), **changes}
    texts = {"about": json.dumps(about), "description": json.dumps(description)}
    path = folder / "mine.safetensors"
    path.write_bytes(save(policy.state.weights, {"format": "drone_rl policy", **texts}))
    return path


def former_checkpoint(folder):
    policy = drone_rl.load_policy("good")
    state = {"format": "drone_rl checkpoint", "format_version": 2, "config": {"policy": {}}}
    state |= {"policy": policy.state.weights, "description": former_description(policy)}
    torch.save({**former_about(policy), **state}, folder / "last.pt")
    return folder / "last.pt"


@pytest.mark.parametrize("make", [former_export, former_checkpoint])
def test_a_converted_policy_acts_alike(tmp_path, make):
    path, other = make(tmp_path), drone_rl.load_policy("good")
    with pytest.raises(InputError, match=f"drone-rl convert {path}$"):
        drone_rl.load_policy(path)
    output = tmp_path / f"{path.stem}_converted.safetensors"
    assert convert(path) == output
    one = drone_rl.load_policy(output)
    assert (one.description, one.state.progress) == (other.description, other.state.progress)
    images = torch.randint(0, 256, (50, 25, 64, 3), dtype=torch.uint8)
    assert torch.equal(one.act_batch(images), other.act_batch(images))


def test_files_are_not_replaced_and_present_ones_not_converted(tmp_path):
    path = former_export(tmp_path)
    convert(path)
    with pytest.raises(InputError, match="exists"):
        convert(path)
    with pytest.raises(InputError, match="does not end in"):
        convert(path, tmp_path / "a.pt")
    with pytest.raises(InputError, match=r"can't be written .*; give output=PATH$"):
        convert(path, tmp_path / "absent" / "a.safetensors")
    with pytest.raises(InputError, match="can't be converted"):
        convert(policy_path("good"), tmp_path / "a.safetensors")
    (tmp_path / "b.safetensors").write_bytes(b"no policy")
    with pytest.raises(InputError, match="can't be converted"):
        convert(tmp_path / "b.safetensors")


@pytest.mark.parametrize(
    "change", [{"camera": 3}, {"task": None}, {"network": "x"}, {"dynamics": {}}]
)
def test_damaged_descriptions_are_one_line(tmp_path, change):
    with pytest.raises(InputError, match="can't be converted") as error:
        convert(former_export(tmp_path, **change))
    assert "\n" not in str(error.value)
