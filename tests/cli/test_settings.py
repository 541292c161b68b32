"""Settings that several commands share."""

from importlib import import_module

from drone_rl.cli.main import COMMANDS
from drone_rl.cli.settings import CommandSettings


def test_every_command_has_the_folders_and_plain_defaults():
    for name in COMMANDS:
        command = import_module(f"drone_rl.cli.{name.replace('-', '_')}").Command
        assert issubclass(command, CommandSettings)
        assert command().paths.outputs == "outputs"
