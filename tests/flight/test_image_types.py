import hashlib
import math

import pytest
import torch

from drone_rl.config import CameraSettings
from drone_rl.flight.image_types import (
    ImageRequest,
    ImageType,
    images,
    palette,
    pixels,
)
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state


def image(
    worlds, state=None, camera="front_center", kind=ImageType.SCENE, *, as_float=False, **how
):
    """Return one image."""
    state = worlds.state if state is None else state
    return images(worlds, state, [ImageRequest(camera, kind, as_float)], **how)[0]


DEPTHS = torch.tensor([[[0.0, 2.0], [50.0, 250.0]]])
"""Depths of one environment; the first pixel has no hit."""


@pytest.fixture(scope="module")
def worlds():
    """Return an environment with a field of view of 90 degrees, 1 m above ground, and red cubes."""
    fov = CameraSettings(width=15, height=9, horizontal_fov=90.0)
    made = Worlds(1, camera=fov)
    made.reset(torch.arange(1), [world_random_state(0, 0)])
    made.state.body.position[:, 2] = 1.0
    yield made
    made.close()


def grays(found):
    assert (found[..., :1] == found).all()
    return found[..., 0].tolist()


@pytest.mark.parametrize("kind", [ImageType.DEPTH_PLANAR, ImageType.DEPTH_PERSPECTIVE])
def test_depth_is_in_meters_with_a_maximum_for_misses(kind):
    assert pixels(kind, DEPTHS, as_float=True).tolist() == [[[65504.0, 2.0], [50.0, 250.0]]]
    assert grays(pixels(kind, DEPTHS)) == [[[255, 2], [50, 250]]]
    beyond = torch.full((1, 1, 1), 1e6)
    assert pixels(kind, beyond, as_float=True).item() == 65504.0
    assert pixels(kind, beyond + 0.0)[0, 0, 0].tolist() == [255, 255, 255]


def test_depth_visualization_is_white_from_100_m():
    found = pixels(ImageType.DEPTH_VIS, DEPTHS, as_float=True)
    torch.testing.assert_close(found, torch.tensor([[[1.0, 0.02], [0.5, 1.0]]]))
    assert grays(pixels(ImageType.DEPTH_VIS, DEPTHS)) == [[[255, 5], [128, 255]]]


def test_disparity_is_normalized_by_the_width():
    """8 pixels * 0.25 m / 2 m = 1 pixel of 2; at 50 m 0.04 pixels; clipped below 1 m."""
    found = pixels(ImageType.DISPARITY_NORMALIZED, DEPTHS, as_float=True, focal=8.0)
    torch.testing.assert_close(found, torch.tensor([[[0.0, 0.5], [0.02, 0.004]]]))
    near = torch.tensor([[[0.5, 0.5]]])
    found = pixels(ImageType.DISPARITY_NORMALIZED, near, as_float=True, focal=8.0)
    assert found.tolist() == [[[1.0, 1.0]]]
    assert grays(pixels(ImageType.DISPARITY_NORMALIZED, DEPTHS, focal=8.0)) == [[[0, 128], [5, 1]]]


def test_segmentation_has_airsims_colors():
    geoms = torch.tensor([[[-1, 0], [1, 1]]], dtype=torch.int32)
    found = pixels(ImageType.SEGMENTATION, geoms, ids=torch.tensor([3, 255, 0]))
    white = [255, 255, 255]
    assert found.tolist() == [[[[0, 0, 0], [89, 121, 72]], [white, white]]]
    reds = pixels(ImageType.SEGMENTATION, geoms, ids=torch.tensor([3, 255, 0]), as_float=True)
    torch.testing.assert_close(reds, torch.tensor([[[0.0, 89 / 255], [1.0, 1.0]]]))
    own = pixels(ImageType.SEGMENTATION, geoms)
    assert own[0, 0, 1].tolist() == [0, 0, 0] and own[0, 1, 0].tolist() == [153, 108, 6]


