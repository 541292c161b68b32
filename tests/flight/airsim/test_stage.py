"""Scenes: objects by name, the cubes' rule, spawned objects, ids, cameras."""

import math

import numpy as np
import pytest
import torch

from drone_rl.flight.airsim.settings_file import CameraChoice, Capture, Offset
from drone_rl.flight.airsim.stage import SPARE, Stage, id_color, png
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.image_types import ImageType
from drone_rl.utils.errors import InputError

SMALL = {kind: Capture(32, 18, 90.0) for kind in ImageType}


@pytest.fixture(scope="module")
def cubes():
    stage = Stage("cubes", 0)
    yield stage
    stage.close()


@pytest.fixture(scope="module")
def empty():
    stage = Stage("empty", 0)
    yield stage
    stage.close()


def body_at(*position):
    return BodyState.at_rest(torch.tensor([position], dtype=torch.float64))


def look(stage, camera="front_center", kind=ImageType.SCENE, position=(0.0, 0.0, 2.5), **choice):
    cameras = stage.make_cameras(SMALL, {camera: CameraChoice(**choice)} if choice else {})
    (found,) = stage.render(body_at(*position), camera, cameras[camera], [kind])
    return stage.image(kind, found, as_float=kind not in (ImageType.SCENE, ImageType.SEGMENTATION))


def test_cubes_vanish_when_touched_and_are_placed_again(cubes):
    cubes.reset()
    assert cubes.names == ["Ground", "cube_0", "cube_1", "cube_2"]
    before = cubes.object_pose("cube_0").position
    assert before[0] == 15.0 and abs(before[1]) <= 6.0 and before[2] == -2.5
    cubes.touch(torch.tensor([15.0, -before[1] + 1.0, 2.5], dtype=torch.float64))
    assert all(map(math.isnan, cubes.object_pose("cube_0").position))
    assert not math.isnan(cubes.object_pose("cube_1").position[0])
    cubes.reset()
    assert cubes.object_pose("cube_0").position[1] != before[1]


def test_a_miss_leaves_the_cube(cubes):
    cubes.reset()
    _, y, _ = cubes.object_pose("cube_0").position
    distance = cubes.task.settings.touch_distance
    cubes.touch(torch.tensor([15.0 - distance - 0.01, -y, 2.5], dtype=torch.float64))
    assert not math.isnan(cubes.object_pose("cube_0").position[0])


def test_objects_are_moved_by_name(cubes):
    cubes.reset()
    assert cubes.move_object("cube_1", (20.0, -3.0, math.nan))
    assert cubes.object_pose("cube_1").position == (20.0, 3.0, -2.5)
    assert not cubes.move_object("tree", (0.0, 0.0, 0.0))
    assert not cubes.move_object("Ground", (0.0, 0.0, 0.0))
    assert cubes.find("CUBE_[01]") == ["cube_0", "cube_1"]
    with pytest.raises(InputError, match="no regular expression"):
        cubes.find("(")


