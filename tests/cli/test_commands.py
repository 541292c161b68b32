"""The table of all commands is complete."""

import importlib.util

from drone_rl.cli.commands import COMMANDS, TABLE


def test_each_command_has_a_purpose_settings_examples_and_a_module():
    for name, entry in TABLE.items():
        assert entry.keys() == {"module", "class", "about", "settings", "examples", "next"}, name
        assert len(entry["about"]) <= 84 and 1 <= len(entry["settings"]) <= 11
        assert importlib.util.find_spec(f"drone_rl.cli.{COMMANDS[name]}") is not None
