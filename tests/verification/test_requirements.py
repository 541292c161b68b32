import dataclasses
import re

import pytest
import torch

import drone_rl
from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.config.registry import register_transform
from drone_rl.config.training import TrainSettings
from drone_rl.envs.transforms import PixelTransform
from drone_rl.policies.zoo import describe, parse
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.utils.errors import InputError
from drone_rl.verification.requirements import require_cubes


def test_the_policies_of_the_package_pass():
    policy = drone_rl.load_policy("good").description
    assert require_cubes(policy, "proofs") is policy.task


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": PillarsSettings()}, "proofs support only task=collect_cubes, got task=pillars"),
        (
            {"dynamics": DynamicsSettings(mode="simple_flight")},
            "only dynamics=computer_vision, got",
        ),
        ({"actions": ActionSettings(kind="velocity")}, "only actions=moves, got actions.kind=vel"),
        (
            {"appearance": AppearanceSettings(fog_visibility=(20.0, 100.0))},
            "only appearances without ranges; this policy's differs between episodes; give another",
        ),
    ],
)
def test_other_tasks_dynamics_actions_and_appearances_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        require_cubes(describe(TrainSettings().replace(**change)), "proofs")


def test_a_task_derived_from_cube_collection_is_refused(monkeypatch):
    class OtherRules(TaskSettings):
        name = "other_rules"

    monkeypatch.setitem(MAKERS, OtherRules, CollectCubes)
    described = dataclasses.replace(describe(TrainSettings()), task=OtherRules())
    with pytest.raises(InputError, match="only task=collect_cubes, got task=other_rules"):
        require_cubes(described, "proofs")


def test_an_appearance_that_is_the_same_in_every_episode_passes():
    foggy = TrainSettings().replace(appearance=AppearanceSettings(fog_visibility=20.0))
    assert require_cubes(describe(foggy), "proofs") == foggy.task


@pytest.mark.parametrize(
    ("transform", "message"),
    [
        ({"name": "stack", "N": 2}, "proofs support only policies that observe one frame"),
        ({"name": "late_frames", "frames": 1}, r"simulates faults \(transform late_frames\)"),
        ({"name": "frozen_frames", "share": 0.1}, r"simulates faults \(transform frozen_frames\)"),
    ],
)
def test_memory_and_camera_faults_are_refused(transform, message):
    described = drone_rl.load_policy("good").description.as_dict()
    described["transforms"] = [{"name": "gray"}, transform]
    with pytest.raises(InputError, match=message):
        require_cubes(parse(described), "proofs")


@pytest.mark.parametrize(
    "appearance", [{"sun_strength": (0.2, 0.9)}, {"ground_texture": ("grid", "bricks")}]
)
def test_a_sampled_appearance_is_refused(appearance):
    policy = drone_rl.load_policy("good")
    sampled = policy.in_appearance(AppearanceSettings(**appearance)).description
    with pytest.raises(InputError, match="proofs support only appearances without ranges"):
        require_cubes(sampled, "proofs")
    fixed = policy.in_appearance("fog").description
    assert require_cubes(fixed, "exact probabilities") is fixed.task


def test_the_remedy_is_that_of_the_problem():
    other = {"task": PillarsSettings(), "dynamics": DynamicsSettings(mode="simple_flight")}
    message = re.escape("task=collect_cubes, got task=pillars; give another policy") + "$"
    with pytest.raises(InputError, match=message):
        require_cubes(describe(TrainSettings().replace(**other)), "proofs")


def test_a_random_transform_of_the_users_own_is_refused(registered):
    class Grain(PixelTransform):
        def _apply_transform(self, obs):
            return obs + 0.05 * torch.randn_like(obs)

    registered(register_transform("grain")(Grain))
    described = drone_rl.load_policy("good").description.as_dict()
    described["transforms"].append({"name": "grain"})
    with pytest.raises(InputError, match="exact probabilities support only transforms without ch"):
        require_cubes(parse(described), "exact probabilities")
