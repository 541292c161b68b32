"""Commands, and files of conf/, compose to valid settings, from which parts are built."""

import itertools
from pathlib import Path

import pytest
import torch
import yaml

from drone_rl.cli.main import COMMANDS
from drone_rl.config import TASKS, BaseTaskSettings, DynamicsSettings, PillarsSettings
from drone_rl.config.training import TrainSettings
from drone_rl.policies.zoo import describe
from drone_rl.utils.errors import InputError
from tests.cli.hydra.conftest import commands

CONF = Path(__file__).parents[3] / "conf"
STEMS = [command.replace("-", "_") for command in COMMANDS]


def files(*groups):
    return [(g, path.stem) for g in groups for path in sorted((CONF / g).glob("*.yaml"))]


@pytest.mark.parametrize("command", STEMS)
def test_defaults_of_files_and_classes_agree(command, settings):
    made, defaults = settings(command), commands()[command]()
    by_reference = {"logger", "folder"}  # whose folders are those of the run and of the outputs
    for name in type(defaults).model_fields:
        if name not in by_reference:
            assert getattr(made, name) == getattr(defaults, name), name


def together(*groups):
    """The files of groups, one of each group at a time: every file once."""
    names = [[path.stem for path in sorted((CONF / g).glob("*.yaml"))] for g in groups]
    return [dict(zip(groups, row, strict=True)) for row in itertools.zip_longest(*names)]


@pytest.mark.parametrize(
    "chosen",
    [
        *together("task", "appearance", "camera"),
        *({group: name} for group, name in files("transforms")),
        *({"network": name} for name in ("lstm", "mlp", "original_cnn", "small_cnn")),
    ],
)
def test_every_choice_builds(chosen, settings):
    names = {group: name for group, name in chosen.items() if name is not None}
    if "original" in names.values():
        names["camera"] = "frame"  # of whose rows it crops some
    made = settings("train", *(f"{g}={name}" for g, name in names.items())).as_base(TrainSettings)
    described = describe(made)
    env = described.build_env(1, seed=0, device="cpu")
    network = described.build_network(torch.Generator().manual_seed(0))
    seen = env.reset()
    outputs = network(*(seen[key] for key in network.in_keys))
    logits = outputs[0] if network.is_recurrent else outputs
    assert logits.shape == (1, 3)
    env.close()


@pytest.mark.parametrize("name", [name for _, name in files("experiment")])
def test_every_experiment_composes_and_describes_a_policy(name, settings):
    made = settings("train", f"experiment={name}").as_base(TrainSettings)
    assert describe(made).network.name


@pytest.mark.parametrize("name", [name for _, name in files("sweep")])
def test_the_first_and_last_values_of_every_sweep_describes_a_policy(name, settings):
    sweep = yaml.safe_load((CONF / "sweep" / f"{name}.yaml").read_text())
    params = sweep["hydra"]["sweeper"]["params"]
    listed = {k: str(v).split(",") for k, v in params.items() if "(" not in str(v)}
    for end in (0, -1):
        made = [f"{key}={values[end]}" for key, values in listed.items()]
        chosen = settings("train", f"sweep={name}", *made).as_base(TrainSettings)
        assert describe(chosen).network.name


@pytest.mark.parametrize("command", ["evaluate", "prove", "explain"])
def test_any_setting_of_the_task_can_be_changed_for_a_trained_policy(command, config, settings):
    names = {field for task in TASKS.values() for field in task.model_fields} | {"name"}
    assert set(config(command).task) == names
    assert settings(command).task == {}
    assert settings(command, "task.num_cubes=5").task == {"num_cubes": 5}
    chosen = settings(command, "task=pillars", "task.num_rows=5").task
    assert BaseTaskSettings.read(chosen, "task") == PillarsSettings(num_rows=5)


def test_interpolations_numbers_as_names_and_keys_that_no_file_names(settings):
    made = settings("train", "returns.gamma=${scheduler.factor}", "scheduler.factor=0.5")
    assert made.returns.gamma == 0.5
    assert settings("play", "policy=2024").policy == "2024"
    assert settings("train", "camera=large", "camera.horizontal_fov=90").camera.width == 256


def test_whole_numbers_may_have_an_exponent(settings):
    words = ["trainer.total_frames=1.5E+3", "network.hidden=[1e2,64]", "optimizer.lr=1e-3"]
    made = settings("train", *words)
    assert (made.trainer.total_frames, made.network.hidden) == (1500, (100, 64))
    assert repr(settings("verdict", "task.num_cubes=1e1").task) == "{'num_cubes': 10}"
    with pytest.raises(InputError, match=r"total_frames=1\.5: it must be a whole number"):
        settings("train", "trainer.total_frames=1.5")


def test_original_is_algorithm_4(settings):
    made = settings("train", "experiment=original")
    assert made.collector.num_envs == 1
    assert made.objective.reduction == "sum"
    assert made.returns.name == "standardized"
    assert (made.optimizer.target, made.optimizer.lr) == ("torch.optim.SGD", 1e-4)
    assert (made.scheduler.step_size, made.scheduler.gamma) == (5, 0.99)
    assert round(3 * made.trainer.target_share, 2) == 2.99
    assert made.trainer.running_decay == 0.9
    assert made.trainer.total_episodes == 30_000


def test_a_pipeline_keeps_its_order(settings):
    names = [step.name for step in settings("train", "transforms=original").transforms]
    assert names == ["gray", "standardize", "crop"]
    made = settings("train", "~transforms.standardize", "transforms=original")
    assert [step.name for step in made.transforms] == ["gray", "crop"]


def test_further_arguments_are_passed_on(settings):
    made = settings("train", "+optimizer.amsgrad=true", "optimizer.lr=0.5")
    assert made.optimizer.values() == {"lr": 0.5, "amsgrad": True}
    made = made.optimizer.make([torch.nn.Parameter(torch.ones(1))])
    assert made.defaults["amsgrad"] is True


@pytest.mark.parametrize("command", ["evaluate", "explain"])
def test_any_setting_of_the_dynamics_can_be_changed_for_a_trained_policy(command, settings):
    assert settings(command).dynamics == {}
    made = settings(command, "dynamics.wind=[5,0,0]", "dynamics.mode=simple_flight")
    assert made.dynamics == {"mode": "simple_flight", "wind": [5, 0, 0]}
    whole = settings(command, "dynamics=crazyflie", "dynamics.gusts=1.5").dynamics
    assert whole.keys() == DynamicsSettings.model_fields.keys()
    assert (whole["mass"], whole["gusts"], whole["mode"]) == (0.0319, 1.5, "simple_flight")


def test_a_training_with_flight_dynamics_describes_a_policy(settings):
    made = settings("train", "dynamics=quadrotor", "dynamics.wind=[5,0,0]", "actions.move_speed=2")
    assert made.dynamics == DynamicsSettings(mode="simple_flight", wind=(5.0, 0.0, 0.0))
    described = describe(made.as_base(TrainSettings))
    assert (described.dynamics, described.actions.settings.move_speed) == (made.dynamics, 2.0)
    assert settings("train", "dynamics=quadrotor", "dynamics.mode=computer_vision") == settings(
        "train"
    )
    with pytest.raises(InputError, match=r"^dynamics\.wind=\[5\.0, 0\.0, 0\.0\] moves nothing"):
        settings("train", "dynamics.wind=[5,0,0]")
