"""Which policies verification refuses."""

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
from drone_rl.policies.zoo import PolicyDescription, describe
from drone_rl.policies.zoo.description import TaskDescription
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.utils.errors import InputError
from drone_rl.verification.requirements import require_cubes


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": PillarsSettings()}, "only task=collect_cubes, got task=pillars"),
        (
            {"dynamics": DynamicsSettings(mode="simple_flight")},
            "only dynamics=computer_vision, got",
        ),
        ({"actions": ActionSettings(kind="velocity")}, "only actions=moves, got actions.kind=vel"),
        (
            {"appearance": AppearanceSettings(fog_visibility=(20.0, 100.0))},
            "only appearances without ranges",
        ),
    ],
)
def test_unsupported_settings_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        require_cubes(describe(TrainSettings().replace(**change)), "proofs")


def test_a_task_derived_from_cube_collection_is_refused(monkeypatch):
    class OtherRules(TaskSettings):
        name = "other_rules"

    monkeypatch.setitem(MAKERS, OtherRules, CollectCubes)
    described = describe(TrainSettings()).replace(task=TaskDescription.of(OtherRules()))
    with pytest.raises(InputError, match="only task=collect_cubes, got task=other_rules"):
        require_cubes(described, "proofs")


@pytest.mark.parametrize(
    ("transform", "message"),
    [
        ({"name": "stack", "N": 2}, "proofs support only policies that observe one frame"),
        ({"name": "late_frames", "frames": 1}, r"simulates faults \(transform late_frames\)"),
        ({"name": "frozen_frames", "share": 0.1}, r"simulates faults \(transform frozen_frames\)"),
    ],
)
def test_memory_and_camera_faults_are_refused(transform, message):
    described = drone_rl.load_policy("good").description.model_dump(mode="json")
    described["inputs"]["pixels"]["transforms"] = [{"name": "gray"}, transform]
    with pytest.raises(InputError, match=message):
        require_cubes(PolicyDescription.read(described), "proofs")


def test_a_random_custom_transform_is_refused(registered):
    class Grain(PixelTransform):
        def _apply_transform(self, obs):
            return obs + 0.05 * torch.randn_like(obs)

    registered(register_transform("grain")(Grain))
    described = drone_rl.load_policy("good").description.model_dump(mode="json")
    described["inputs"]["pixels"]["transforms"].append({"name": "grain"})
    with pytest.raises(InputError, match="exact probabilities support only transforms without ch"):
        require_cubes(PolicyDescription.read(described), "exact probabilities")


def test_shipped_policies_and_constant_appearances_are_supported():
    policy = drone_rl.load_policy("good")
    for description in (policy.description, policy.in_appearance("fog").description):
        assert require_cubes(description, "proofs") is description.task.parameters
