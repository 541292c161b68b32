"""Names that Gymnasium knows, whoever is imported first."""

import re
import subprocess
import sys
import tomllib
from importlib import import_module, metadata
from pathlib import Path

import pytest

from drone_rl.sim.tasks import as_task
from drone_rl.utils.imports import ENVIRONMENTS, register
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


def test_the_readmes_example_works_in_a_fresh_interpreter_and_nothing_is_said():
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
def test_each_is_made_of_a_task_with_settings(name):
    spec = gymnasium.spec(name)
    assert spec.kwargs == {"task": ENVIRONMENTS[name]}
    assert spec.max_episode_steps is None  # the task's own limit counts, once
    assert as_task(spec.kwargs["task"]).largest_reward > 0


PAGES = (ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*.py"))


def test_every_example_registers_what_it_makes():
    """Gymnasium 1 looks for no plug-ins, so that without `import drone_rl` it knows no name."""
    found = 0
    for page in PAGES:
        text = page.read_text()
        blocks = re.findall(r"```python\n(.*?)```", text, re.S) if page.suffix == ".md" else [text]
        for block in blocks:
            if re.search(r"gymnasium\.make|make_vec\(", block) and "drone_rl/" in block:
                found += 1
                assert re.search(r"^import drone_rl\b|\"drone_rl:", block, re.M), (page, block)
    assert found >= 3


def test_what_is_known_already_stays():
    before = dict(gymnasium.registry)
    register()
    assert gymnasium.registry == before


def test_a_name_that_is_not_there():
    with pytest.raises(gymnasium.error.NameNotFound, match=r"CollectCube.*CollectCubes"):
        gymnasium.make("drone_rl/CollectCube-v0")


def test_the_entry_point_registers():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    (text,) = project["entry-points"]["gymnasium.envs"].values()
    assert metadata.EntryPoint("", text, "gymnasium.envs").load() is register


def test_without_gymnasium_one_line_tells_what_to_install(tmp_path):
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


def test_the_names_of_modules_are_right():
    assert (
        import_module("drone_rl.envs.gymnasium.environments").DroneWorld.metadata["render_fps"]
        == 10
    )