def test_normals_are_encoded_around_gray():
    directions = torch.tensor([[[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [[-1.0, 0.0, 0.0]] * 2]])
    found = pixels(ImageType.SURFACE_NORMALS, directions)
    side = [0, 128, 128]
    assert found.tolist() == [[[[0, 0, 0], [128, 128, 255]], [side, side]]]
    reds = pixels(ImageType.SURFACE_NORMALS, directions, as_float=True)
    torch.testing.assert_close(reds, torch.tensor([[[0.0, 128 / 255], [0.0, 0.0]]]))


def test_scene_images_equal_the_renderers(worlds):
    found = image(worlds)
    assert torch.equal(found, worlds.render(worlds.state)[0])
    assert (tuple(found.shape), found.dtype) == ((9, 15, 3), torch.uint8)
    reds = image(worlds, as_float=True)
    torch.testing.assert_close(reds, found[..., 0].float() / 255)


def test_ground_viewed_from_above(worlds):
    """The bottom camera is 0.9 m above ground; rays at 4 of 7.5 pixels are longer."""
    requests = [ImageRequest("bottom_center", kind, as_float=True) for kind in range(1, 5)]
    planar, rays, visual, disparity = images(worlds, worlds.state, requests)
    middle = (4, 7)
    torch.testing.assert_close(planar, torch.full((9, 15), 0.9), rtol=1e-4, atol=0.0)
    assert rays[middle].item() == pytest.approx(0.9, rel=1e-4)
    aside = math.hypot(1.0, 4 / 7.5)
    assert rays[0, 7].item() == pytest.approx(0.9 * aside, rel=1e-4)
    assert visual[middle].item() == pytest.approx(0.009, rel=1e-4)
    assert disparity[middle].item() == pytest.approx(7.5 * 0.25 / 0.9 / 15, rel=1e-4)
    normals = image(worlds, None, "3", ImageType.SURFACE_NORMALS)
    assert normals[middle].tolist() == [128, 128, 255]
    segments = image(worlds, None, "3", ImageType.SEGMENTATION)
    assert torch.equal(segments[middle], palette()[148])


def test_disparity_is_the_offset_between_two_cameras(worlds):
    """The right camera is 0.25 m from the center camera; the face of the cube is flat."""
    state = worlds.state[torch.tensor([0])]  # a copy
    cube = worlds.task.places(state)[0, 0]
    state.body.position[0] = cube - torch.tensor([5.0, 0.0, 0.0])
    size = {"height": 90, "width": 150}
    share = image(worlds, state, "0", ImageType.DISPARITY_NORMALIZED, as_float=True, **size)
    views = [worlds.view(name, "segmentation", **size) for name in ("front_center", "front_right")]
    geom = worlds.scene.props.index(0)
    seen, aside = (worlds.render(state, view) == geom for view in views)
    middle, other = (frame[0, 45].nonzero().float().mean() for frame in (seen, aside))
    face = 5.0 - 0.4 - 1.25
    assert share[45, 75].item() == pytest.approx(75 * 0.25 / face / 150, rel=1e-4)
    assert (middle - other).item() == pytest.approx(150 * share[45, 75].item(), abs=1.0)


def test_invalid_requests_raise(worlds):
    with pytest.raises(InputError, match=r"image_type=8 is unknown; give one of: 0 \(scene\), 1"):
        ImageRequest("0", 8)
    with pytest.raises(InputError, match=r"camera '5' is unknown; choose from: front_center \(0\)"):
        image(worlds, camera="5")
    with pytest.raises(InputError, match="shows nothing"):
        images(worlds, worlds.state, [])


FIRST = [[0, 0, 0], [153, 108, 6], [112, 105, 191], [89, 121, 72], [190, 225, 64], [206, 190, 59]]


def test_palette_is_airsims():
    colors = palette()
    assert (tuple(colors.shape), colors.dtype) == ((256, 3), torch.uint8)
    assert colors[:6].tolist() == FIRST
    assert colors[255].tolist() == [255, 255, 255]
    digest = hashlib.sha256(bytes(colors.flatten().tolist())).hexdigest()
    assert digest == "b7217dcebb91d590f6174c4ee7395e3fab3e7edde839d004789fd146a1f5de5e"
