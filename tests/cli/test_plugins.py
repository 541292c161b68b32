"""Parts of the user's own on the command line, from training to evaluation."""

import shutil

import pytest

from tests.cli.running import TINY, drone_rl, error_line

PARTS = '''
"""A network, a transform, a return estimator and a task."""

from collections import OrderedDict

import torch
from torch import nn

import drone_rl
from drone_rl.envs.transforms import PixelTransform
from drone_rl.objectives import ReturnEstimator, returns
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.networks import orthogonal


@drone_rl.register_network("cells")
class CellNetwork(PolicyNetwork):
    def __init__(
        self, in_shape, num_actions, *, rows: int = 5, generator: torch.Generator | None = None
    ):
        layers = OrderedDict(
            cells=nn.AdaptiveAvgPool2d((rows, 8)),
            flatten=nn.Flatten(),
            logits=nn.Linear(in_shape[0] * rows * 8, num_actions),
        )
        super().__init__(in_shape, layers, orthogonal(generator))


@drone_rl.register_transform("mirror")
class Mirror(PixelTransform):
    def __init__(self, every: int = 1):
        super().__init__()
        self.every = every

    def _apply_transform(self, obs):
        return obs.flip(-1)[..., :: self.every]


@drone_rl.register_returns("centred")
class Centred(ReturnEstimator):
    def __init__(self, gamma: float = 0.95, **kwargs):
        super().__init__(**kwargs)
        self.gamma = gamma

    def estimate(self, reward, done):
        values = returns.reward_to_go(reward, done, self.gamma)
        return values - values.mean()
'''
CHOSEN = ["network=cells", "network.rows=3", "+transforms.mirror.every=2", "returns=centred"]
FEW = ["episodes=2", "num_envs=2", "baselines=false", "videos=0"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a plug-in and a run of it."""
    path = tmp_path_factory.mktemp("plugins")
    (path / "my_parts.py").write_text(PARTS)
    done = drone_rl("train", *TINY, "plugins=[my_parts]", *CHOSEN, "hydra.run.dir=run", cwd=path)
    assert done.returncode == 0, done.stderr
    return path


def test_a_policy_of_registered_parts_is_evaluated(folder):
    (folder / "tree.py").write_text("raise ValueError")  # dm_control imports another tree
    done = drone_rl("evaluate", "policy=run", "plugins=[my_parts]", *FEW, cwd=folder)
    assert done.returncode == 0, done.stderr


def test_a_file_of_another_folder_is_a_plug_in_of_sweeps_and_resumed_runs(folder, tmp_path):
    file, work = tmp_path / "my parts" / "my_parts.py", tmp_path / "work"
    file.parent.mkdir()
    work.mkdir()
    shutil.copy(folder / "my_parts.py", file)
    sweep = ["seed=0,1", "hydra.sweep.dir=s", "hydra.sweep.subdir='r${seed}'"]
    plugin, *chosen = "plugins=[../my parts/my_parts.py]", "returns=centred"
    done = drone_rl("train", "-m", *TINY, plugin, *chosen, *sweep, cwd=work)
    assert done.returncode == 0, done.stderr
    more = ["plugins=my parts/my_parts.py", "trainer.total_frames=500"]
    done = drone_rl("train", f"resume={work}/s/r1", *more, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    saved = (work / "s" / "r1" / ".hydra" / "overrides.yaml").read_text()
    assert f"plugins=['{file}']" in saved.replace("''", "'")


def test_without_the_plug_in_one_line_names_the_part_and_the_remedy(folder):
    line = error_line(drone_rl("evaluate", "policy=run", *FEW, cwd=folder))
    assert "transforms[3].name='mirror': it must be one of" in line
    assert "plugins=[MODULE]" in line


FILES = {
    "needs_more": "import not_installed.part",
    "fails": "x = 1\ny = x / 0\n",
    "nameless": "import drone_rl\n@drone_rl.register_returns\nclass A: 0\n",
    "leaves": "import sys\nsys.exit(0)\n",
    "mujoco": "import drone_rl",
}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["plugins=[nowhere]"], "give a module in this folder or on PYTHONPATH"),
        (["plugins=[./my_parts]"], "plugins=./my_parts is no Python file; give the path of one"),
        (["plugins=my_parts,fails"], "give plugins=[MODULE,FILE.py]"),
        (["plugins=[needs_more]"], "needs_more.py); install not_installed"),
        (["plugins=[fails]"], "fails.py (ZeroDivisionError: division by zero); correct it"),
        (
            ["plugins=[other/my_parts.py,my_parts.py]"],
            "has precedence over your my_parts.py; rename",
        ),
        (["plugins=[nameless]"], "nameless.py: give a name in brackets"),
        (["plugins=[leaves]"], "plugins=leaves failed in line 2 of "),
        (["plugins=[mujoco]"], "has precedence over your mujoco.py; rename the file"),
        (["plugins=[my_parts]", "network=cells", "network.row=3"], "did you mean network.rows?"),
        (["network=cells"], "with plugins=[MODULE]"),
    ],
)
def test_mistakes(folder, tmp_path, words, message):
    shutil.copy(folder / "my_parts.py", tmp_path)
    for name, text in FILES.items():
        (tmp_path / f"{name}.py").write_text(text)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "my_parts.py").touch()
    assert message in error_line(drone_rl("train", *TINY, *words, cwd=tmp_path))


def test_a_run_is_resumed_only_with_the_plug_in_typed(folder):
    line = error_line(drone_rl("train", "resume=run", "trainer.total_frames=500", cwd=folder))
    assert "plugins=[my_parts]" in line and "repeat it on the command line" in line


BROKEN = """
import drone_rl
from drone_rl.objectives import ReturnEstimator

@drone_rl.register_returns("broken")
class Broken(ReturnEstimator):
    def estimate(self, reward, done):
        return reward * self.factor
"""


def test_an_error_of_a_part_is_one_line_with_the_users_line(tmp_path):
    (tmp_path / "own_broken.py").write_text(BROKEN)
    plugins = "plugins=[own_broken]"
    done = drone_rl("train", *TINY, plugins, "returns=broken", cwd=tmp_path)
    assert done.returncode == 2
    assert error_line(done).startswith(f"error: {plugins} failed in line 8 of ")
    assert "'Broken' object has no attribute 'factor'); correct it" in error_line(done)
