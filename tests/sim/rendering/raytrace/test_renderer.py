"""Comparison with MuJoCo Warp on scenes with all geom types, and hand-computed images."""

import dataclasses

import mujoco
import numpy as np
import pytest
import torch
import warp as wp

from drone_rl.sim.rendering import Appearance, Poses, Raytracer, Scene, Texture, View
from drone_rl.sim.rendering.mujoco_warp import WarpRenderer
from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.renderer import CpuLauncher, GpuLauncher
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import MODALITIES
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state
from tests.box_ahead import geoms
from tests.box_ahead import render as render_box

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
<camera name="rear" pos="-.4 0 .2" xyaxes="0 1 0 -.3 0 1" fovy="80"/>
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


MEANINGS = (
    SemanticClass.GROUND,
    SemanticClass.GROUND,
    SemanticClass.OBSTACLE,
    SemanticClass.DRONE,
    *[SemanticClass.TARGET] * 5,
)


PROPS = (-1, -1, -1, -1, 0, 1, 2, 3, 4)


def scene(xml=XML, meanings=MEANINGS, props=PROPS):
    return Scene(mujoco.MjModel.from_xml_string(xml), meanings, props, (0.6, 0.7, 0.9))


def view(modality="rgb", height=30, width=40):
    return View(cameras=("front",), height=height, width=width, modalities=(modality,))


def render(renderer, view, poses, appearance=None):
    """Return the only image of each environment."""
    return renderer.render(view, poses, appearance)[view.modalities[0]][:, 0]


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
    made = [kind(scene(), num_envs=64, num_shards=2) for kind in (Raytracer, WarpRenderer)]
    yield made
    for renderer in made:
        renderer.close()


