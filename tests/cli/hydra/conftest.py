"""Composes as the command line does."""

import copy

import pytest
from hydra import compose, initialize_config_dir

from drone_rl.cli.hydra.composition import read_settings, store_defaults
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.utils.settings import conf_dir

FILES = {c.replace("-", "_"): c for c in COMMANDS}


def commands():
    """The settings of each command, by the name of its file."""
    return {file: find_command(name) for file, name in FILES.items()}


@pytest.fixture(scope="session")
def registered():
    """Defaults of all commands."""
    store_defaults(commands())


@pytest.fixture(scope="session")
def composed():
    """What Hydra has made of commands and overrides so far."""
    return {}


@pytest.fixture
def config(registered, composed):
    """What Hydra makes of a command and overrides."""

    def read(command, overrides=()):
        key = (command, *overrides)
        if key not in composed:
            composed[key] = compose(command, [*overrides])
        return copy.deepcopy(composed[key])

    with initialize_config_dir(str(conf_dir()), version_base="1.3"):
        yield read


@pytest.fixture
def settings(config):
    """The settings of a command, without loggers, whose folder only a run knows."""
    known = commands()

    def read(name, *words):
        without = ["logger=csv"] if name == "train" else []
        return read_settings(known[name], config(name, [*without, *words]))

    return read
