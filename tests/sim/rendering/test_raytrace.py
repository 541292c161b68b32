"""Held against MuJoCo Warp's ray tracer, on scenes of every kind of solid, from everywhere."""

import mujoco
import numpy as np
import pytest
import torch

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import Appearance, Poses, Raytracer, Scene, View
from drone_rl.sim.rendering.warp import WarpRenderer
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state

XML = """<mujoco>
<statistic extent="1"/>
<visual><headlight active="0"/><map znear="0.05" zfar="60"/></visual>
<worldbody>
<light directional="true" dir="0.3 -0.4 -0.8" ambient=".3 .3 .3" diffuse=".6 .5 .4"
  castshadow="false"/>
<light directional="true" dir="-0.5 0.1 -0.1" ambient="0 .1 0" diffuse=".1 .1 .3"
  castshadow="false"/>
<geom name="ground" type="plane" size="0 0 1" rgba=".4 .5 .4 1"/>
<geom name="table" type="plane" pos="9 3 1" euler="10 0 20" size="2 3 1" rgba=".7 .2 .4 1"/>
<geom name="pole" type="cylinder" pos="6 -3 1" euler="0 20 0" size=".4 2" rgba=".9 .9 .1 1"/>
<body name="drone" pos="0 0 2"><freejoint/>
<geom name="hull" type="box" size=".3 .2 .1"/>
<camera name="front" pos=".4 0 0" xyaxes="0 -1 0 0 0 1" fovy="60"/>
</body>
<body mocap="true"><geom name="a" type="sphere" size=".8" rgba=".9 .1 .1 1"/></body>
<body mocap="true"><geom name="b" type="capsule" size=".4 .7" euler="30 40 0"
  rgba=".1 .9 .1 1"/></body>
<body mocap="true"><geom name="c" type="ellipsoid" size=".4 .9 1.2" euler="0 0 30"
  rgba=".1 .1 .9 1"/></body>
<body mocap="true"><geom name="d" type="box" size=".5 .8 .6" euler="20 10 30"
  rgba=".5 .1 .9 1"/></body>
<body mocap="true"><geom name="e" type="cylinder" size=".6 .5" pos=".3 .2 0" euler="70 10 0"
  rgba=".5 .9 .9 1"/></body>
</worldbody></mujoco>"""
MEANINGS = (Meaning.GROUND, Meaning.GROUND, Meaning.OBSTACLE, Meaning.DRONE, *[Meaning.TARGET] * 5)
PROPS = (-1, -1, -1, -1, 0, 1, 2, 3, 4)


def scene(xml=XML, meanings=MEANINGS, props=PROPS):
    return Scene(mujoco.MjModel.from_xml_string(xml), meanings, props, (0.6, 0.7, 0.9))


def view(modality="rgb", height=30, width=40):
    return View(camera="front", height=height, width=width, modality=modality)


def scattered(count, tilt):
    random = np.random.RandomState(7)
    low, high = [-2.0, -4.0, 0.7], [12.0, 4.0, 4.0]
    attitude = np.concatenate([np.ones((count, 1)), random.uniform(-tilt, tilt, (count, 3))], 1)
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    props = random.uniform(low, high, (count, 5, 3))
    position = random.uniform([-3.0, -2.0, 0.5], [3.0, 2.0, 3.0], (count, 3))
    return Poses(*map(torch.tensor, (position, attitude, props)))


@pytest.fixture(scope="module")
def both():
    made = [kind(scene(), num_worlds=64, num_shards=2) for kind in (Raytracer, WarpRenderer)]
    yield made
    for renderer in made:
        renderer.close()


