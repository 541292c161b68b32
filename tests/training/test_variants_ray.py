"""Ray workers need the extra `ray`."""

import sys

import pytest

from drone_rl.config import TaskSettings
from drone_rl.config.learning import Ray
from drone_rl.config.training import TrainSettings
from drone_rl.training.components import make_collector
from drone_rl.utils.errors import InputError

TASK = TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60)


def test_missing_ray_raises_with_install_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match=r"pip install 'drone-rl\[ray\]'"):
        make_collector(TrainSettings(task=TASK, collector=Ray(num_envs=2)))
