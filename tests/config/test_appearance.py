"""How worlds look is checked before anything is drawn."""

import pytest

from drone_rl.config import MINIMAL, AppearanceSettings
from drone_rl.utils.errors import InputError


def test_each_value_is_fixed_or_a_range():
    settings = AppearanceSettings(
        sun_elevation=[10, 20], sky_zenith=[[0, 0, 0], [1, 1, 1]], ground_texture="grid"
    )
    assert settings.sun_elevation == (10.0, 20.0)
    assert settings.sky_zenith == ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    assert settings.ground_texture == ("grid",)
    assert AppearanceSettings.read(settings.values(), "appearance") == settings


def test_an_appearance_has_the_name_of_its_file():
    fog = AppearanceSettings.from_name("fog", "appearance")
    assert fog.fog_visibility == 40.0 and fog.ground_texture is None
    relit = AppearanceSettings.from_name("relit", "appearance")  # of redrawn, of randomized
    assert relit.sun_elevation == (10.0, 85.0) and relit.distractors == 0
    assert relit.camera_turn == (0.0, 0.0, 0.0)
    assert AppearanceSettings.from_name("minimal", "appearance") == MINIMAL
    with pytest.raises(InputError, match=r"x='Fogg' is unknown; .*minimal.*; did you mean fog\?"):
        AppearanceSettings.from_name("Fogg", "x")
    with pytest.raises(InputError, match="unknown"):
        AppearanceSettings.from_name("../task/pillars", "x")


def test_only_the_defaults_are_minimal():
    assert MINIMAL.is_minimal and AppearanceSettings(exposure=1).is_minimal
    assert not AppearanceSettings(fog_visibility=50.0).is_minimal


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"fog_visibility": 0.0}, "fog_visibility=0.0 is out of range; give a number above 0"),
        ({"fog_visibility": [200, 50]}, "fog_visibility goes from 200 to 50, which is less"),
        ({"fog_visibility": [0, 50]}, r"fog_visibility\[0\]=0 is out of range"),
        ({"sun_elevation": [1, 2, 3]}, "sun_elevation=.* is out of range"),
        ({"sun_elevation": "high"}, "sun_elevation='high' is a text"),
        ({"sun_elevation": float("nan")}, "sun_elevation=nan is out of range"),
        ({"sun_color": [0.1, 0.2]}, r"sun_color=.* does not fit; give a list of 3"),
        ({"sun_color": [[0, 0.5, 0], [1, 0.4, 1]]}, "sun_color goes from 0.5 to 0.4"),
        ({"sun_color": [[0, 0.5, 0], 1]}, r"sun_color\[1\]=1 does not fit"),
        ({"sky_horizon": [0, 0, 1.5]}, r"sky_horizon\[2\]=1.5 is out of range"),
        ({"shadows": 2}, "shadows=2 is out of range; give a number from 0 to 1"),
        ({"ground_texture": []}, "ground_texture=.* must name a texture"),
        ({"ground_texture": ["grid", "grid"]}, "each once"),
        ({"ground_tile": 0}, "ground_tile=0 is out of range"),
        ({"exposure": 0}, "exposure=0 is out of range"),
        (
            {"distractors": 1.5},
            "distractors=1.5 is not a whole number; give .* from 0 to 64",
        ),
        ({"distractors": [5, 2]}, "distractors goes from 5 to 2"),
        ({"distractor_size": 0}, "distractor_size=0 is out of range"),
        ({"camera_offset": [0, 0]}, "camera_offset=.* does not fit"),
        ({"camera_offset": [[0, 0, 1], [0, 0, 0]]}, "camera_offset goes from 1 to 0"),
        ({"camera_turn": [0, 100, 0]}, r"camera_turn\[1\]=100 is out of range"),
        ({"camera_widening": [3, -3]}, "camera_widening goes from 3 to -3"),
    ],
)
def test_what_can_not_be_is_refused_in_one_line(given, words):
    with pytest.raises(InputError, match=words) as refused:
        AppearanceSettings(**given)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("given", "varies"),
    [
        ({}, False),
        ({"fog_visibility": 50.0, "ground_texture": "grid", "shadows": 1.0}, False),
        ({"sun_strength": (0.5, 0.5), "distractor_size": (1.0, 2.0)}, False),
        ({"distractors": (0, 0)}, False),
        ({"distractors": 1}, True),
        ({"sun_strength": (0.5, 0.6)}, True),
        ({"sky_zenith": ((0.0, 0.5, 1.0), (1.0, 0.5, 1.0))}, True),
        ({"object_texture": ("none", "grid", "bricks")}, True),
        ({"shadows": 0.6}, True),
    ],
)
def test_whether_episodes_differ(given, varies):
    assert AppearanceSettings(**given).varies is varies
