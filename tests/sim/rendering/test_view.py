import dataclasses

import pytest

from drone_rl.sim.rendering import View
from drone_rl.utils.errors import InputError

VIEW = View(camera="drone/front_center", height=25, width=64)


def test_a_view_is_a_fact_by_which_things_can_be_kept():
    assert {VIEW: 1}[View(camera="drone/front_center", height=25, width=64)] == 1
    assert dataclasses.replace(VIEW, modality="depth") != VIEW
    with pytest.raises(dataclasses.FrozenInstanceError):
        VIEW.height = 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modality": "normals"}, "give rgb, depth or segmentation"),
        ({"height": 0}, "view of 0x64 pixels; give 1 to 4096"),
        ({"width": 4097}, "view of 25x4097 pixels; give 1 to 4096"),
    ],
)
def test_what_no_camera_shows_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(VIEW, **change)
