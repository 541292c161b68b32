"""Names of settings that were most likely meant, and the choices of groups."""

import pytest

from drone_rl.cli.hydra.names import OTHER_NAMES, Command, choices, closest
from drone_rl.cli.main import COMMANDS
from drone_rl.utils.settings import conf_dir

KNOWN = ("seed", "optimizer", "optimizer.lr", "task", "task.num_cubes", "hydra.run.dir", "device")

pytestmark = pytest.mark.usefixtures("registered")


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("sed", "seed"),
        ("SEED", "seed"),
        ("lr", "optimizer.lr"),
        ("--learning-rate", "optimizer.lr"),
        ("optimizer.learning_rate", "optimizer.lr"),
        ("trainer.lr", "optimizer.lr"),
        ("optimzer.lr", "optimizer.lr"),
        ("+num_cubes", "task.num_cubes"),
        ("num_cubs", "task.num_cubes"),
        ("env", "task"),
        ("use_cuda", "device=cuda"),
        ("learningrat", "optimizer.lr"),
        ("log-dir", "hydra.run.dir"),
        ("xyz", None),
        ("policy", None),
    ],
)
def test_the_name_that_was_meant(name, meant):
    assert closest(name, KNOWN) == meant


def test_names_of_other_projects_lead_to_settings_that_exist():
    names = {"train": ["objective=ppo"], "evaluate": [], "verdict": [], "explain": []}
    keys = {k for name, groups in names.items() for k in Command(name, conf_dir(), groups).keys}
    for candidates in OTHER_NAMES["settings"].values():
        assert {c.partition("=")[0] for c in candidates} <= keys | {"certificate"}, candidates
    for meant in OTHER_NAMES["commands"].values():
        assert meant.split()[0] in COMMANDS


def test_schemas_are_no_choices():
    assert choices(conf_dir(), "optimizer") == ["adam", "sgd"]
