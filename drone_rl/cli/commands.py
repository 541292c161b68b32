"""All commands, read from `commands.toml`."""

import tomllib
from pathlib import Path

TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
"""Module, purpose, examples and next steps of each command."""
COMMANDS = {name: entry["module"] for name, entry in TABLE.items()}
"""Module in `drone_rl.cli` of each command; `demo` runs three of them."""
