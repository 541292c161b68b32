from drone_rl.cli.main import COMMANDS, USAGE, find_command
from drone_rl.utils.settings import conf_dir


def test_every_command_is_told_of_has_a_module_and_a_file():
    for command in COMMANDS:
        name = command.replace("-", "_")
        assert f"\n  {command} " in USAGE
        assert callable(find_command(command).run)
        assert (conf_dir() / f"{name}.yaml").is_file()
