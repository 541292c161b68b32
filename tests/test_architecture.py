"""Import contracts and structural rules of the package."""

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import drone_rl

ROOT = Path(__file__).parents[1]


def modules():
    found = pkgutil.walk_packages(drone_rl.__path__, "drone_rl.")
    return [m.name for m in found]


def test_import_contracts_hold():
    command = [str(Path(sys.executable).parent / "lint-imports")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_every_public_name_is_exported_and_documented():
    for name in modules():
        module = importlib.import_module(name)
        assert module.__doc__, name
        for public in getattr(module, "__all__", ()):
            assert getattr(module, public).__doc__, f"{name}.{public}"
