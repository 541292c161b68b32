"""The closed form of a cube's image: by hand, and equal to the renderer's images."""

import dataclasses

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cube_images import (
    FRONT,
    NOTHING,
    UNIT,
    CameraModel,
    CubeImages,
    CubeView,
)
from drone_rl.verification.prover.lattice import Lattice


@pytest.fixture
def tiny():
    """Two columns with slopes 1 and -1, three rows with slopes 0.5, 0 and -0.5; cubes of 2 m."""
    return CameraModel(
        left=np.array([1.0, -1.0]),
        up=np.array([0.5, 0.0, -0.5]),
        half=1.0,
        farthest=40.0,
        widest=20.0,
        bound=6.0,
    )


@pytest.mark.parametrize("ahead", [0.6, 1.6, 2.6, 5.6, 14.6, 32.6])
def test_images_change_only_at_borders(ahead):
    camera = CameraModel.of(TaskSettings(), CameraSettings())
    places, _ = camera.borders(ahead)
    places = np.unique(places.round(12))
    low, high = places[:-1] + 1e-9, places[1:] - 1e-9
    wide = low < high
    assert (camera.faces(ahead, low[wide]) == camera.faces(ahead, high[wide])).all()
    beside = camera.faces(ahead, places - 1e-7), camera.faces(ahead, places + 1e-7)
    changes = (beside[0] != beside[1]).any((1, 2))
    assert changes.mean() > 0.9  # and there it does, but where rows graze each other


def test_rounding_bounds_float32_positions():
    camera, random = CameraModel.of(TaskSettings(), CameraSettings()), np.random.RandomState(0)
    cubes = random.uniform(-camera.bound, camera.bound, 200_000)
    drone = random.randint(-int(camera.widest), int(camera.widest) + 1, len(cubes)).astype(float)
    seen = (cubes.astype(np.float32) - drone.astype(np.float32)).astype(float)
    errors = np.abs(seen - (cubes - drone)) / camera.rounding(cubes - drone)
    assert 0.5 < errors.max() < 1  # and not for much more


def test_errors_of_borders(tiny):
    """Ways of 2, 4 and 6 m: 16 (way + 1) + 3 * 40 + 3 * 20 units of 2^-24."""
    places, errors = tiny.borders(4.0)
    assert places.tolist() == [-6, -4, -2, 2, 4, 6]
    assert (errors / UNIT).tolist() == [292, 260, 228, 228, 260, 292]
    steep = dataclasses.replace(tiny, left=np.array([2.0, -2.0]))
    _, errors = steep.borders(4.0)  # ways of 5, 7 and 11 m
    assert (errors[3:] / UNIT).tolist() == [16 * 6 + 300, 16 * 8 + 300, 16 * 12 + 300]


def make_images(task=None, camera=None):
    task, camera = task or TaskSettings(), camera or CameraSettings()
    return CubeImages(Worlds(64, task, camera), Lattice(task), CameraModel.of(task, camera))


@pytest.fixture(scope="module")
def images():
    return make_images()


def test_closed_form_equals_renderer(images):
    assert images.check(2000, np.random.RandomState(1)) > 1900


def test_closed_form_of_another_task_and_camera():
    task = TaskSettings(num_cubes=5, cube_size=2.0, spacing=4.0, step_length=0.5, first_distance=8)
    camera = CameraSettings(width=33, height=21, horizontal_fov=90.0)
    assert make_images(task, camera).check(500, np.random.RandomState(1)) > 450


def test_a_camera_too_narrow_for_the_sides_is_refused():
    with pytest.raises(InputError, match=r"5\.6 m ahead and up to 5 m .*larger camera\.horizontal"):
        make_images(camera=CameraSettings(horizontal_fov=30.0))


def test_a_different_image_is_refused(images, monkeypatch):
    """One pixel of one image, one step brighter."""
    render = images.render

    def a_little_off(cubes, places):
        images = render(cubes, places).clone()
        images[7, 3, 4, 1] += 1
        return images

    monkeypatch.setattr(images, "render", a_little_off)
    with pytest.raises(InputError, match="differs from the closed form, so nothing can be proved"):
        images.check(100, np.random.RandomState(0))


def test_cube_view(images):
    one = CubeView(images, cube=1, steps=20)
    left = np.array([-1.0, 0.0, 30.0], np.float32)
    rendered = one.render(left)
    faces = one.read(rendered)
    assert (faces == images.camera.faces(3.6, left.astype(float))).all()
    assert faces[1, 12, 32] == FRONT and (faces[2] == NOTHING).all()


def test_unknown_colors_are_refused(images):
    with pytest.raises(InputError, match="none of the colors"):
        images.read(np.zeros((1, 25, 64, 3), np.uint8))


def test_touched_and_passed_cubes_are_hidden(images):
    cubes = np.array([[0.0, 5.0, -5.0]])
    before, after = (images.render(cubes, np.array([[steps, 0]])) for steps in (13, 14))
    assert (before != images.background).any(-1).sum() > 100
    hidden = torch.from_numpy(images.closed_form(cubes, np.array([[14, 0]]))[1])
    assert hidden.all()
    assert (after != images.background).any(-1).sum() < 50
