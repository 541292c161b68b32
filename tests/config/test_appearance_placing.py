"""Room for camera and distractors, checked before anything is drawn."""

import pytest

from drone_rl.config import AppearanceSettings, CameraSettings, PillarsSettings, TaskSettings
from drone_rl.config.appearance import check_appearance
from drone_rl.utils.errors import InputError


def check(task=None, camera=None, **given):
    task = task or TaskSettings()
    camera = camera or CameraSettings()
    check_appearance(AppearanceSettings(**given), camera, task.object_region, task.name)


def test_what_has_room():
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
def test_what_has_none_is_refused_in_one_line(given, words):
    with pytest.raises(InputError, match=words) as refused:
        check(**given)
    assert "\n" not in str(refused.value)


def test_a_camera_in_the_first_thing():
    near = TaskSettings(first_distance=4.0)
    check(near, camera_offset=(2.3, 0, 0))
    with pytest.raises(InputError, match=r"=2.35 forward puts .* give less than 2.35"):
        check(near, camera_offset=(2.35, 0, 0))


def test_tasks_that_do_not_say_where_their_things_stand():
    check_appearance(AppearanceSettings(), CameraSettings(), None, "posts")
    with pytest.raises(InputError, match="distractors=5: task=posts does not define"):
        check_appearance(AppearanceSettings(distractors=(0, 5)), CameraSettings(), None, "posts")
