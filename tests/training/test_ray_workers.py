"""Ray workers need the extra `ray`."""

import importlib
import sys

import pytest

from drone_rl.config import TaskSettings
from drone_rl.config.learning import Ray
from drone_rl.config.networks import Network
from drone_rl.config.registry import modules_of
from drone_rl.config.training import TrainSettings
from drone_rl.training.ray_workers import _remote_collector
from drone_rl.training.train import make_collector
from drone_rl.utils.errors import InputError

TASK = TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60)


def test_missing_ray_raises_with_install_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match=r"pip install -e '.\[ray\]'"):
        make_collector(TrainSettings(task=TASK, collector=Ray(num_envs=2)))


PLUGIN = """
import drone_rl
from drone_rl.policies import MLP

@drone_rl.register_network("ray_cells")
class Cells(MLP):
    def __init__(self, in_shape, num_actions, *, width: int = 4, generator=None):
        super().__init__(in_shape, num_actions, hidden=(width,), generator=generator)
"""


def test_a_worker_imports_the_modules_that_register_its_parts(tmp_path, monkeypatch, registered):
    (tmp_path / "ray_plugin.py").write_text(PLUGIN)
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("ray_plugin")
    settings = TrainSettings(task=TASK, network="ray_cells", collector=Ray(num_envs=2))
    sent = (settings.config(), sorted(modules_of(settings)))
    del sys.modules["ray_plugin"], Network.registry["ray_cells"]  # as in a new process
    with pytest.raises(InputError, match="it must be one of"):
        Network.read("ray_cells", "network")
    collector = _remote_collector(*sent, [2], 0, None)
    collector.shutdown()
    assert type(collector.actor.network).__name__ == "Cells"
    registered(sys.modules["ray_plugin"].Cells)
