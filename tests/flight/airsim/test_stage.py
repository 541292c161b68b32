"""Objects by name, the cubes' rule, spawned objects, ids, weather."""

import math

import pytest
import torch

from drone_rl.flight.airsim.stage import SPARE, Stage
from drone_rl.flight.image_types import ImageType, palette
from drone_rl.utils.errors import InputError
from tests.flight.airsim.looking import look


def test_cubes_vanish_when_touched_and_are_placed_again(cubes):
    cubes.reset()
    assert cubes.names == ["Ground", "cube_0", "cube_1", "cube_2", "SkySphere"]
    before = cubes.object_pose("cube_0").position
    assert before[0] == 15.0 and abs(before[1]) <= 6.0 and before[2] == -2.5
    cubes.touch(torch.tensor([15.0, -before[1] + 1.0, 2.5], dtype=torch.float64))
    assert all(map(math.isnan, cubes.object_pose("cube_0").position))
    assert not math.isnan(cubes.object_pose("cube_1").position[0])
    cubes.reset()
    assert cubes.object_pose("cube_0").position[1] != before[1]


def test_objects_are_moved_by_name(cubes):
    cubes.reset()
    assert cubes.move_object("cube_1", (20.0, -3.0, math.nan))
    assert cubes.object_pose("cube_1").position == (20.0, 3.0, -2.5)
    assert not cubes.move_object("tree", (0.0, 0.0, 0.0))
    assert not cubes.move_object("Ground", (0.0, 0.0, 0.0))
    assert not cubes.move_object("SkySphere", (0.0, 0.0, 0.0))
    assert cubes.find("CUBE_[01]") == ["cube_0", "cube_1"]
    assert cubes.find(".*cube.*|.*ground.*") == ["Ground", "cube_0", "cube_1", "cube_2"]
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


def test_segmentation_ids_are_colors(cubes):
    cubes.reset()
    assert cubes.set_id("cube_.*", 7, is_pattern=True)
    assert cubes.get_id("cube_2") == 7
    assert cubes.get_id("tree") == -1
    assert not cubes.set_id("tree", 1, is_pattern=False)
    x, y, _ = cubes.object_pose("cube_0").position
    image = look(cubes, kind=ImageType.SEGMENTATION, position=(x - 5.0, -y, 2.5))
    assert image[9, 16].tolist() == palette()[7].tolist()
    assert cubes.set_id("skysphere", 42, is_pattern=True) and cubes.get_id("SkySphere") == 42
    assert look(cubes, kind=ImageType.SEGMENTATION)[0, 16].tolist() == palette()[42].tolist()
    cubes.clear_ids()
    assert look(cubes, kind=ImageType.SEGMENTATION)[17, 16].tolist() == palette()[0].tolist()


def test_ids_are_those_of_their_objects_only():
    stage = Stage("cubes", 0)
    assert [stage.get_id(name) for name in ("geom", "hull", "")] == [-1, -1, -1]
    others = {name: stage.get_id(name) for name in ("Ground", "cube_1", "cube_2")}
    assert stage.set_id("cube_0", 0, is_pattern=False) and stage.get_id("cube_0") == 0
    assert {name: stage.get_id(name) for name in others} == others
    stage.spawn("crate", "cube", (5.0, 0.0, 1.0), 1.0)
    usual = stage.get_id("crate")
    assert stage.set_id("crate", 42, is_pattern=False) and stage.get_id("crate") == 42 != usual
    assert stage.destroy("crate") and not stage.destroy("crate")
    stage.spawn("other", "cube", (5.0, 0.0, 1.0), 1.0)
    assert stage.get_id("other") == usual
    stage.clear_ids()
    assert [stage.get_id(name) for name in ("cube_1", "Ground", "other")] == [0, 0, 0]
    stage.close()


def test_fog_and_night_darken_or_hide(cubes):
    cubes.reset()
    clear = look(cubes)
    cubes.enable_weather(True)
    cubes.set_fog(1.0)
    assert not torch.equal(look(cubes), clear)
    cubes.set_fog(0.0)
    cubes.set_sun(-20.0)
    assert look(cubes).float().mean() < clear.float().mean()
    cubes.clear_sun()
    assert torch.equal(look(cubes), clear)
