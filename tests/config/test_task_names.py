import pytest

from drone_rl.config import PillarsSettings, TaskSettings, read_task, settings_of
from drone_rl.utils.errors import InputError


def test_plain_data_names_its_task_or_is_cube_collection():
    for settings in (TaskSettings(num_cubes=2), PillarsSettings(num_rows=3)):
        assert read_task(settings.values(), "task") == settings
    assert "name" not in TaskSettings().values()
    with pytest.raises(
        InputError, match=r"task\.name='walls' is unknown; valid names: collect_cubes"
    ):
        read_task({"name": "walls"}, "task")
    with pytest.raises(InputError, match=r"task\.'num_cubes' is unknown"):
        read_task({**PillarsSettings().values(), "num_cubes": 3}, "task")
    with pytest.raises(InputError, match=r"task\.num_rows is missing"):
        read_task({"name": "pillars"}, "task")


@pytest.mark.parametrize("name", [3, None, ["pillars"], "pillars\n"])
def test_a_name_is_a_known_text(name):
    with pytest.raises(InputError, match="is unknown; valid names"):
        settings_of(name)
