import pytest

from drone_rl.config import (
    MINIMAL,
    AppearanceSettings,
    CameraSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.config.appearance import check_appearance
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
    fog = AppearanceSettings.read("fog", "appearance")
    assert fog.fog_visibility == 40.0 and fog.ground_texture is None
    relit = AppearanceSettings.read("relit", "appearance")  # of redrawn, of randomized
    assert relit.sun_elevation == (10.0, 85.0) and relit.distractors == 0
    assert relit.camera_turn == (0.0, 0.0, 0.0)
    assert AppearanceSettings.read("minimal", "appearance") == MINIMAL
    with pytest.raises(InputError, match=r"x='Fogg': it must be one of.*; did you mean fog\?"):
        AppearanceSettings.read("Fogg", "x")
    with pytest.raises(InputError, match="must be one of"):
        AppearanceSettings.read("../task/pillars", "x")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"fog_visibility": [200, 50]}, r"fog_visibility=\[200,50\]: it must have the lower"),
        ({"sun_elevation": [1, 2, 3]}, r"sun_elevation=\[1,2,3\]: it must be a number"),
        ({"ground_texture": []}, "ground_texture=.* must name a texture"),
        ({"ground_texture": ["grid", "grid"]}, "each once"),
    ],
)
def test_values_out_of_bounds(given, words):
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
def test_varies(given, varies):
    assert AppearanceSettings(**given).varies is varies


def check(task=None, camera=None, **given):
    task = task or TaskSettings()
    camera = camera or CameraSettings()
    check_appearance(AppearanceSettings(**given), camera, task.object_region, task.name)


def test_camera_and_distractors_with_room():
    check()
    check(distractors=(0, 30), camera_offset=((-1, -1, -2), (1, 1, 5)), camera_widening=(-30, 35))
    check(PillarsSettings(), camera_offset=(8.0, 0.0, 0.0))  # the first pillar begins at 8.5 m


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"camera_offset": (0, 0, -2.46)}, "=-2.46 up puts .* the ground; give -2.45 or more"),
        ({"camera_offset": ((0, 0, -3), (0, 0, 1))}, "=-3 up puts the camera into the ground"),
        ({"camera_widening": 36}, "=36 makes a field of view of 171 degrees; give -134 to 35"),
        ({"camera_widening": (-140, 0)}, "=-140 makes a field of view of -5 degrees"),
        ({"distractors": 1, "camera_offset": (0, -9, 0)}, "=9 sideways .* into a distractor"),
    ],
)
def test_camera_and_distractors_without_room(given, words):
    with pytest.raises(InputError, match=words) as refused:
        check(**given)
    assert "\n" not in str(refused.value)


def test_a_camera_in_the_first_object():
    near = TaskSettings(first_distance=4.0)
    check(near, camera_offset=(2.3, 0, 0))
    with pytest.raises(InputError, match=r"=2.35 forward puts .* give less than 2.35"):
        check(near, camera_offset=(2.35, 0, 0))


def test_tasks_without_object_positions():
    check_appearance(AppearanceSettings(), CameraSettings(), None, "posts")
    with pytest.raises(InputError, match="distractors=5: task=posts does not define"):
        check_appearance(AppearanceSettings(distractors=(0, 5)), CameraSettings(), None, "posts")