def test_spawned_objects_are_seen_and_destroyed(empty):
    def depth():
        return float(look(empty, kind=ImageType.DEPTH_PLANAR)[9, 16])

    far = depth()
    name = empty.spawn("box", "Cube", (10.4, 0.0, 2.5), 2.0)
    assert depth() == pytest.approx(10.4 - 1.0 - 0.4, abs=0.01)  # the camera is 0.4 m ahead
    assert empty.spawn("box", "Cube", (50.0, 0.0, 2.5), 1.0) == "box_1"
    assert empty.move_object(name, (20.4, math.nan, math.nan))
    assert depth() == pytest.approx(19.0, abs=0.01)
    assert empty.destroy(name) and empty.destroy("box_1") and not empty.destroy(name)
    assert depth() == pytest.approx(far)
    names = [empty.spawn("s", "Sphere", (9.0, 0.0, 2.0), 1.0) for _ in range(SPARE // 3)]
    with pytest.raises(InputError, match="no Sphere is left of 4"):
        empty.spawn("s", "Sphere", (9.0, 0.0, 2.0), 1.0)
    with pytest.raises(InputError, match="asset 'House' is unknown; give cube"):
        empty.spawn("h", "House", (9.0, 0.0, 2.0), 1.0)
    assert all(map(empty.destroy, names))


def test_segmentation_ids_are_colours(cubes):
    cubes.reset()
    assert cubes.set_id("cube_.*", 7, is_pattern=True)
    assert cubes.get_id("cube_2") == 7
    assert cubes.get_id("tree") == -1
    assert not cubes.set_id("tree", 1, is_pattern=False)
    x, y, _ = cubes.object_pose("cube_0").position
    image = look(cubes, kind=ImageType.SEGMENTATION, position=(x - 5.0, -y, 2.5))
    assert image[9, 16].tolist() == id_color(7)
    cubes.clear_ids()
    assert look(cubes, kind=ImageType.SEGMENTATION)[17, 16].tolist() == id_color(0)


def test_cameras_look_where_their_poses_say(empty):
    """The ground below a camera at 2.5 m is 2.5 m away for one that looks straight down."""
    down = look(empty, "bottom_center", ImageType.DEPTH_PLANAR, position=(0.0, 0.0, 3.0))
    assert float(down[9, 16]) == pytest.approx(3.0 - 0.1, abs=0.01)
    same = look(
        empty,
        "front_center",
        ImageType.DEPTH_PLANAR,
        position=(0.0, 0.0, 3.0),
        offset=Offset(0.0, 0.0, 0.1, pitch=-90.0),
    )
    torch.testing.assert_close(same, down, rtol=1e-4, atol=1e-4)


def test_a_wider_camera_sees_the_same_pixel_closer_to_the_middle(cubes):
    cubes.reset()
    cubes.clear_weather()
    wide = {"captures": {ImageType.DEPTH_PLANAR: Capture(32, 18, 120.0)}}
    narrow = look(cubes, kind=ImageType.DEPTH_PLANAR)
    broad = look(cubes, kind=ImageType.DEPTH_PLANAR, **wide)
    # the lowest row looks down steeper with the wider view, so the ground there is nearer
    assert float(broad[-1, 16]) < float(narrow[-1, 16])
    half = math.tan(math.radians(45.0)) * 9 / 16 * (17.5 - 8.5) / 9
    assert float(narrow[-1, 16]) == pytest.approx(2.5 / half, rel=0.06)


def test_fog_and_night_darken_or_hide(cubes):
    cubes.reset()
    cubes.clear_weather()
    clear = look(cubes)
    cubes.set_fog(1.0)
    assert not torch.equal(look(cubes), clear)
    cubes.clear_weather()
    cubes.set_sun(-20.0)
    assert look(cubes).float().mean() < clear.float().mean()
    cubes.clear_weather()
    assert torch.equal(look(cubes), clear)


def test_blocks_can_be_touched_and_a_file_is_shown(tmp_path):
    blocks = Stage("blocks", 0)
    assert len(blocks.names) == 35
    assert tuple(blocks.task.obstacles(blocks.worlds.state).half_sizes) == (2.0, 2.0, 2.0)
    blocks.close()
    path = tmp_path / "house.xml"
    path.write_text(
        '<mujoco model="house"><worldbody><body name="hall"><geom name="wall" type="box" '
        'size="1 4 4" pos="11.4 0 4" rgba="1 0 0 1"/></body></worldbody></mujoco>'
    )
    house = Stage(str(path), 0)
    assert "wall" in house.names
    assert float(look(house, kind=ImageType.DEPTH_PLANAR)[9, 16]) == pytest.approx(10.0, abs=0.05)
    house.close()


@pytest.mark.parametrize(
    ("text", "message"), [("<mujoco><", "can't be read"), ("", "can't be read")]
)
def test_crafted_files_are_refused(tmp_path, text, message):
    (tmp_path / "bad.xml").write_text(text)
    with pytest.raises(InputError, match=message):
        Stage(str(tmp_path / "bad.xml"), 0)
    with pytest.raises(InputError, match=r"scene=blokcs is unknown; give cubes.*blocks"):
        Stage("blokcs", 0)


def test_png_has_four_channels():
    from io import BytesIO

    from PIL import Image

    image = torch.arange(24, dtype=torch.uint8).reshape(2, 4, 3)
    decoded = np.asarray(Image.open(BytesIO(png(image))))
    assert decoded.shape == (2, 4, 4)
    assert (decoded[..., 3] == 255).all()
    assert np.array_equal(decoded[..., :3], image.numpy())
