"""Scene files: what is read of them, where it stands, and what is refused."""

import math

import mujoco
import numpy as np
import pytest
from PIL import Image

from drone_rl.sim.scenes import Site, load_scene
from drone_rl.utils.errors import InputError

CUBE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


@pytest.fixture
def write(tmp_path):
    """Writes a scene of some text around its world, and returns its path."""

    def write(world, before="", name="scene.xml"):
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"<mujoco>\n{before}\n<worldbody>\n{world}\n</worldbody></mujoco>")
        return file

    return write


def placed(scene):
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    return data


def test_reads_includes_and_assets_of_folders(write, tmp_path):
    write('<geom name="inside" size="1" pos="0 0 3"/>', name="parts/part.xml")
    (tmp_path / "parts" / "cube.obj").write_text(CUBE)
    Image.new("RGB", (4, 2), (255, 0, 0)).save(tmp_path / "parts" / "red.jpg")
    heights = np.array([2, 2], np.int32).tobytes() + np.arange(4, dtype=np.float32).tobytes()
    (tmp_path / "parts" / "hills.bin").write_bytes(heights)
    before = """<include file="parts/part.xml"/><compiler meshdir="parts" texturedir="parts"/>
    <asset><mesh file="cube.obj"/><texture type="2d" name="red" file="red.jpg"/>
    <material name="red" texture="red"/><hfield name="hills" file="hills.bin" size="1 1 1 1"/>
    </asset>"""
    world = """<geom name="mesh" type="mesh" mesh="cube" pos="5 0 0" material="red"/>
    <geom name="hills" type="hfield" hfield="hills"/>"""
    scene = load_scene(write(world, before))
    model, data = scene.model, placed(scene)
    assert [model.geom(i).name for i in range(3)] == ["inside", "mesh", "hills"]
    corners = model.mesh_vert @ data.geom_xmat[1].reshape(3, 3).T + data.geom_xpos[1]
    np.testing.assert_allclose(corners.min(0), (5, 0, 0), atol=1e-6)
    assert model.ntex == 1 and model.hfield_nrow[0] == 2


def test_freezes_what_moves_where_the_first_key_frame_has_it(write):
    world = """<frame euler="0 0 90"><body name="door" pos="1 0 0">
    <joint name="hinge" axis="0 0 1"/><geom name="leaf" size=".1 .2 .3" type="box" pos="1 0 0"/>
    <geom name="glass" size=".1" contype="0" conaffinity="0"/></body></frame>
    <replicate count="2" offset="3 0 0"><geom name="post" size="1"/></replicate>"""
    scene = load_scene(
        write(world, f'<keyframe><key name="open" qpos="{math.pi / 2}"/></keyframe>')
    )
    places = {scene.model.geom(i).name: placed(scene).geom_xpos[i] for i in range(4)}
    np.testing.assert_allclose(places["leaf"], (-1, 1, 0), atol=1e-6)
    np.testing.assert_allclose(places["post1"], (3, 0, 0), atol=1e-6)
    solid = {scene.model.geom(i).name for i in range(4) if scene.solid[i]}
    assert solid == {"leaf", "post0", "post1"} and scene.model.nq == 0
    (warning,) = scene.warnings
    assert "hinge" in warning and "open" in warning


def test_reads_attached_models(write):
    write('<body name="leg"><geom name="foot" size="1"/></body>', name="table.xml")
    asset = '<asset><model name="table" file="table.xml"/></asset>'
    attached = '<attach model="table" body="leg" prefix="{0}_"/>'
    world = f'{attached.format("a")}<frame pos="2 0 0">{attached.format("b")}</frame>'
    scene = load_scene(write(world, asset))
    assert [scene.model.geom(i).name for i in range(2)] == ["a_foot", "b_foot"]
    np.testing.assert_allclose(scene.bounds[1], (3, 1, 1), atol=1e-6)


