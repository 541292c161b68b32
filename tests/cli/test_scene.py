"""`drone-rl scene`: what it prints and renders of somebody's scene."""

from PIL import Image

HOUSE = """<mujoco><worldbody>
<geom name="floor" type="box" size="2 3 .1"/><geom name="roof" type="box" size="2 3 .1" pos="0 0 3"
rgba="0 0 1 1"/><body name="table"><geom name="top" type="box" size=".3 .3 .1" pos="1 1 1"/></body>
<geom size=".1" pos="1 1 .5" group="3"/>
{}</worldbody></mujoco>"""
SITES = '<site name="start" pos="-1 -1 1"/><site name="goal" pos="1 -2 1"/>'


def test_describes_and_renders_a_scene_and_says_what_reach_lacks(in_process, tmp_path):
    (tmp_path / "house.xml").write_text(HOUSE.format(SITES))
    (tmp_path / "empty.xml").write_text(HOUSE.format(""))
    done = in_process("scene", "house.xml")
    assert done.returncode == 0, done.stderr
    counts = "drawn    3 of 4 geoms", "solid    4 of 4 geoms"
    for words in ("4.00 x 6.00 x 3.20 m", "table, floor, roof", *counts, "reach    ready"):
        assert words in done.stdout, done.stdout
    (above,) = tmp_path.rglob("above.png")
    with Image.open(above) as image:
        red, _, blue = image.getpixel((image.width // 2, image.height // 2))
    assert abs(red - blue) < 30  # the gray floor, not the blue roof
    done = in_process("scene", "empty.xml")
    assert done.returncode == 0 and "reach    not yet" in done.stdout
    assert "goal" in done.stdout.partition("not yet")[2]


def test_says_which_lights_a_solid_shadows(in_process, tmp_path):
    lamp = '<light name="{}" pos="0 0 2" type="spot" {}/>'
    lights = lamp.format("lamp", "") + lamp.format("bulb", 'castshadow="false"')
    sun = '<light name="sun" pos="0 0 2" type="directional"/><geom size=".1" pos="0 0 2"/>'
    (tmp_path / "house.xml").write_text(HOUSE.format(lights + sun))
    lines = in_process("scene", "house.xml").stdout.splitlines()
    (warning,) = [line for line in lines if line.startswith("warning")]
    assert "light lamp is inside of" in warning and "castshadow" in warning


def test_refuses_what_is_no_scene(in_process):
    done = in_process("scene", "nowhere.xml")
    assert done.returncode == 2 and "nowhere.xml" in done.stderr
