"""Scenes by name, and MJCF files."""

import pytest

from drone_rl.flight.airsim.stage import Stage
from drone_rl.sim.image_types import ImageType
from drone_rl.utils.errors import InputError
from tests.flight.airsim.looking import look


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
    assert house.object_pose("wall").position == pytest.approx((11.4, 0.0, -4.0))
    assert house.object_pose("wall").attitude == pytest.approx((1.0, 0.0, 0.0, 0.0))
    assert not house.move_object("wall", (0.0, 0.0, 0.0))
    assert float(look(house, kind=ImageType.DEPTH_PLANAR)[9, 16]) == pytest.approx(10.0, abs=0.05)
    house.close()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco><", "can't be read"),
        ("", "can't be read"),
        (
            '<mujoco><worldbody><geom type="mesh" mesh="tree"/></worldbody></mujoco>',
            r"^scene=.*bad\.xml can't be compiled .*Error: mesh 'scene/tree' not found in geom 0\)",
        ),
        (
            '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>',
            r"free joint can only be used on top level\); correct it$",
        ),
    ],
)
def test_crafted_files_are_refused(tmp_path, text, message):
    (tmp_path / "bad.xml").write_text(text)
    with pytest.raises(InputError, match=message):
        Stage(str(tmp_path / "bad.xml"), 0)
    with pytest.raises(InputError, match=r"scene=no\.xml does not exist; give the path of an MJCF"):
        Stage("no.xml", 0)
    with pytest.raises(InputError, match=r"scene=blokcs is unknown; give cubes.*blocks"):
        Stage("blokcs", 0)
