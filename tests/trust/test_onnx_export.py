"""Two programs that differ by what is known, on pictures of flights."""

import dataclasses

import pytest
import torch

import drone_rl
from drone_rl.envs import Pipeline
from drone_rl.policies.zoo import PolicyDescription, open_onnx
from drone_rl.trust import onnx_export as exporting
from drone_rl.trust.onnx_export import agreement
from drone_rl.utils.errors import InputError


@pytest.fixture
def flown(make_pipeline):
    """Worlds, a policy, and the same policy as a function of frames."""
    env, actor = make_pipeline(8, seed=3)
    network, transform = actor.module[0].module, Pipeline(env.observer.image.transforms)
    network.layers.logits.weight.data.mul_(100)  # so that pictures matter
    return env, actor, lambda frames: network(transform(frames)).softmax(-1)


def test_network_agrees_with_itself(flown):
    env, actor, same = flown
    shapes = []
    found = agreement(env, actor, lambda frames: (shapes.append(frames.shape), same(frames))[1], 5)
    assert (found.frames, found.actions_differ) == (40, 0)
    assert found.difference < 1e-6
    assert shapes == [(8, 25, 64, 3)] * 5


def test_largest_difference_of_a_probability(flown):
    env, actor, same = flown
    asked = []

    def other(frames):
        asked.append(same(frames))
        if len(asked) != 2:
            return asked[-1]
        probabilities = asked[-1].clone()
        probabilities[3, 1] += 0.25
        return probabilities

    found = agreement(env, actor, other, 3)
    assert found.difference == pytest.approx(0.25, abs=1e-6)
    moved = asked[1][3] + torch.tensor([0.0, 0.25, 0.0])
    assert found.actions_differ == int(moved.argmax() != asked[1][3].argmax())


def test_exported_model_agrees_and_has_its_command(tmp_path):
    target = tmp_path / "mine.onnx"
    found = drone_rl.export_onnx(drone_rl.load_policy("good"), target)
    assert found.frames == 10_000 and found.actions_differ == 0
    assert 0 < found.difference <= 1e-5
    assert b'"drone-rl train"' in target.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.onnx"]


def test_exported_model_has_no_camera_faults(tmp_path, monkeypatch):
    monkeypatch.setattr(exporting, "_STEPS", 3)
    policy = drone_rl.load_policy("good")
    described = policy.description.model_dump(mode="json")
    transforms = described["inputs"]["pixels"]["transforms"]
    transforms.insert(1, {"name": "noise", "strength": 0.2, "correlation_time": 0.0})
    transforms.insert(2, {"name": "late_frames", "frames": 2})
    trained = dataclasses.replace(policy, description=PolicyDescription.read(described))
    assert drone_rl.export_onnx(trained, tmp_path / "mine.onnx").difference <= 1e-5
    drone_rl.export_onnx(policy, tmp_path / "clean.onnx")
    frames = torch.randint(0, 256, (2, 25, 64, 3), dtype=torch.uint8)
    models = [open_onnx((tmp_path / f"{n}.onnx").read_bytes()) for n in ("mine", "clean")]
    assert torch.equal(models[0](frames), models[1](frames))


@pytest.mark.parametrize("wrong", [1 / 3 + 1.1e-5, float("nan")])
def test_model_that_differs_is_not_written(tmp_path, monkeypatch, wrong):
    """A policy that always goes left is said to have one chance in three."""
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: torch.full((len(f), 3), wrong))
    (tmp_path / "mine.onnx").write_text("an older one")
    with pytest.raises(InputError, match=r"differ by up to (0.67|nan).*format=safetensors"):
        drone_rl.export_onnx(drone_rl.load_policy("poor"), tmp_path / "mine.onnx")
    assert (tmp_path / "mine.onnx").read_text() == "an older one"
