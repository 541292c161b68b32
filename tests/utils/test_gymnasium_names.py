"""Names in Gymnasium's registry, whichever package is imported first."""

import re
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import pytest

from drone_rl.config import TASKS
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.sim.tasks.term_task import define_task
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


def test_import_registers_the_shipped_tasks():
    code = (
        "import gymnasium, drone_rl\n"
        "before = [name for name in gymnasium.registry if name.startswith('drone_rl/')]\n"
        "import drone_rl.sim.tasks\n"
        "after = [name for name in gymnasium.registry if name.startswith('drone_rl/')]\n"
        "names = ['drone_rl/CollectCubes-v0', 'drone_rl/Pillars-v0', 'drone_rl/Reach-v0']\n"
        "assert before == after == names, (before, after)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_own_task_has_a_name_of_its_own():
    with patch.dict(TASKS), patch.dict(MAKERS), patch.dict(gymnasium.registry):
        objects = {"ball": {"role": "goal"}}
        define_task("reach_2_balls", objects=objects, reward=["reached"], success=["all_goals"])
        with gymnasium.make("drone_rl/Reach2Balls-v0", step_limit=7) as env:
            assert env.unwrapped.batch.task.values()["step_limit"] == 7
            assert env.spec.max_episode_steps is None  # the task's own limit counts, once


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
