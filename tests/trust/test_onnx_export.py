"""Two programs that differ by what is known, on pictures of flights."""

import dataclasses
import math

import pytest
import torch

import drone_rl
from drone_rl.envs import on_pixels
from drone_rl.policies.zoo import open_onnx, parse
from drone_rl.trust import onnx_export as exporting
from drone_rl.trust.onnx_export import agreement
from drone_rl.utils.errors import InputError
from tests.continuous import make_env, make_policy


@pytest.fixture
def flown(make_pipeline):
    """Worlds, a policy, and the same policy as a function of frames."""
    env, actor = make_pipeline(8, seed=3)
    network, transform = actor.module[0].module, on_pixels(env.transform)
    network.layers.logits.weight.data.mul_(100)  # so that pictures matter
    return env, actor, lambda frames: network(transform(frames)).softmax(-1)


def test_a_program_agrees_with_itself(flown):
    env, actor, same = flown
    shapes = []
    found = agreement(env, actor, lambda frames: (shapes.append(frames.shape), same(frames))[1], 5)
    assert (found.frames, found.actions_differ) == (40, 0)
    assert found.difference < 1e-6
    assert shapes == [(8, 25, 64, 3)] * 5


def test_programs_agree_on_what_speeds_are_for_the_most_part():
    env = make_env(4)
    network, actor = make_policy(env)
    transform, actions = on_pixels(env.transform), network.actions
    found = agreement(
        env, actor, lambda frames: actions.probabilities(network(transform(frames))), 5
    )
    env.close()
    assert (found.frames, found.actions_differ) == (20, 0) and found.difference < 1e-6


def test_the_greatest_difference_counts_once_and_anywhere(flown):
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


def test_another_order_of_actions_differs_wherever_they_are_not_alike(flown):
    env, actor, same = flown
    found = agreement(env, actor, lambda frames: same(frames).roll(1, -1), 5)
    assert found.actions_differ == found.frames


def test_what_is_no_number_is_no_agreement(flown):
    env, actor, same = flown
    found = agreement(env, actor, lambda frames: same(frames) * math.nan, 2)
    assert math.isnan(found.difference)


def test_whoever_ends_an_episode_begins_another_and_is_asked_about_it(flown):
    """Flying left ends every episode after 27 steps, and 40 are flown."""
    env, actor, _ = flown
    network = actor.module[0].module
    network.layers.logits.weight.data.zero_()
    network.layers.logits.bias.data.copy_(torch.tensor([0.0, 99.0, 0.0]))
    seen = []

    def other(frames):
        seen.append(frames.clone())
        return torch.tensor([[0.0, 1.0, 0.0]]).expand(len(frames), 3)

    found = agreement(env, actor, other, 40)
    assert found.difference < 1e-6
    assert not torch.equal(seen[26], seen[27])
    level = env.base_env.worlds.task.settings.altitude
    assert level == env.base_env.worlds.state.body.position[0, 2]
    assert env.base_env.worlds.state.body.position[0, 1] == 40 - 27


def test_an_onnx_model_that_agrees_is_left_with_its_command(tmp_path):
    target = tmp_path / "mine.onnx"
    found = drone_rl.export_onnx(drone_rl.load_policy("good"), target)
    assert found.frames == 10_000 and found.actions_differ == 0
    assert 0 < found.difference <= 1e-5
    assert b'"drone-rl train"' in target.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.onnx"]


def test_an_onnx_model_is_of_the_policy_and_not_of_what_goes_wrong_in_its_camera(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(exporting, "_STEPS", 3)
    policy = drone_rl.load_policy("good")
    described = policy.description.as_dict()
    described["transforms"].insert(1, {"name": "noise", "strength": 0.2, "correlation_time": 0.0})
    described["transforms"].insert(2, {"name": "late_frames", "frames": 2})
    trained = dataclasses.replace(policy, description=parse(described))
    assert drone_rl.export_onnx(trained, tmp_path / "mine.onnx").difference <= 1e-5
    drone_rl.export_onnx(policy, tmp_path / "clean.onnx")
    frames = torch.randint(0, 256, (2, 25, 64, 3), dtype=torch.uint8)
    models = [open_onnx((tmp_path / f"{n}.onnx").read_bytes()) for n in ("mine", "clean")]
    assert torch.equal(models[0](frames), models[1](frames))


@pytest.mark.parametrize("wrong", [1 / 3 + 1.1e-5, float("nan")])
def test_an_onnx_model_that_does_otherwise_is_not_left(tmp_path, monkeypatch, wrong):
    """A policy that always goes left is said to have one chance in three."""
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: torch.full((len(f), 3), wrong))
    (tmp_path / "mine.onnx").write_text("an older one")
    with pytest.raises(InputError, match=r"differ by up to (0.67|nan).*format=safetensors"):
        drone_rl.export_onnx(drone_rl.load_policy("poor"), tmp_path / "mine.onnx")
    assert (tmp_path / "mine.onnx").read_text() == "an older one"


@pytest.mark.parametrize(("added", "is_left"), [(0.9e-5, True), (1.1e-5, False)])
def test_the_limit_is_one_in_a_hundred_thousand(tmp_path, monkeypatch, added, is_left):
    """A policy that surely goes left, whatever it sees."""
    always = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
    other = (always - added * always).expand(100, 3)
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: other)
    policy = drone_rl.load_policy("poor")
    if is_left:
        assert drone_rl.export_onnx(policy, tmp_path / "m.onnx").difference < 1e-5
    else:
        with pytest.raises(InputError, match="more than 1e-05"):
            drone_rl.export_onnx(policy, tmp_path / "m.onnx")
    assert (tmp_path / "m.onnx").exists() == is_left


def test_a_place_for_an_onnx_model_that_is_none(tmp_path, monkeypatch):
    monkeypatch.setattr(exporting, "_STEPS", 3)
    monkeypatch.setattr(exporting, "MAX_DIFFERENCE", 2.0)
    monkeypatch.setattr(exporting, "make_onnx", lambda *_: b"a model")
    monkeypatch.setattr(exporting, "open_onnx", lambda _: lambda f: torch.zeros(len(f), 3))
    (tmp_path / "m.onnx").write_text("a file")
    with pytest.raises(InputError, match=r"m\.onnx can't be made \(.*\); give another folder"):
        drone_rl.export_onnx("poor", tmp_path / "m.onnx" / "m.onnx")  # before the comparison
    drone_rl.export_onnx("poor", tmp_path / "new" / "m.onnx")
    assert (tmp_path / "new" / "m.onnx").read_bytes() == b"a model"


def test_a_folder_is_refused_before_the_conversion(tmp_path):
    with pytest.raises(InputError, match=r"is a folder; give a file in it, such as policy\.onnx"):
        drone_rl.export_onnx("good", tmp_path)
    with pytest.raises(InputError, match=r"^target=5 is no path"):
        drone_rl.export_onnx("good", 5)  # pyright: ignore[reportArgumentType]
