import math

import pytest

from drone_rl.config import BaseTaskSettings, PillarsSettings, TaskSettings
from drone_rl.config.task import DEFAULT_TASK
from drone_rl.utils.errors import InputError


def test_settings_name_their_task_but_the_first():
    assert PillarsSettings(num_rows=2).values()["name"] == "pillars"
    assert "name" not in TaskSettings().values() and TaskSettings.name == DEFAULT_TASK


def test_plain_data_names_its_task_or_is_cube_collection():
    for settings in (TaskSettings(num_cubes=2), PillarsSettings(num_rows=3)):
        assert BaseTaskSettings.read(settings.values(), "task") == settings
    assert BaseTaskSettings.read({"name": "pillars"}, "task") == PillarsSettings()
    for values, message in (
        (
            {"name": "walls"},
            r"task\.name='walls': it must be one of collect_cubes, pillars, reach; ",
        ),
        ({"name": "pillars", "num_cubes": 3}, r"task\.num_cubes is unknown; valid names: num_rows"),
        ({"name": "pillars", "num_rows": 0}, r"task\.num_rows=0: it must be a whole number"),
    ):
        with pytest.raises(InputError, match=f"^{message}"):
            BaseTaskSettings.read(values, "task")


def test_defaults_are_the_original_studys():
    settings = TaskSettings()
    assert settings.front_bound == 44.0  # 3 * 9 + 15 + 2
    assert settings.side_bound == 26.0
    assert settings.last_distance == 33.0


def test_boundaries_adjust_to_the_cubes():
    settings = TaskSettings(num_cubes=5, lateral_bound=10.0)
    assert settings.front_bound == 15 + 4 * 9 + 11
    assert settings.side_bound == 30.0


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"step_limit": 5}, "step_limit=5"),
        ({"vertical_bound": 5.0, "altitude": 6.6}, "altitude=6.6"),
        ({"altitude": 1.0}, "altitude=1.0"),
        ({"step_length": 3.0}, "step_length=3.0"),
        ({"first_distance": 1.0}, "first_distance=1.0"),
    ],
)
def test_impossible_fields_of_cubes_are_refused(change, name):
    with pytest.raises(InputError) as error:
        TaskSettings(**change)
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def test_step_limit_that_just_suffices():
    needed = math.ceil(33.0 - TaskSettings().touch_distance)
    TaskSettings(step_limit=needed)
    with pytest.raises(InputError, match=f"at least {needed}"):
        TaskSettings(step_limit=needed - 1)


def test_derived_values_of_pillars():
    settings = PillarsSettings()
    assert (settings.row_size, settings.num_pillars) == (4, 16)  # a quarter a metre, 16 m across
    assert settings.touch_distance == 0.9
    assert (settings.last_distance, settings.finish) == (30.0, 34.0)
    assert settings.values()["name"] == "pillars"
    assert PillarsSettings(density=0.001).row_size == 1


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"spacing": 4.0}, "spacing=4.0 leaves no room to move aside"),
        ({"first_distance": 2.0}, "first_distance=2.0 leaves no room to move aside"),
        ({"finish_margin": 1.0}, "finish_margin=1.0 puts the line into the last row"),
        ({"height": 2.0}, "height=2.0 is below the drone; give at least 2.5"),
        ({"step_limit": 33}, "step_limit=33 ends .* at least 34"),
        ({"density": 6.0}, "density=6.0 makes fields too dense to cross: .* lower density"),
        ({"width": 16.0, "density": 0.5, "spacing": 20.0, "first_distance": 20.0,
          "finish_margin": 9.0}, "too dense to cross"),
    ],
)  # fmt: skip
def test_impossible_fields_of_pillars_are_refused(changes, said):
    with pytest.raises(InputError, match=said):
        PillarsSettings(**{"width": 1.2, **changes})


def test_possible_fields_of_pillars():
    PillarsSettings(step_limit=34)
    PillarsSettings(width=1.2, spacing=4.01)
    PillarsSettings(height=2.5)


def test_rows_with_just_enough_open_ones_are_accepted(monkeypatch):
    settings = PillarsSettings()
    num_open = sum(settings._is_open(row) for row in settings._rows())
    monkeypatch.setattr("drone_rl.config.task._LEAST_OPEN", num_open)
    PillarsSettings()
    monkeypatch.setattr("drone_rl.config.task._LEAST_OPEN", num_open + 1)
    with pytest.raises(InputError, match="too dense to cross"):
        PillarsSettings()


def test_a_pillar_at_the_touch_distance_closes_a_lane():
    settings = PillarsSettings(spread=0.95, density=0.5)  # a single lane, in the middle
    assert not settings._is_open([settings.touch_distance])
    assert settings._is_open([settings.touch_distance + 1e-9])
