"""Settings that several commands share."""

from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.cli.settings import CommandSettings


def test_every_command_has_the_folders_and_plain_defaults():
    for name in COMMANDS:
        command = find_command(name)
        assert issubclass(command, CommandSettings)
        assert command().paths.outputs == "outputs"
