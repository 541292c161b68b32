"""Every file of conf/ composes, builds what it names and explains each of its knobs."""

import dataclasses
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.errors import HydraException
from hydra.utils import instantiate
from omegaconf import OmegaConf

from drone_rl.cli.main import COMMANDS, conf_dir
from drone_rl.configs import SCHEMAS, register_configs
from drone_rl.sim.settings import CameraSettings, TaskSettings

CONF = Path(__file__).parents[1] / "conf"
GROUPS = (
    "task",
    "camera",
    "transforms",
    "policy",
    "returns",
    "objective",
    "optimiser",
    "scheduler",
)
FILES = [(p.parent.name, p.stem) for g in GROUPS for p in sorted((CONF / g).glob("*.yaml"))]
EXPERIMENTS = sorted(p.stem for p in (CONF / "experiment").glob("*.yaml"))


@pytest.fixture(autouse=True)
def hydra():
    register_configs()
    with initialize_config_dir(str(CONF), version_base="1.3"):
        yield


def test_checkouts_configuration_is_used():
    assert conf_dir() == CONF


@pytest.mark.parametrize("command", COMMANDS)
def test_primary_configs_compose(command):
    assert compose(command.replace("-", "_"))


@pytest.mark.parametrize(("group", "name"), FILES)
def test_every_choice_builds(group, name):
    config = compose("train", [f"{group}={name}"])
    part = config[group]
    if group == "transforms":
        assert all(instantiate(t) is not None for t in part.values())
    else:
        assert instantiate(part) is not None


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_composes_and_its_network_fits_its_pictures(name):
    config = compose("train", [f"experiment={name}"])
    height = config.camera.height
    crop = config.transforms.get("crop")
    height = crop.bottom - crop.top if crop else height
    network = instantiate(config.policy)((1, height, config.camera.width), 3)
    assert network.layers.logits.out_features == 3


def test_defaults_are_the_settings_own():
    config = compose("train")
    assert instantiate(config.task) == TaskSettings()
    assert instantiate(config.camera) == CameraSettings()


@pytest.mark.parametrize("command", ["evaluate", "play"])
def test_any_setting_of_the_task_can_be_changed_for_a_trained_policy(command):
    assert set(compose(command).task) == {f.name for f in dataclasses.fields(TaskSettings)}


def test_schemas_know_every_setting():
    for group, settings in (("task", TaskSettings), ("camera", CameraSettings)):
        ours = {f.name for f in dataclasses.fields(SCHEMAS[group])} - {"_target_"}
        assert ours == {f.name for f in dataclasses.fields(settings)}


@pytest.mark.parametrize(
    "override",
    [
        "task.num_cubs=3",
        "sed=1",
        "task.num_cubes=three",
        "trainer.total_frames=many",
        "policy=no_such_policy",
        "optimiser.learning_rate=1",
    ],
)
def test_typos_die_when_composing(override):
    with pytest.raises(HydraException):
        compose("train", [override])


def test_original_is_algorithm_4():
    config = compose("train", ["experiment=original"])
    assert config.collector.num_envs == 1
    assert config.objective.reduction == "sum"
    assert config.returns._target_.endswith("Standardised")
    assert (config.optimiser._target_, config.optimiser.lr) == ("torch.optim.SGD", 1e-4)
    assert (config.scheduler.step_size, config.scheduler.gamma) == (5, 0.99)
    assert round(3 * config.trainer.target_share, 2) == 2.99
    assert config.trainer.running_decay == 0.9
    assert config.trainer.total_episodes == 30_000


def uncommented(path):
    """Knobs with no comment on the line above."""
    lines = path.read_text().splitlines()
    for i, line in enumerate(lines):
        text = line.strip()
        is_knob = ":" in text and not text.startswith(("#", "-", "_", "defaults:", "{"))
        is_knob &= not text.endswith((",", "}"))
        if is_knob and not lines[i - 1].strip().startswith("#") and not text.endswith(":"):
            yield f"{path.name}:{i + 1}: {text}"


@pytest.mark.parametrize(
    "path", sorted(CONF.rglob("*.yaml")), ids=lambda p: str(p.relative_to(CONF))
)
def test_every_knob_is_explained(path):
    if path.parent.name == "hydra":
        return
    assert not list(uncommented(path))
    assert OmegaConf.load(path) is not None
