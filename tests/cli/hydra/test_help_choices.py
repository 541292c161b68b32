"""What a group of settings offers."""

import pytest

from drone_rl.cli.hydra.composition import conf_dir
from drone_rl.cli.hydra.help import check_choices, without_schemas
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("task=base_task", r"task/base_task .*one of: collect_cubes, collect_one, pillars$"),
        ("+task@task=base_pillars", "could not find task/base_pillars"),
        ("task=collect_one,base_task", "task/base_task"),
        ("sweep=nope", "could not find sweep/nope .*one of: cubes, high_rate"),
    ],
)
def test_schemas_and_unknown_sweeps_are_refused(override, message):
    with pytest.raises(InputError, match=message):
        check_choices(["seed=1", override], conf_dir())


def test_all_else_is_left_to_hydra():
    plain = ["task=pillars", "network=resnet", "sweep=seeds", "sweep=null", "-m", "seed=1,2"]
    check_choices(
        [*plain, "resume=base_x", "task.name=base_x", "--help", "=x", "../x=base_y"], conf_dir()
    )
    check_choices(["sweep=mine", "--config-dir=my"], conf_dir())


def test_hydras_list_of_choices():
    text = (
        "In 'train': Could not find 'task/nope' Available options in 'task': base_pillars "
        "base_task collect_cubes pillars Config search path: provider=hydra, path=pkg://hydra.conf"
    )
    assert without_schemas(text) == (
        "could not find task/nope (task=nope); give one of: collect_cubes, pillars"
    )
    assert without_schemas("Key 'x' is unknown") == "Key 'x' is unknown"
