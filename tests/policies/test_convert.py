"""Files of former layouts are converted, and what they describe acts as before."""

import json
import shutil

import pytest
import torch
from safetensors.torch import save

import drone_rl
from drone_rl.config.learning import Standardized
from drone_rl.policies.convert import convert
from drone_rl.policies.zoo import certificate_path, policy_path
from drone_rl.training.run_folder import settings_of
from drone_rl.utils.checkpoint import load_checkpoint
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker.certificate import read_certificate


def former_description(policy):
    """Return a description as version 2 laid it out."""
    described = policy.description
    task = described.task.parameters.values()
    weights = described.task.rewards
    del task["reward"]
    if described.task.name == "pillars":
        task["collision_penalty"] = -weights["contact"]
    parts = {"transforms": described.transforms, "network": [described.network]}
    parts = {name: [part.model_dump(mode="json") for part in of] for name, of in parts.items()}
    former = {
        "format": "drone_rl policy",
        "format_version": 2,
        "task": task,
        "camera": described.camera.values(),
        "transforms": parts["transforms"],
        "network": parts["network"][0],
        "appearance": described.appearance.values(),
        "dynamics": described.dynamics.values(),
    }
    if policy.actions.kind != "moves":
        former["actions"] = policy.actions.values()
    return former


def former_export(folder, name="good"):
    """Return a shipped policy as version 0.1 wrote it."""
    policy = drone_rl.load_policy(name)
    about = policy.state.model_dump(mode="json", exclude={"description"})
    about["progress"]["running_cubes"] = about["progress"].pop("running_reward")
    about["evaluation"] = {"success": 1.0}
    texts = {"about": json.dumps(about), "description": json.dumps(former_description(policy))}
    path = folder / "mine.safetensors"
    path.write_bytes(save(policy.state.weights, {"format": "drone_rl policy", **texts}))
    return path


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A run of one update."""
    return drone_rl.train(
        folder=tmp_path_factory.mktemp("run") / "run",
        returns=Standardized(),
        trainer=drone_rl.TrainerSettings(total_frames=1, chunk_frames=100),
        progress=lambda *_: None,
    )


def make_former(path, policy, version=3):
    """Lay a checkpoint out as an earlier revision, or as version 0.1 (2), did."""
    state = load_checkpoint(path)
    state["description"] = former_description(policy)
    if version == 2:
        state["optimiser"] = state.pop("optimizer")
        state["progress"]["running_cubes"] = state["progress"].pop("running_reward")
        config = state["config"]
        config["optimiser"] = config.pop("optimizer")
        config["trainer"]["minibatch_frames"] = config["trainer"].pop("chunk_frames")
        config["returns"]["_target_"] = "standardised"
    torch.save({**state, "format_version": version}, path)


@pytest.mark.parametrize("name", ["good", "flight_velocity", "pillars_good", "robust"])
def test_a_converted_policy_acts_alike(tmp_path, name):
    path = former_export(tmp_path, name)
    with pytest.raises(InputError, match=f"drone-rl convert {path}$"):
        drone_rl.load_policy(path)
    assert convert(path) == [tmp_path / "mine_converted.safetensors"]
    one = drone_rl.load_policy(tmp_path / "mine_converted.safetensors")
    other = drone_rl.load_policy(name)
    assert one.description == other.description
    assert one.state.progress == other.state.progress
    images = torch.randint(0, 256, (50, 25, 64, 3), dtype=torch.uint8)
    assert torch.equal(one.act_batch(images), other.act_batch(images))


@pytest.mark.parametrize("version", [2, 3])
def test_a_run_resumes_after_its_conversion(trained, tmp_path, version):
    run = shutil.copytree(trained.folder, tmp_path / "run")
    paths = sorted((run / "checkpoints").glob("*.pt"))
    for path in paths:
        make_former(path, trained.policy, version)
    with pytest.raises(InputError, match="drone-rl convert"):
        drone_rl.train(folder=run, resume=True, progress=lambda *_: None)
    assert convert(run) == paths
    assert {path.stem for path in paths} | {"last_former", "best_former"} == {
        path.stem for path in (run / "checkpoints").iterdir()
    }
    state = load_checkpoint(run / "checkpoints" / "last.pt")
    assert settings_of(state["config"]).returns == Standardized()
    longer = drone_rl.TrainerSettings(total_frames=2000, chunk_frames=100)
    whole, other = (
        drone_rl.train(folder=folder, resume=True, trainer=longer, progress=lambda *_: None)
        for folder in (run, shutil.copytree(trained.folder, tmp_path / "whole"))
    )
    for name, weight in whole.policy.state.weights.items():
        assert torch.equal(weight, other.policy.state.weights[name])


def test_a_certificate_is_converted(tmp_path):
    policy = drone_rl.load_policy("proved")
    content = json.loads(certificate_path(policy.path).read_text())
    content["policy"]["description"] = former_description(policy)
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="drone-rl convert FILE"):
        read_certificate(path)
    convert(tmp_path)
    converted, shipped = read_certificate(path), read_certificate(certificate_path(policy.path))
    assert converted.policy == shipped.policy and converted.success == shipped.success


def test_exported_files_of_a_folder_are_converted_in_their_places(tmp_path):
    path = former_export(tmp_path)
    policy = drone_rl.load_policy("proved")
    content = json.loads(certificate_path(policy.path).read_text())
    content["policy"]["description"] = former_description(policy)
    certificate = certificate_path(path)
    certificate.write_text(json.dumps(content))
    assert convert(tmp_path) == [path, certificate]
    assert drone_rl.load_policy(path).description == drone_rl.load_policy("good").description
    assert (
        read_certificate(certificate).policy
        == read_certificate(certificate_path(policy.path)).policy
    )
    with pytest.raises(InputError, match="no files of a former layout"):
        convert(tmp_path)


def test_a_write_error_says_nothing_of_the_file_that_was_read(tmp_path):
    path = former_export(tmp_path)
    with pytest.raises(InputError, match=r"can't be written .*; give output=PATH$"):
        convert(path, tmp_path / "absent" / "a.safetensors")


def test_files_are_not_replaced_and_present_ones_not_converted(tmp_path):
    path = former_export(tmp_path)
    convert(path)
    with pytest.raises(InputError, match="exists"):
        convert(path)
    with pytest.raises(InputError, match="does not end in"):
        convert(path, tmp_path / "a.pt")
    with pytest.raises(InputError, match="present layout"):
        convert(policy_path("good"), tmp_path / "a.safetensors")
    present = tmp_path / "present"
    present.mkdir()
    (tmp_path / "mine_converted.safetensors").rename(present / "mine.safetensors")
    with pytest.raises(InputError, match="no files of a former layout"):
        convert(present)
    for name, content in {"b.safetensors": b"no policy", "b.json": b"[]", "c.json": b"{}"}.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match="can't be converted"):
            convert(tmp_path / name)


def test_damaged_descriptions_are_one_line(tmp_path):
    policy = drone_rl.load_policy("good")
    for change in ({"camera": 3}, {"task": None}, {"actions": {"kind": "eval"}}, {"network": "x"}):
        description = {**former_description(policy), **change}
        path = tmp_path / "a.certificate.json"
        path.write_text(json.dumps({"policy": {"description": description}}))
        with pytest.raises(InputError, match="can't be converted") as error:
            convert(path)
        assert "\n" not in str(error.value)
