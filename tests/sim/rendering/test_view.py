import dataclasses

import pytest
import torch

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


@pytest.mark.parametrize(
    ("modality", "shape", "dtype"),
    [
        ("rgb", (5, 25, 64, 3), torch.uint8),
        ("depth", (5, 25, 64), torch.float32),
        ("segmentation", (5, 25, 64), torch.int32),
    ],
)
def test_pictures_have_the_shape_and_type_of_what_they_show(modality, shape, dtype):
    pictures = dataclasses.replace(VIEW, modality=modality).new_pictures(5)
    assert (tuple(pictures.shape), pictures.dtype) == (shape, dtype)


def test_what_a_renderer_does_not_know_is_refused():
    VIEW.check_modality(object(), {"rgb"})
    depth = dataclasses.replace(VIEW, modality="depth")
    with pytest.raises(InputError, match=r"'depth' can't be drawn by object; ask for one of: rgb$"):
        depth.check_modality(object(), {"rgb"})