@pytest.mark.parametrize("tilt", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("modality", ["rgb", "depth", "segmentation"])
def test_pictures_are_those_of_mujoco_warp(both, modality, tilt):
    """But for single pixels on edges of round things, whose equations are solved otherwise."""
    ours, theirs = (r.render(view(modality), scattered(64, tilt)) for r in both)
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
    assert len(theirs.flatten().unique()) > 5  # there is something to see
    difference = (ours.double() - theirs.double()).abs()
    tolerance = {"rgb": 1, "depth": 1e-3, "segmentation": 0}[modality]
    scale = theirs.double().clamp(min=1) if modality == "depth" else 1.0
    assert (difference > tolerance * scale).double().mean() < 1e-4


@pytest.mark.parametrize("camera", ["front_center", "chase"])
@pytest.mark.parametrize("modality", ["rgb", "segmentation"])
def test_in_our_own_worlds_not_a_byte_differs(camera, modality):
    """So that every policy trained with one sees the same with the other."""
    several = [Worlds(200, renderer=kind) for kind in (Raytracer, WarpRenderer)]
    states = [world_random_state(3, i) for i in range(200)]
    several[0].reset(torch.arange(200), states)
    state = several[0].state
    state.body.position[:, 0] = torch.linspace(0.0, 60.0, 200)
    view = several[0].view(camera, modality, height=25, width=64, show_drone=camera == "chase")
    ours, theirs = (worlds.render(state, view) for worlds in several)
    assert torch.equal(ours, theirs)
    for worlds in several:
        worlds.close()


def test_every_kind_of_geom_is_seen(both):
    seen = both[0].render(view("segmentation"), scattered(64, 0.2)).unique().tolist()
    assert seen == [-1, 0, 1, 2, 4, 5, 6, 7, 8]  # all but the drone's own hull


def test_colours_and_lights_of_each_world_are_those_of_mujoco_warp(both):
    draw = torch.Generator().manual_seed(0)
    appearance = Appearance(
        colors={m: torch.rand(64, 3, generator=draw) for m in set(MEANINGS) | {Meaning.SKY}},
        ambient=torch.rand(64, 3, generator=draw) / 2,
        sun=torch.rand(64, 3, generator=draw),
        sun_direction=torch.rand(64, 3, generator=draw) - torch.tensor([0.5, 0.5, 1.5]),
    )
    ours, theirs = (r.render(view(), scattered(64, 0.2), appearance) for r in both)
    assert ((ours.int() - theirs.int()).abs() > 1).double().mean() < 1e-4
    plain = both[0].render(view(), scattered(64, 0.2))
    assert (plain != ours).double().mean() > 0.9


def test_from_inside_a_solid_it_is_not_there(both):
    """As in MuJoCo's pictures, where only outsides are drawn."""
    poses = scattered(5, 0.0)
    eyes = poses.position + torch.tensor([0.4, 0.0, 0.0])
    for world, prop in enumerate(range(5)):
        poses.props[world, prop] = eyes[world] - torch.tensor([0.1, 0.1, 0.1])
    seen = both[0].render(view("segmentation"), poses)
    assert torch.equal(seen, both[1].render(view("segmentation"), poses))
    assert all(world + 4 not in seen[world].unique().tolist() for world in range(5))


def test_a_ball_ahead_has_the_size_and_distance_that_geometry_gives_it():
    xml = """<mujoco><statistic extent="1"/><visual><headlight active="0"/></visual><worldbody>
    <light directional="true" castshadow="false"/><body name="drone"><freejoint/>
    <geom type="box" size=".1 .1 .1"/>
    <camera name="front" xyaxes="0 -1 0 0 0 1" fovy="90"/></body>
    <body mocap="true"><geom type="sphere" size="1"/></body></worldbody></mujoco>"""
    renderer = Raytracer(scene(xml, (Meaning.DRONE, Meaning.TARGET), (-1, 0)), num_worlds=1)
    poses = Poses(
        torch.zeros(1, 3), torch.tensor([[1.0, 0, 0, 0]]), torch.tensor([[[5.0, 0.0, 0.0]]])
    )
    depth = renderer.render(view("depth", 201, 201), poses)[0]
    assert depth[100, 100].item() == pytest.approx(4.0)
    # tan of the angle to its rim, 1 / sqrt(5^2 - 1), of a half picture of 100.5 pixels
    assert (depth > 0)[100].sum().item() == pytest.approx(2 * 100.5 / np.sqrt(24), abs=1)
    assert (depth > 0).sum().item() == pytest.approx(np.pi * 100.5**2 / 24, rel=0.01)
    renderer.close()


def test_what_lies_beyond_the_far_end_is_sky(both):
    poses = scattered(1, 0.0)
    poses.props[:] = -50.0
    depth = both[0].render(view("depth", 200, 40), poses)
    assert 50 < depth.max().item() <= 60


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('type="sphere" size=".8"', 'type="hfield" hfield="h"', "geom 'a' is a hfield, which"),
        ('castshadow="false"/>\n<light', 'castshadow="true"/>\n<light', "casts shadows"),
        ('<headlight active="0"/>', '<headlight active="1"/>', "headlight is on; switch it off"),
        (
            ' fovy="60"',
            ' projection="orthographic"',
            "'front' is not a fixed one with an angle of view",
        ),
        ('name="front"', 'name="rear"', "'front' is not in the model; choose from: rear"),
    ],
)
def test_what_it_cannot_draw_is_refused_by_name(old, new, message):
    assert old in XML
    field = '<asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody>'
    xml = XML.replace(old, new).replace("<worldbody>", field)
    with pytest.raises(InputError, match=message):
        Raytracer(scene(xml), num_worlds=1).prepare(view())


def test_a_scene_without_light_is_refused():
    xml = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    with pytest.raises(InputError, match="no light"):
        Raytracer(scene(xml, (Meaning.TARGET,), (-1,)), num_worlds=1)


def test_it_draws_on_a_cpu_alone():
    with pytest.raises(InputError, match="device=cuda"):
        Raytracer(scene(), num_worlds=1, device="cuda")
