"""`import drone_rl` is fast and provides all public names; `python -m drone_rl`."""

import pkgutil
import subprocess
import sys

import pytest

import drone_rl
from drone_rl.utils.display import Result


def test_every_public_name_is_available():
    for name in drone_rl.__all__:
        assert getattr(drone_rl, name).__name__ == name
        assert name in dir(drone_rl)
    assert {"train", "load_policy", "judge", "InputError"} <= {*drone_rl.__all__}


def test_the_repr_of_results_is_their_text():
    """Not the thousands of numbers in its fields."""
    classes = [c for c in map(drone_rl.__getattr__, drone_rl.__all__) if isinstance(c, type)]
    shown = [c for c in classes if hasattr(c, "_repr_html_") and c.__str__ is not object.__str__]
    assert len(shown) > 10
    assert [c.__name__ for c in shown if not issubclass(c, Result)] == []


def test_an_unknown_name_raises():
    with pytest.raises(AttributeError, match=r"no attribute 'verdict'; .* is drone_rl.judge"):
        drone_rl.verdict  # noqa: B018
    with pytest.raises(AttributeError, match=r"no attribute 'walk'$"):
        drone_rl.walk  # noqa: B018


def test_imports_load_and_print_nothing():
    """Importing all modules compiles no scene, loads no kernel and seeds no generator."""
    found = pkgutil.walk_packages(drone_rl.__path__, "drone_rl.")
    code = (
        "import os, sys, drone_rl\n"
        "assert not {'torch', 'mujoco', 'hydra'} & set(sys.modules)\n"
        "import torch; before = dict(os.environ); state = torch.get_rng_state()\n"
        f"import {', '.join(module.name for module in found)}\n"
        "assert torch.equal(state, torch.get_rng_state())\n"
        "changed = {k for k in os.environ if os.environ[k] != before.get(k)}\n"
        "ours = {k for k in changed if k.startswith(('DRONE', 'HYDRA', 'CUDA', 'OMP'))}\n"
        "assert not ours, ours\n"
        "drone_rl.make_env().close()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def test_python_m_drone_rl_is_the_command():
    command = [sys.executable, "-m", "drone_rl", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"drone-rl {drone_rl.__version__}\n"
