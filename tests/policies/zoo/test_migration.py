"""Settings become descriptions by exact names; whatever else they name is refused, unimported."""

import sys

import pytest
import torch
from torch import nn

from drone_rl.policies.zoo import describe, registry
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole
from tests.policies.zoo.test_description import DEFAULT

CONFIG = {
    "task": {"_target_": "drone_rl.config.TaskSettings", **DEFAULT["task"]},
    "camera": {"_target_": "drone_rl.config.CameraSettings", **DEFAULT["camera"]},
    "transforms": {
        "gray": {"_target_": "drone_rl.envs.transforms.GrayPixels"},
        "standardize": {
            "_target_": "drone_rl.envs.transforms.StandardizePixels",
            "mean": 0.53,
            "std": 0.21,
        },
    },
    "policy": {
        "_target_": "drone_rl.policies.SmallCNN",
        "_partial_": True,
        "patch": 4,
        "channels": [16, 32],
        "hidden": [128],
    },
    "optimiser": {"_target_": "os.system"},
}
STACK = {"_target_": "torchrl.envs.CatFrames", "N": 2, "dim": -3, "in_keys": ["pixels"]}


def test_settings_of_a_training():
    assert describe(CONFIG).as_dict() == DEFAULT


def test_what_a_constructor_has_defaults_for_may_be_left_out():
    policy = {"_target_": "drone_rl.policies.MLP", "_partial_": True}
    found = describe({**CONFIG, "policy": policy}).as_dict()
    assert found["network"] == {"name": "mlp", "hidden": [128, 64]}


def test_a_transform_that_is_switched_off_and_one_with_fixed_arguments():
    transforms = {**CONFIG["transforms"], "standardize": None, "stack": STACK}
    found = describe({**CONFIG, "transforms": transforms}).as_dict()
    assert found["transforms"] == [{"name": "gray"}, {"name": "stack", "N": 2}]
    with pytest.raises(InputError, match=r"transforms\.'stack'\.dim must be -3"):
        describe({**CONFIG, "transforms": {**transforms, "stack": {**STACK, "dim": -1}}})


@pytest.mark.parametrize("part", ["task", "camera", "policy", "transforms.gray"])
@pytest.mark.parametrize(
    "target",
    ["os.system", "antigravity.fly", "drone_rl.policies.SmallCNN ", "builtins.eval", None, ["os"]],
)
def test_other_targets_are_neither_imported_nor_called(part, target):
    sys.modules.pop("antigravity", None)
    config, (key, *inner) = {**CONFIG}, part.split(".")
    if inner:
        config[key] = {**config[key], inner[0]: {"_target_": target}}
    else:
        config[key] = {**config[key], "_target_": target}
    with pytest.raises(InputError, match="_target_"):
        describe(config)
    assert "antigravity" not in sys.modules


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (None, "config=None"),
        ({**CONFIG, "policy": {**CONFIG["policy"], "_partial_": False}}, "_partial_ must be true"),
        ({**CONFIG, "policy": {**CONFIG["policy"], "_args_": [1]}}, "'_args_' is unknown"),
        ({**CONFIG, "policy": {**CONFIG["policy"], "patch": "${seed}"}}, "patch"),
        ({**CONFIG, "policy": None}, "policy=None"),
        ({k: v for k, v in CONFIG.items() if k != "camera"}, "config.camera is missing"),
        ({**CONFIG, "transforms": [1]}, "transforms="),
    ],
)
def test_settings_that_no_training_has(config, message):
    with pytest.raises(InputError, match=message):
        describe(config)


class Mine(nn.Module):
    def __init__(self, in_shape, num_actions, *, width, generator=None):
        super().__init__()
        self.logits = nn.Linear(in_shape[0], num_actions * width)


def test_a_network_of_ones_own_once_it_is_registered(monkeypatch):
    monkeypatch.setattr(registry, "NETWORKS", registry.NETWORKS)
    mine = {"_target_": f"{Mine.__module__}.Mine", "_partial_": True, "width": 2}
    with pytest.raises(InputError, match="register_network"):
        describe({**CONFIG, "policy": mine})
    registry.register_network("mine", Mine, {"width": Whole(1, 9)})
    try:
        found = describe({**CONFIG, "policy": mine})
    finally:
        del registry.NETWORKS["mine"]
    assert found.as_dict()["network"] == {"name": "mine", "width": 2}
    assert found.network.values == {"width": 2}
    assert isinstance(Mine((1, 2, 2), 3, width=2).logits.weight, torch.Tensor)


def test_entry_points_are_loaded_when_a_name_is_not_known(monkeypatch):
    class Point:
        def load(self):
            registry.register_network("theirs", Mine, {"width": Whole(1, 9)})

    monkeypatch.setattr(registry.metadata, "entry_points", lambda group: [Point()])
    registry.load_entry_points.cache_clear()
    try:
        assert registry.find_part(registry.NETWORKS, "theirs", "x").make is Mine
    finally:
        registry.NETWORKS.pop("theirs", None)
        registry.load_entry_points.cache_clear()
