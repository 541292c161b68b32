import json
import struct

import pytest
import torch
from safetensors.torch import load_file, save

import drone_rl
from drone_rl.config.learning import Standardized
from drone_rl.policies.convert import convert_policy
from drone_rl.policies.zoo import load_exported, policy_path
from drone_rl.training.run_folder import settings_of
from drone_rl.utils.checkpoint import load_checkpoint
from drone_rl.utils.errors import InputError


def older_export(folder):
    """Return a shipped policy as version 0.1 wrote it."""
    content = policy_path("good").read_bytes()
    (size,) = struct.unpack("<Q", content[:8])
    metadata = json.loads(content[8 : 8 + size])["__metadata__"]
    about = json.loads(metadata["about"])
    about["progress"]["running_cubes"] = about["progress"].pop("running_reward")
    about["evaluation"] = {"success": 1.0}
    path = folder / "mine.safetensors"
    weights = load_file(policy_path("good"))
    path.write_bytes(save(weights, {**metadata, "about": json.dumps(about)}))
    return path


def older_checkpoint(folder, trained):
    """Return a checkpoint as version 0.1 wrote it."""
    state = load_checkpoint(trained.folder / "checkpoints" / "last.pt")
    state["optimiser"] = state.pop("optimizer")
    state["progress"]["running_cubes"] = state["progress"].pop("running_reward")
    config = state["config"]
    config["optimiser"] = config.pop("optimizer")
    config["trainer"]["minibatch_frames"] = config["trainer"].pop("chunk_frames")
    config["returns"]["_target_"] = "standardised"
    path = folder / "older.pt"
    torch.save({**state, "format_version": 2}, path)
    return path


def test_a_converted_policy_acts_alike(tmp_path):
    path = older_export(tmp_path)
    with pytest.raises(InputError, match=f"drone-rl convert {path}$"):
        load_exported(path)
    converted = convert_policy(path)
    assert converted == tmp_path / "mine_converted.safetensors"
    one, other = drone_rl.load_policy(converted), drone_rl.load_policy("good")
    assert one.description == other.description
    assert one.state.progress == other.state.progress
    weights, expected = one.state.weights, other.state.weights
    assert all(torch.equal(weights[name], expected[name]) for name in expected)
    images = torch.randint(0, 256, (50, 25, 64, 3), dtype=torch.uint8)
    assert torch.equal(one.act_batch(images), other.act_batch(images))


def test_checkpoints_are_converted_with_their_settings(tmp_path):
    trained = drone_rl.train(
        folder=tmp_path / "run",
        returns=Standardized(),
        trainer=drone_rl.TrainerSettings(total_frames=1, chunk_frames=100),
        progress=lambda *_: None,
    )
    present = load_checkpoint(trained.folder / "checkpoints" / "last.pt")
    path = older_checkpoint(tmp_path, trained)
    with pytest.raises(InputError, match="drone-rl convert"):
        drone_rl.load_policy(path)
    state = load_checkpoint(convert_policy(path, tmp_path / "new.pt"))
    assert settings_of(state["config"]) == settings_of(present["config"])
    assert {"optimizer", "policy"} <= state.keys()
    assert drone_rl.load_policy(tmp_path / "new.pt").state.progress.updates > 0


def test_files_are_not_replaced_and_present_ones_not_converted(tmp_path):
    path = older_export(tmp_path)
    convert_policy(path)
    with pytest.raises(InputError, match="exists"):
        convert_policy(path)
    with pytest.raises(InputError, match="does not end in"):
        convert_policy(path, tmp_path / "a.pt")
    with pytest.raises(InputError, match="present layout"):
        convert_policy(policy_path("good"), tmp_path / "a.safetensors")
    (tmp_path / "b.safetensors").write_bytes(b"no policy")
    with pytest.raises(InputError, match="can't be converted"):
        convert_policy(tmp_path / "b.safetensors")