@pytest.mark.parametrize("tilt", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("modality", ["rgb", "depth", "segmentation"])
def test_images_equal_mujoco_warp(both, modality, tilt):
    """Single pixels on edges of round geoms may differ because of a different solver."""
    ours, theirs = (render(r, view(modality), scattered(64, tilt)) for r in both)
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
    assert len(theirs.flatten().unique()) > 5  # the scene is not empty
    difference = (ours.double() - theirs.double()).abs()
    tolerance = {"rgb": 1, "depth": 1e-3, "segmentation": 0}[modality]
    scale = theirs.double().clamp(min=1) if modality == "depth" else 1.0
    assert (difference > tolerance * scale).double().mean() < 1e-4


@pytest.mark.parametrize("camera", ["front_center", "chase"])
@pytest.mark.parametrize("modality", ["rgb", "segmentation"])
def test_images_of_task_scenes_equal_mujoco_warp_exactly(camera, modality):
    """A policy trained with one renderer has the same observations with the other."""
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


def test_every_geom_type_is_visible(both):
    seen = render(both[0], view("segmentation"), scattered(64, 0.2)).unique().tolist()
    assert seen == [-1, 0, 1, 2, 4, 5, 6, 7, 8]  # all but the drone's hull


def test_colors_and_lights_equal_mujoco_warp(both):
    draw = torch.Generator().manual_seed(0)
    appearance = Appearance(
        colors={m: torch.rand(64, 3, generator=draw) for m in set(MEANINGS) | {SemanticClass.SKY}},
        ambient=torch.rand(64, 3, generator=draw) / 2,
        sun=torch.rand(64, 3, generator=draw),
        sun_direction=torch.rand(64, 3, generator=draw) - torch.tensor([0.5, 0.5, 1.5]),
    )
    ours, theirs = (render(r, view(), scattered(64, 0.2), appearance) for r in both)
    assert ((ours.int() - theirs.int()).abs() > 1).double().mean() < 1e-4
    plain = render(both[0], view(), scattered(64, 0.2))
    assert (plain != ours).double().mean() > 0.9


def test_solids_are_invisible_from_inside(both):
    """MuJoCo also renders only the outside."""
    poses = scattered(5, 0.0)
    eyes = poses.position + torch.tensor([0.4, 0.0, 0.0])
    for world, prop in enumerate(range(5)):
        poses.props[world, prop] = eyes[world] - torch.tensor([0.1, 0.1, 0.1])
    seen = render(both[0], view("segmentation"), poses)
    assert torch.equal(seen, render(both[1], view("segmentation"), poses))
    assert all(world + 4 not in seen[world].unique().tolist() for world in range(5))


@pytest.fixture
def ball():
    """Return a function that renders a ball of 1 m, 5 m ahead of a camera that looks along x."""
    xml = """<mujoco><statistic extent="1"/><visual><headlight active="0"/></visual><worldbody>
    <light directional="true" castshadow="false"/><body name="drone"><freejoint/>
    <geom type="box" size=".1 .1 .1"/>
    <camera name="front" xyaxes="0 -1 0 0 0 1" fovy="90"/></body>
    <body mocap="true"><geom type="sphere" size="1"/></body></worldbody></mujoco>"""
    renderer = Raytracer(
        scene(xml, (SemanticClass.DRONE, SemanticClass.TARGET), (-1, 0)), num_envs=1
    )
    poses = Poses(
        torch.zeros(1, 3), torch.tensor([[1.0, 0, 0, 0]]), torch.tensor([[[5.0, 0.0, 0.0]]])
    )
    yield lambda modality: render(renderer, view(modality, 201, 201), poses)[0]
    renderer.close()


def test_size_and_distance_of_a_ball_match_geometry(ball):
    depth, distance = ball("depth"), ball("distance")
    assert depth[100, 100].item() == distance[100, 100].item() == pytest.approx(4.0)
    # the tangent of the angle to the rim is 1 / sqrt(5^2 - 1); the half image has 100.5 pixels
    assert (depth > 0)[100].sum().item() == pytest.approx(2 * 100.5 / np.sqrt(24), abs=1)
    assert (depth > 0).sum().item() == pytest.approx(np.pi * 100.5**2 / 24, rel=0.01)
    # ten pixels to the side the slope is s = 10 / 100.5: |t (1, s) - (5, 0)| = 1
    s = 10 / 100.5
    t = (5 - np.sqrt(25 - 24 * (1 + s * s))) / (1 + s * s)
    assert depth[100, 110].item() == pytest.approx(t, rel=1e-5)
    assert distance[100, 110].item() == pytest.approx(t * np.sqrt(1 + s * s), rel=1e-5)
    assert depth[0, 0].item() == distance[0, 0].item() == 0.0


def test_normals_of_a_ball_point_outward(ball):
    normals = ball("normals")
    np.testing.assert_allclose(normals[100, 100], [-1.0, 0.0, 0.0], atol=1e-5)
    s = 10 / 100.5
    t = (5 - np.sqrt(25 - 24 * (1 + s * s))) / (1 + s * s)
    right, up = normals[100, 110], normals[90, 100]  # world frame: y left, z up
    np.testing.assert_allclose(right, [t - 5, -t * s, 0.0], atol=1e-4)
    np.testing.assert_allclose(up, [t - 5, 0.0, t * s], atol=1e-4)
    assert not normals[0, 0].any()
    hit = ball("segmentation") >= 0
    np.testing.assert_allclose(normals[hit].norm(dim=-1), 1.0, atol=1e-5)


@pytest.mark.parametrize("height", [0.01, 1.0])
def test_distance_of_a_plane_at_grazing_angles_matches_geometry(both, height):
    """From height h, a ray of downward slope s hits the plane at h / s."""
    poses = scattered(1, 0.0)
    poses.props[:] = -50.0
    poses.position[:] = torch.tensor([0.0, 0.0, height])
    depth, seen = (
        render(both[0], view(modality, 101, 3), poses)[0, :, 1]
        for modality in ("depth", "segmentation")
    )
    below = torch.arange(51, 101)
    slope = (below - 50) / 50.5 * np.tan(np.pi / 6)
    expected = torch.where(height / slope <= 60, height / slope, 0.0).float()
    on_ground = seen[51:] <= 0
    torch.testing.assert_close(depth[51:][on_ground], expected[on_ground], rtol=1e-4, atol=0)
    assert on_ground.sum() > 40 and (seen[51:] == 0).sum() > 20
    normals = render(both[0], view("normals", 101, 3), poses)[0, 51:, 1][seen[51:] == 0]
    assert normals.unique(dim=0).tolist() == [[0.0, 0.0, 1.0]]


@pytest.mark.parametrize("tilt", [0.2, 1.0])
def test_gpu_launcher_on_a_cpu_renders_the_same_images(tilt, both):
    """The GPU kernels call the same functions in a different order."""
    alike = Raytracer(scene(), num_envs=1)
    alike._launcher.close()
    alike._launcher = GpuLauncher("cpu")
    requested = View(cameras=("front", "rear"), height=20, width=30, modalities=MODALITIES)
    expected = both[0].render(requested, scattered(16, tilt))
    for modality, image in alike.render(requested, scattered(16, tilt)).items():
        if image.is_floating_point():
            torch.testing.assert_close(image, expected[modality], rtol=1e-6, atol=1e-6)
        else:
            assert torch.equal(image, expected[modality]), modality


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_gpu_renders_the_same_images(both):
    on_gpu = Raytracer(scene(), num_envs=64, device="cuda")
    requested = View(cameras=("front", "rear"), height=30, width=40, modalities=MODALITIES)
    poses = scattered(64, 0.2)
    there = Poses(poses.position.cuda(), poses.attitude.cuda(), poses.props.cuda())
    expected = both[0].render(requested, poses)
    for modality, image in on_gpu.render(requested, there).items():
        assert image.device.type == "cuda"
        difference = (image.cpu().double() - expected[modality].double()).abs()
        tolerance = 1 if modality == "rgb" else 1e-3
        assert (difference > tolerance * expected[modality].clamp(min=1)).double().mean() < 1e-4


def test_geoms_beyond_the_far_limit_are_sky(both):
    poses = scattered(1, 0.0)
    poses.props[:] = -50.0
    depth = render(both[0], view("depth", 200, 40), poses)
    assert 50 < depth.max().item() <= 60


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'type="sphere" size=".8"',
            'type="hfield" hfield="h"',
            "geom 'a' is a hfield, which .* renderer=raytrace$",
        ),
        ('castshadow="false"/>\n<light', 'castshadow="true"/>\n<light', "castshadow=true, which"),
        ('<headlight active="0"/>', '<headlight active="1"/>', "headlight is on, which"),
        (
            ' fovy="60"',
            ' projection="orthographic"',
            "'front' is not supported",
        ),
        ('name="front"', 'name="nose"', "'front' is not in the model; choose from: nose, rear"),
    ],
)
def test_unsupported_geoms_raise_with_their_name(old, new, message):
    assert old in XML
    field = '<asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody>'
    xml = XML.replace(old, new).replace("<worldbody>", field)
    with pytest.raises(InputError, match=message):
        Raytracer(scene(xml), num_envs=1).prepare(view())


