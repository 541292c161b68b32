"""Unknown choices of groups are refused before Hydra composes the settings."""

import pytest

from drone_rl.cli.hydra.mistakes import check_choices, choices
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import conf_dir


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("task=base_task", r"^task=base_task is unknown; .*: collect_cubes, collect_one, pillars$"),
        ("task=pillar", r"^task=pillar is unknown; did you mean task=pillars\? give one of: "),
        ("+task@task=base_pillars", "^task=base_pillars is unknown"),
        ("task=collect_one,base_task", "task=base_task"),
        ("task='pillarz'", "task=pillarz"),
        ("logger=[csv,aim]", "logger=aim is unknown; give one of: csv, mlflow, tensorboard, wandb"),
        ("sweep=nope", "sweep=nope is unknown; give one of: cubes, high_rate"),
        ("hydra/launcher=pbs", "hydra/launcher=pbs .*local, ray, slurm"),
        ("dynamics=null", "^dynamics=null: leave it out, or give one of: computer_vision, "),
    ],
)
def test_schemas_and_unknown_choices_are_refused(override, message):
    with pytest.raises(InputError, match=message):
        check_choices(["seed=1", override], conf_dir())


def test_all_else_is_accepted():
    plain = ["task=pillars", "network=mlp,small_cnn", "sweep=seeds", "-m", "seed=1,2"]
    check_choices(
        [*plain, "resume=base_x", "task.name=base_x", "--help", "=x", "../x=base_y", "/tmp=x"],
        conf_dir(),
    )
    check_choices(["logger=[csv,tensorboard]", "task='pillars'", "task=choice(a,b)"], conf_dir())
    check_choices(["sweep=mine", "task=mine", "--config-dir=my"], conf_dir())


def test_schemas_are_no_choices():
    assert choices(conf_dir(), "optimizer") == ["adam", "sgd"]
