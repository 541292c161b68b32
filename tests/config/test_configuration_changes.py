import pytest

from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.config.configuration import Changes
from drone_rl.utils.errors import InputError


def test_some_settings_of_a_task():
    kind = Changes(TaskSettings)
    assert kind.read({"num_cubes": 5, "spacing": None}, "task") == {"num_cubes": 5}
    with pytest.raises(InputError, match=r"^task\.num_cubes=0"):
        kind.read({"num_cubes": 0}, "task")
    with pytest.raises(InputError, match=r"^task\.num_cubs is unknown"):
        kind.read({"num_cubs": 1}, "task")


def test_dynamics_are_changed_as_tasks_are():
    assert Changes(DynamicsSettings).read({"wind": [1, 0, 0], "mass": None}, "dynamics") == {
        "wind": (1.0, 0.0, 0.0)
    }
