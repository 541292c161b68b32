"""What is gone on with is compared in today's words."""

import pytest

from drone_rl.config import COMPUTER_VISION, MINIMAL, MOVES_SETTINGS
from drone_rl.config.configuration import check_same_config, modern
from drone_rl.utils.errors import InputError

OLD = {
    "task": {"_target_": "drone_rl.config.TaskSettings", "num_cubes": 3},
    "camera": {"_target_": "drone_rl.config.CameraSettings", "width": 64},
    "transforms": {
        "gray": {"_target_": "drone_rl.envs.transforms.GrayPixels"},
        "stack": {"_target_": "torchrl.envs.CatFrames", "N": 2, "dim": -3, "in_keys": ["pixels"]},
    },
    "policy": {"_target_": "drone_rl.policies.MLP", "_partial_": True, "hidden": [8]},
    "collector": {"make": "drone_rl.cli.build.threaded_collector", "num_envs": 4},
    "seed": 0,
}
NEW = {
    "appearance": MINIMAL.values(),
    "dynamics": COMPUTER_VISION.values(),
    "actions": MOVES_SETTINGS.values(),
    "task": {"num_cubes": 3},
    "camera": {"width": 64},
    "transforms": {
        "gray": {"_target_": "drone_rl.envs.transforms.GrayPixels"},
        "stack": {"_target_": "torchrl.envs.CatFrames", "N": 2},
    },
    "network": {"_target_": "drone_rl.policies.MLP", "hidden": [8]},
    "collector": {
        "_target_": "drone_rl.training.train.threaded_collector",
        "num_envs": 4,
        "compiled": False,
    },
    "seed": 0,
}


def test_old_configurations_are_told_in_todays_words():
    assert modern(OLD) == NEW
    assert modern(NEW) == NEW


def test_a_training_of_old_took_each_step_in_python():
    for name, is_compiled in (
        ("train.threaded_collector", False),
        ("actor_critic.rollout_collector", None),
    ):
        old = {"collector": {"_target_": f"drone_rl.training.{name}"}}
        assert modern(old)["collector"].get("compiled") is is_compiled
        new = {"collector": {**old["collector"], "compiled": True}}
        assert modern(new) == new


def test_a_training_of_old_learned_on_as_many_threads_as_it_collected_on():
    old = {"collector": {"num_threads": 3}, "trainer": {"total_frames": 10}}
    flights = {"confirm_episodes": 0, "confirm_share": 1.0}
    unasked = {**flights, "compiled": False}
    assert modern(old)["trainer"] == {"total_frames": 10, "num_threads": 3, **unasked}
    now = {"confirm_episodes": 5, "confirm_share": 0.5, "compiled": True}
    new = {**old, "trainer": {"num_threads": 2, **now}}
    assert modern(new) == new


def test_a_run_of_old_goes_on_only_as_it_was():
    check_same_config(OLD, NEW, [])
    with pytest.raises(InputError, match=r"network.hidden=\[9\]: .* network.hidden=\[8\]"):
        check_same_config(OLD, {**NEW, "network": {**NEW["network"], "hidden": [9]}}, [])


@pytest.mark.parametrize("part", ["task", "collector", "transforms", "policy", "trainer"])
@pytest.mark.parametrize("rubbish", [None, 3, [1], {"make": 3}, {"_target_": [1]}, {"a": {"b": 1}}])
def test_rubbish_of_a_file_is_no_bug(part, rubbish):
    assert isinstance(modern({**OLD, part: rubbish}), dict)


def test_changed_config_is_named_with_both_values():
    saved = {"seed": 0, "optimiser": {"lr": 0.1}, "trainer": {"total_frames": 10}}
    check_same_config(saved, {**saved, "trainer": {"total_frames": 99}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match=r"optimiser.lr=0.2: .* optimiser.lr=0.1"):
        check_same_config(saved, {**saved, "optimiser": {"lr": 0.2}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match="extra=1"):
        check_same_config(saved, {**saved, "extra": 1}, [])
