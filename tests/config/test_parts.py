import subprocess
import sys

import pytest
import torch

from drone_rl.config import AppearanceSettings, TaskSettings
from drone_rl.config.learning import Adam, Optimizer, Sgd
from drone_rl.config.networks import Mlp, Network
from drone_rl.config.parts import locate
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.config.transforms import Crop, Gray
from drone_rl.utils.errors import InputError


def test_settings_round_trip():
    settings = TrainSettings(
        task=TaskSettings(num_cubes=2),
        transforms=(Gray(), Crop(top=1, bottom=9), Crop(top=0, bottom=4)),
        network=Mlp(hidden=()),
        trainer=TrainerSettings(total_episodes=7),
        seed=4,
    )
    config = settings.config()
    assert list(config["transforms"]) == ["gray", "crop", "crop_2"]
    assert config["network"] == {"_target_": "mlp", "hidden": []}
    assert TrainSettings.read(config) == settings
    without = settings.replace(transforms=())
    assert TrainSettings.read(without.config()) == without


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"task": {"vertical_bound": 3.0}}, "task.altitude=2.5 sinks cubes"),
        ({"network": {"_target_": "mlp", "hiden": []}}, "network.hiden is unknown; .*hidden"),
        (
            {"network": {"_target_": "resnet"}},
            "network._target_='resnet': it must be one of small_",
        ),
        (
            {"transforms": {"crop": {"top": -1}}},
            "transforms.crop.top=-1: it must be a whole number",
        ),
        ({"transforms": [{"name": "crop", "top": -1}]}, r"transforms\[0\].top=-1: it must be"),
        ({"transforms": {"crp": {}}}, "transforms.crp._target_='crp': .*did you mean crop"),
    ],
)
def test_errors_begin_with_the_place(config, message):
    with pytest.raises(InputError, match=f"^{message}"):
        TrainSettings.read(config)


def test_values_without_a_name_are_those_of_the_default_variant():
    settings = TrainSettings(optimizer={"lr": 0.5}, network={})
    assert settings == TrainSettings(optimizer=Adam(lr=0.5))
    with_sgd = TrainSettings(optimizer="sgd")
    assert with_sgd.replace(optimizer={"lr": 0.5}).optimizer == Sgd(lr=0.5)  # of the present one


def test_a_class_of_another_package_gets_all_values():
    config = {"_target_": "torch.optim.AdamW", "lr": 0.5, "amsgrad": True}
    optimizer = Optimizer.read(config)
    assert not optimizer.is_known and optimizer.config() == config
    assert optimizer.make([torch.ones(1)]).defaults["amsgrad"] is True
    more = {"_target_": Adam.target, "lr": 0.1, "amsgrad": True}
    assert Optimizer.read(more).config() == more
    assert Optimizer.read({"_target_": Adam.target, "lr": 0.1}) == Adam(lr=0.1)
    with pytest.raises(InputError, match=r"^optimizer\.lr=-1:"):
        Optimizer.read({**more, "lr": -1}, "optimizer")
    missing = Optimizer.read({"_target_": "mine.Optimizer"})
    with pytest.raises(InputError, match=r"_target_=mine\.Optimizer can't be imported"):
        missing.make()


def test_the_registry_of_a_part_has_no_others():
    ours = {n for n, v in Network.registry.items() if v.__module__.startswith("drone_rl.")}
    assert ours == {"small_cnn", "original_cnn", "lstm", "mlp"}


def test_settings_import_nothing_heavy():
    code = "import sys, drone_rl.config.training, drone_rl.config.commands\n"
    code += "assert not {'torch', 'hydra', 'mujoco', 'scipy'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_mujoco_warp_renders_only_the_minimal_appearance():
    look = AppearanceSettings(fog_visibility=50.0)
    with pytest.raises(InputError, match=r"^renderer=mujoco_warp supports only appearance=minimal"):
        TrainSettings(renderer="mujoco_warp", appearance=look)
    assert TrainSettings(appearance=look).replace(seed=1).appearance is look
    given = TrainSettings.read({"appearance": {"fog_visibility": 50.0}})
    assert given.appearance == look
    assert TrainSettings.read(given.config()) == given


def test_locate():
    with pytest.raises(InputError, match=r"_target_=no\.such can't be imported"):
        locate("no.such")
    with pytest.raises(InputError, match="can't be imported"):
        locate("os.no_such")
    with pytest.raises(InputError, match="can't be imported"):
        locate("")
    assert locate("os.path").__name__ == "posixpath"
