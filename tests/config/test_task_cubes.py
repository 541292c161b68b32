import math

import pytest

from drone_rl.config import TaskSettings
from drone_rl.utils.errors import InputError


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
        ({"num_cubes": 0}, "num_cubes=0"),
        ({"num_cubes": 2.5}, "num_cubes=2.5"),
        ({"spacing": -9.0}, "spacing=-9.0"),
        ({"first_distance": math.nan}, "first_distance=nan"),
        ({"lateral_bound": -1.0}, "lateral_bound=-1.0"),
        ({"cube_color": (2.0, 0.0, 0.0)}, "cube_color[0]=2.0"),
        ({"step_limit": 5}, "step_limit=5"),
        ({"vertical_bound": 5.0, "altitude": 6.6}, "altitude=6.6"),
        ({"altitude": 1.0}, "altitude=1.0"),
        ({"step_length": 3.0}, "step_length=3.0"),
        ({"first_distance": 1.0}, "first_distance=1.0"),
    ],
)
def test_what_cannot_be_met_is_refused_by_name_and_with_a_remedy(change, name):
    with pytest.raises(InputError) as error:
        TaskSettings(**change)
    assert name in str(error.value)
    assert "give" in str(error.value)
    assert "\n" not in str(error.value)


def test_step_limit_that_just_suffices():
    needed = math.ceil(33.0 - TaskSettings().touch_distance)
    TaskSettings(step_limit=needed)
    with pytest.raises(InputError, match=f"at least {needed}"):
        TaskSettings(step_limit=needed - 1)
