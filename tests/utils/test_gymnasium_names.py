"""Names in Gymnasium's registry, whichever package is imported first."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from drone_rl.sim.tasks import as_task
from drone_rl.utils.gymnasium_names import ENVIRONMENTS
from tests.forked import run_forked

ROOT = Path(__file__).parents[2]
gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")


@pytest.mark.parametrize("first", ["gymnasium, drone_rl", "drone_rl, gymnasium", "gymnasium"])
def test_the_order_of_imports_does_not_matter(first):
    module = "" if "drone_rl" in first else "drone_rl:"
    code = (
        f"import {first}, sys\n"
        f"spec = gymnasium.envs.registration._find_spec('{module}drone_rl/CollectCubes-v0')\n"
        "assert spec.id == 'drone_rl/CollectCubes-v0'\n"
        "assert not {'torch', 'mujoco'} & set(sys.modules), 'known before anything is made'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_readme_example_prints_nothing():
    text = (ROOT / "README.md").read_text()
    (call,) = re.findall(r"`(gymnasium\.make_vec\([^`]*\))`", text)
    code = (
        "import warnings; warnings.simplefilter('default')\n"
        "import gymnasium, drone_rl\n"
        f"worlds = {call.replace('num_envs=64', 'num_envs=1')}\n"
        "assert worlds.num_envs == 1\n"
        "gymnasium.make('drone_rl/CollectCubes-v0').reset(seed=0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_each_name_makes_its_task(name):
    spec = gymnasium.spec(name)
    assert spec.kwargs == {"task": ENVIRONMENTS[name]}
    assert spec.max_episode_steps is None  # the task's own limit counts, once
    assert as_task(spec.kwargs["task"]).largest_reward > 0


def test_gymnasium_suggests_a_name():
    with pytest.raises(gymnasium.error.NameNotFound, match=r"CollectCube.*CollectCubes"):
        gymnasium.make("drone_rl/CollectCube-v0")


def test_without_gymnasium_an_error_names_the_extra(tmp_path):
    code = (
        "import sys\n"
        "for name in [*sys.modules]:\n"
        "    if name.partition('.')[0] in ('drone_rl', 'gymnasium'): del sys.modules[name]\n"
        "sys.modules['gymnasium'] = None\n"
        "import drone_rl\n"
        "try: drone_rl.DroneWorld\n"
        "except drone_rl.InputError as error: print(error)\n"
    )
    (line,) = run_forked(code, cwd=tmp_path).stdout.splitlines()
    assert line.endswith("install it with pip install -e '.[gym]' in the checkout")
