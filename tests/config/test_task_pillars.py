import pytest

from drone_rl.config import PillarsSettings
from drone_rl.utils.errors import InputError


def test_what_follows_from_the_settings():
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
        ({"height": 2.0}, "height=2.0 puts pillars below the drone; give at least 2.5"),
        ({"step_limit": 33}, "step_limit=33 ends every episode .* at least 34"),
        ({"density": 6.0}, "density=6.0 makes fields too dense to cross: .* lower density"),
        ({"width": 16.0, "density": 0.5, "spacing": 20.0, "first_distance": 20.0,
          "finish_margin": 9.0}, "too dense to cross"),
        ({"density": 0.0}, "density=0.0"),
        ({"collision_penalty": -1.0}, "collision_penalty=-1.0"),
    ],
)  # fmt: skip
def test_what_can_not_be_flown_is_refused(changes, said):
    with pytest.raises(InputError, match=said):
        PillarsSettings(**{"width": 1.2, **changes})


def test_what_is_just_possible_is_not():
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