def test_marks_places(write):
    turned = '<site name="goal" type="box" size="1 2 3" pos="1 2 3" euler="0 0 90"/>'
    (point, region) = load_scene(write(f'<geom size="1"/><site name="start"/>{turned}')).sites
    assert (point.name, point.position, point.half_size) == ("start", (0, 0, 0), (0, 0, 0))
    assert region.half_size == (1, 2, 3) and region.heading == pytest.approx(90)


def test_bounds_are_those_of_turned_shapes(write):
    wedge = '<asset><mesh name="wedge" vertex="0 0 0 4 0 0 4 1 0 0 1 0 0 0 2 0 1 2"/></asset>'
    world = """<geom type="mesh" mesh="wedge"/>
    <geom type="cylinder" size="3 4" euler="0 30 45" pos="0 20 0"/>
    <body pos="-5 0 0" euler="0 0 45"><geom size="1"/></body>"""
    wedge_box, tilted, turned = load_scene(write(world, wedge)).boxes
    np.testing.assert_allclose(wedge_box, [(0, 0, 0), (4, 1, 2)], atol=1e-5)
    height = 4 * math.cos(math.pi / 6) + 3 * math.sin(math.pi / 6)
    np.testing.assert_allclose(tilted[:, 2], (-height, height), atol=1e-6)
    np.testing.assert_allclose(turned, [(-6, -1, -1), (-4, 1, 1)], atol=1e-6)


def test_reads_again_what_has_changed(write):
    first = load_scene(write('<geom size="1"/>', name="one.xml"))
    assert load_scene(write('<geom size="1"/>', name="one.xml")).sha256 == first.sha256
    second = load_scene(write('<geom size="2"/>', name="one.xml"))
    assert second.sha256 != first.sha256 and second.bounds[1][0] == pytest.approx(2)


def test_names_what_is_not_drawn(write):
    before = """<extension><plugin plugin="mujoco.sdf.bolt"/></extension><asset>
    <material name="mirror" reflectance="0.5"/></asset>"""
    world = """<geom size="1"/><geom name="bolt" type="sdf"/><flexcomp name="cloth" type="grid"
    count="1000000 1000000 1"/>"""
    text = "\n".join(load_scene(write(world, before)).warnings)
    assert all(word in text for word in ("mirror", "bolt", "cloth", "mujoco.sdf.bolt"))


def test_names_lights_that_are_not_drawn(write):
    """The headlight and seven others are the eight of OpenGL."""
    lamps = "".join(f'<light name="lamp{i}" pos="0 0 3"/>' for i in range(9))
    (line,) = load_scene(write('<geom size="1"/>' + lamps)).warnings
    assert "first 7 are not drawn: lamp7, lamp8" in line


@pytest.mark.parametrize(
    ("world", "words"),
    [
        ('<geom name="a" size="1"/>\n<geom name="a" size="1"/>', ("line 5", "line 4", "'a'")),
        ('<geom size="0.0005"/>', ("0.001 m", "scene_scale")),
        ('<geom size="1" pos="nan 0 0"/>', ("no number",)),
        ('<geom name="b" size="-1"/>', ("line 4 of scene.xml", "'b'", "positive")),
        ('<geom type="mesh" mesh="q"/>', ("line 4", "'q' not found")),
        ("<geom", ("no XML",)),
    ],
)
def test_refuses_mistakes_in_one_line(write, world, words):
    with pytest.raises(InputError) as error:
        load_scene(write(world))
    message = str(error.value)
    assert "\n" not in message and all(word in message for word in words), message


def test_corners_of_a_turned_region():
    """A turn of 90 degrees to the left takes (-2, -1) to (1, -2), around (1, 2)."""
    site = Site("start", (1.0, 2.0, 0.5), (2.0, 1.0, 0.1), 90.0)
    assert site.corners == pytest.approx(np.array([[2, 0], [2, 4], [0, 4], [0, 0]]))
