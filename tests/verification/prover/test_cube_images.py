"""The closed form of a cube's image, by hand for a tiny camera and against the renderer."""

import dataclasses

import numpy as np
import pytest

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.verification.prover.cube_images import (
    FRONT,
    LEFT_SIDE,
    NOTHING,
    RIGHT_SIDE,
    UNIT,
    CameraModel,
    _packed,
)


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


def test_each_color_is_a_number_of_its_own():
    colors = np.array([[1, 2, 3], [3, 2, 1], [0, 0, 255], [255, 0, 0]], np.uint8)
    assert _packed(colors).tolist() == [0x030201, 0x010203, 0xFF0000, 0x0000FF]


def test_slopes_of_the_default_camera():
    camera = CameraModel.of(TaskSettings(), CameraSettings())
    wide = np.tan(np.radians(67.5))
    assert camera.left[0] == pytest.approx(63 / 64 * wide)
    assert camera.left[-1] == -camera.left[0]
    assert camera.up[12] == 0.0
    assert camera.up[0] == pytest.approx(24 / 25 * wide * 25 / 64)


def test_faces_by_hand(tiny):
    """4 m ahead the front is 3 m away: a ray of slope 1 is 3 m out there, and 5 m at the back."""
    left = np.array([1.9, 2.1, 3.9, 4.1, 5.9, 6.1])
    middle = tiny.faces(4.0, left)[:, 1, 0]
    assert middle.tolist() == [NOTHING, FRONT, FRONT, LEFT_SIDE, LEFT_SIDE, NOTHING]
    mirrored = tiny.faces(4.0, -left)[:, 1, 1]
    assert mirrored.tolist() == [NOTHING, FRONT, FRONT, RIGHT_SIDE, RIGHT_SIDE, NOTHING]
    assert not tiny.faces(4.0, left)[:, [0, 2]].any()  # these rays are 1 m up 2 m ahead


def test_rows_that_leave_through_the_top(tiny):
    """2.5 m ahead the front is 1.5 m away; rays of slope 0.5 leave the cube 2 m away."""
    left = np.array([2.4, 2.6, 2.9, 3.1, 4.4, 4.6])
    assert tiny.faces(2.5, left)[:, 1, 0].tolist() == [1, 2, 2, 2, 2, 0]
    assert tiny.faces(2.5, left)[:, 0, 0].tolist() == [1, 2, 2, 0, 0, 0]


def test_beside_the_camera_only_sides_are_seen(tiny):
    assert FRONT not in tiny.faces(0.5, np.linspace(-5, 5, 101))
    assert tiny.faces(0.5, np.array([1.1]))[0, 1].tolist() == [LEFT_SIDE, NOTHING]


def test_cubes_at_distances_of_their_own(tiny):
    """Fronts are 3, 3, 1.5 and no metres away: as by hand above, all at once."""
    ahead, left = np.array([4.0, 4.0, 2.5, 0.5]), np.array([2.1, 4.1, -2.6, 1.1])
    shown = tiny.faces(ahead, left)
    assert shown[:, 1].tolist() == [[FRONT, 0], [LEFT_SIDE, 0], [0, RIGHT_SIDE], [LEFT_SIDE, 0]]
    alone = [tiny.faces(float(a), y[None])[0] for a, y in zip(ahead, left, strict=True)]
    np.testing.assert_array_equal(shown, alone)


def test_borders_are_where_faces_change(tiny):
    """Of 4 m: 2, 4 and 6 to either side, for only the middle row shows anything."""
    places, errors = tiny.borders(4.0)
    assert np.unique(places).tolist() == [-6.0, -4.0, -2.0, 2.0, 4.0, 6.0]
    assert (errors > 0).all() and errors.max() < 1e-4
    assert not len(tiny.borders(-2.0)[0])


@pytest.mark.parametrize("ahead", [0.6, 1.6, 2.6, 5.6, 14.6, 32.6])
def test_between_borders_nothing_changes(ahead):
    camera = CameraModel.of(TaskSettings(), CameraSettings())
    places, _ = camera.borders(ahead)
    places = np.unique(places.round(12))
    low, high = places[:-1] + 1e-9, places[1:] - 1e-9
    wide = low < high
    assert (camera.faces(ahead, low[wide]) == camera.faces(ahead, high[wide])).all()
    beside = camera.faces(ahead, places - 1e-7), camera.faces(ahead, places + 1e-7)
    changes = (beside[0] != beside[1]).any((1, 2))
    assert changes.mean() > 0.9  # and there it does, but where rows graze each other


def test_grazing_rows_are_told(tiny):
    assert tiny.grazed(3.0).tolist() == [True, False, True]  # 2 m away, where they are 1 m up
    assert not tiny.grazed(3.1).any()


def test_float32_moves_a_cube_by_no_more_than_is_allowed_for():
    camera, random = CameraModel.of(TaskSettings(), CameraSettings()), np.random.RandomState(0)
    cubes = random.uniform(-camera.bound, camera.bound, 200_000)
    drone = random.randint(-int(camera.widest), int(camera.widest) + 1, len(cubes)).astype(float)
    seen = (cubes.astype(np.float32) - drone.astype(np.float32)).astype(float)
    errors = np.abs(seen - (cubes - drone)) / camera.rounding(cubes - drone)
    assert 0.5 < errors.max() < 1  # and not for much more


def test_how_far_float32_may_move_each_border(tiny):
    """Ways of 2, 4 and 6 m: 16 (way + 1) + 3 * 40 + 3 * 20 units of 2^-24."""
    places, errors = tiny.borders(4.0)
    assert places.tolist() == [-6, -4, -2, 2, 4, 6]
    assert (errors / UNIT).tolist() == [292, 260, 228, 228, 260, 292]
    steep = dataclasses.replace(tiny, left=np.array([2.0, -2.0]))
    _, errors = steep.borders(4.0)  # ways of 5, 7 and 11 m
    assert (errors[3:] / UNIT).tolist() == [16 * 6 + 300, 16 * 8 + 300, 16 * 12 + 300]
