"""The command is a module too, as `python -m drone_rl`."""

import subprocess
import sys

import drone_rl


def test_the_module_is_the_command():
    command = [sys.executable, "-m", "drone_rl", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"drone-rl {drone_rl.__version__}\n"
