"""The renderer's images are the closed form's, byte for byte."""

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cube_images import (
    FRONT,
    NOTHING,
    CameraModel,
    CubeImages,
    CubeView,
)
from drone_rl.verification.prover.lattice import Lattice


def make(task=None, camera=None):
    task, camera = task or TaskSettings(), camera or CameraSettings()
    return CubeImages(Worlds(64, task, camera), Lattice(task), CameraModel.of(task, camera))


@pytest.fixture(scope="module")
def images():
    return make()


def test_two_thousand_pictures(images):
    assert images.check(2000, np.random.RandomState(1)) > 1900


def test_other_worlds_and_cameras():
    task = TaskSettings(num_cubes=5, cube_size=2.0, spacing=4.0, step_length=0.5, first_distance=8)
    camera = CameraSettings(width=33, height=21, horizontal_fov=90.0)
    assert make(task, camera).check(500, np.random.RandomState(1)) > 450


def test_colors_are_the_renderers(images):
    assert images.colors[FRONT].tolist() == [117, 18, 12]
    assert images.background.reshape(-1, 3).unique(dim=0).tolist() == [
        [123, 132, 118],
        [158, 188, 234],
    ]


def test_a_camera_too_narrow_for_the_sides_is_refused():
    with pytest.raises(InputError, match=r"5\.6 m ahead and up to 5 m .*larger camera\.horizontal"):
        make(camera=CameraSettings(horizontal_fov=30.0))


def test_a_picture_that_is_another_is_told(images, monkeypatch):
    """One pixel of one image, one step brighter."""
    render = images.render

    def a_little_off(cubes, places):
        images = render(cubes, places).clone()
        images[7, 3, 4, 1] += 1
        return images

    monkeypatch.setattr(images, "render", a_little_off)
    with pytest.raises(InputError, match="differs from the closed form, so nothing can be proved"):
        images.check(100, np.random.RandomState(0))


def test_one_cube_alone(images):
    one = CubeView(images, cube=1, steps=20)
    left = np.array([-1.0, 0.0, 30.0], np.float32)
    rendered = one.render(left)
    faces = one.read(rendered)
    assert (faces == images._camera.faces(3.6, left.astype(float))).all()
    assert faces[1, 12, 32] == FRONT and (faces[2] == NOTHING).all()


def test_colors_of_nothing_that_is_known_are_refused(images):
    with pytest.raises(InputError, match="none of the colors"):
        images.read(np.zeros((1, 25, 64, 3), np.uint8))


def test_cubes_that_are_touched_or_passed_are_not_drawn(images):
    cubes = np.array([[0.0, 5.0, -5.0]])
    before, after = (images.render(cubes, np.array([[steps, 0]])) for steps in (13, 14))
    assert (before != images.background).any(-1).sum() > 100
    hidden = torch.from_numpy(images.closed_form(cubes, np.array([[14, 0]]))[1])
    assert hidden.all()
    assert (after != images.background).any(-1).sum() < 50