def test_scene_without_light_raises():
    xml = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    with pytest.raises(InputError, match="no light"):
        Raytracer(scene(xml, (SemanticClass.TARGET,), (-1,)), num_envs=1)


@pytest.fixture(params=["cores", "gpu"])
def launcher(request):
    """Return each launcher; the GPU launcher runs on a CPU as well."""
    made = CpuLauncher(1, 1) if request.param == "cores" else GpuLauncher("cpu")
    yield made
    made.close()


def test_color_follows_lamberts_law(launcher):
    rgb = render_box(launcher, "rgb", structs_kernel.RGB, wp.vec3ub)
    # the front faces +z, the cosine of the light is 0.8: 0.2 + 0.6 * 0.8 = 0.68
    assert rgb[20, 20].tolist() == [173, 86, 0]
    assert rgb[0, 0].tolist() == [10, 20, 30]  # the sky


@pytest.mark.parametrize(
    ("depths", "shown"), [((-6.0, -9.0), 1), ((-9.0, -6.0), 2), ((-6.0, -6.0), 2)]
)
def test_nearer_or_later_geom_is_in_front(launcher, depths, shown):
    box = geoms(*depths, numbers=(1, 2))
    numbers = render_box(launcher, "segmentation", structs_kernel.SEGMENTATION, int, box)
    assert numbers[20, 20, 0] == shown


EFFECTS = Appearance(
    zenith=(0.1, 0.2, 0.6),
    fog_visibility=60.0,
    shadows=1,
    textures={
        SemanticClass.GROUND: Texture(images=("grid",), size=3.0),
        SemanticClass.TARGET: Texture(images=("noise",), size=1.0),
    },
)
LOW_SUNS = torch.stack([torch.arange(64.0).cos(), torch.arange(64.0).sin()], -1)
"""Directions in which the light travels sideways, from all around. Shape: (64, 2)."""


@pytest.mark.parametrize(
    ("modality", "down"),
    [("rgb", -1.0), ("rgb", -0.15), ("rgb", 0.1), ("depth", -1.0), ("segmentation", -1.0)],
)
def test_the_gpu_kernel_renders_the_effects_of_the_cpu_kernel(modality, down, both):
    """On a GPU, each pixel looks for its shadow; on a CPU, each shadow for its pixels."""
    alike, poses = Raytracer(scene(), num_envs=64), scattered(64, 0.4)
    alike._launcher.close()
    alike._launcher = GpuLauncher("cpu")
    sun = torch.nn.functional.pad(LOW_SUNS, (0, 1), value=down)
    effects = dataclasses.replace(EFFECTS, sun_direction=sun)
    ours, theirs = (render(r, view(modality), poses, effects).double() for r in (both[0], alike))
    assert ((ours - theirs).abs() > 1e-3).double().mean() < 1e-4
    plain = render(both[0], view(modality), poses).double()
    assert (plain != ours).double().mean() > 0.5 if modality == "rgb" else torch.equal(plain, ours)
    unshaded = dataclasses.replace(effects, shadows=0)
    if modality == "rgb" and down < 0:
        assert (render(both[0], view(), poses, unshaded) != ours).double().mean() > 0.01
