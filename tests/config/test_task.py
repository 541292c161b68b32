from drone_rl.config import PillarsSettings, TaskSettings
from drone_rl.config.task import DEFAULT_TASK


def test_settings_name_their_task_but_the_first():
    assert PillarsSettings(num_rows=2).values()["name"] == "pillars"
    assert "name" not in TaskSettings().values() and TaskSettings.name == DEFAULT_TASK
