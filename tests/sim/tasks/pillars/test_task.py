from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks import Pillars, as_task


def test_settings_make_the_task():
    task = as_task(PillarsSettings(num_rows=2))
    assert isinstance(task, Pillars) and task.settings.num_rows == 2
    assert Pillars().settings == PillarsSettings()
