"""Images of scenes of any geoms against single rays and against OpenGL."""

import numpy as np
import pytest
import torch

from drone_rl.sim.rendering import Appearance, Mounting, Poses, View
from drone_rl.sim.rendering.appearance import rotate
from drone_rl.sim.rendering.raytrace.renderer import Raytracer
from drone_rl.sim.rendering.raytrace.world_renderer import SceneRaytracer, make_raytracer
from drone_rl.sim.rendering.renderer import find_renderer
from drone_rl.sim.rendering.view import MODALITIES
from drone_rl.utils.errors import InputError
from tests.any_scene import cast, make_scene, random_scene

HEIGHT, WIDTH = 27, 38


def view(**options):
    given = {"cameras": ("front",), "height": HEIGHT, "width": WIDTH, "modalities": MODALITIES}
    return View(**{**given, **options})


def poses_of(places, turns):
    turns = torch.tensor(turns, dtype=torch.float32)
    turns = turns / turns.norm(dim=1, keepdim=True)
    count = len(turns)
    return Poses(torch.tensor(places, dtype=torch.float32), turns, torch.zeros(count, 0, 3))


def rays_of(turn, height=HEIGHT, width=WIDTH, fov=60.0):
    """Return the directions of all pixels in the world frame."""
    half = np.tan(np.radians(fov / 2))
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * half * width / height
    down = ((np.arange(height) + 0.5) / height * 2 - 1) * half
    x, y = np.meshgrid(across, down)
    rays = torch.from_numpy(np.stack([np.ones(x.shape), -x, -y], -1)).float().reshape(-1, 3)
    return rotate(turn, rays / rays.norm(dim=1, keepdim=True)).numpy()


@pytest.mark.parametrize("seed", range(4))
def test_images_are_those_of_single_rays(seed):
    random = np.random.RandomState(seed)
    scene = random_scene(seed)
    poses = poses_of(random.uniform(-5, 5, (6, 3)), random.normal(size=(6, 4)))
    renderer = SceneRaytracer(scene, num_envs=6, num_shards=2)
    images = renderer.render(view(), poses)
    same = []
    for env in range(6):
        rays = rays_of(poses.attitude[env])
        hits = cast(scene, poses.position[env].numpy(), rays)
        shown = {name: of[env, 0].flatten(0, 1).numpy() for name, of in images.items()}
        is_same = shown["segmentation"] == hits["geom"]
        same.append(is_same.mean())
        for name, field in (("distance", "distance"), ("normals", "face_normal")):
            np.testing.assert_allclose(
                np.median(np.abs(shown[name] - hits[field])[is_same]), 0, atol=1e-5
            )
        error = np.abs(shown["distance"] - hits["distance"]) / np.maximum(hits["distance"], 1)
        assert (error[is_same] < 1e-3).all()
        axis = rotate(poses.attitude[env], torch.tensor([1.0, 0.0, 0.0])).numpy()
        np.testing.assert_allclose(shown["depth"], shown["distance"] * (rays @ axis), atol=1e-4)
    assert np.mean(same) > 0.998
    renderer.close()


def test_renderer_is_chosen_by_the_scene():
    ball = '<geom size="1" pos="4 0 0"/><light type="directional" dir="1 0 -1" castshadow="false"/>'
    simple = make_scene(ball, more='<headlight active="0"/>')
    make = find_renderer("raytrace")
    assert type(make(simple, num_envs=1, num_shards=1, device="cpu")) is Raytracer
    other = make_scene(ball)
    assert type(make(other, num_envs=1, num_shards=1, device="cpu")) is SceneRaytracer
    with pytest.raises(InputError, match=r"headlight is on, .* renderer=mujoco_warp$"):
        make(other, num_envs=1, num_shards=None, device="cuda")


def test_camera_is_mounted_and_zoomed_for_each_environment():
    scene = make_scene('<geom type="box" size=".5 20 .5" pos="10.5 0 0"/>')
    poses = poses_of([[0, 0, 0]] * 2, [[1, 0, 0, 0]] * 2)
    zoom = torch.tensor([1.0, 2.0])
    offset = torch.tensor([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    look = Appearance(camera=Mounting(camera="front", offset=offset, zoom=zoom))
    renderer = make_raytracer(scene, num_envs=2, num_shards=1)
    seen = view(height=60, width=60, modalities=("depth",))
    depth = renderer.render(seen, poses, look)["depth"][:, 0]
    assert torch.unique(depth[0]).tolist() == [0.0, 10.0]
    assert torch.unique(depth[1]).tolist() == [0.0, 5.0]
    rows = (depth > 0).sum(1)[:, 30].tolist()  # 60 pixels are 2 tan(30 degrees) high at 1 m
    assert rows == [6, 20]
    wide = view(height=60, width=60, modalities=("depth",), horizontal_fov=80.0)
    rows = (renderer.render(wide, poses)["depth"][0, 0] > 0).sum(0)[30].item()
    assert rows == 4  # 1 m of 16.8 m, 3.6 pixels


def test_light_without_color_changes_nothing_though_it_casts_shadows():
    """Without shadows tiles are shaded at once, with them each pixel alone."""
    textures = "".join(
        f'<texture name="{name}" type="2d" builtin="{kind}" rgb1=".9 .8 .2" rgb2=".1 .3 .7" '
        f'width="64" height="64"/><material name="{name}" texture="{name}" texrepeat="3 2" '
        f'texuniform="{uniform}" specular=".8" shininess=".4"/>'
        for name, kind, uniform in (("tiles", "checker", "true"), ("paint", "gradient", "false"))
    )
    mesh = '<mesh name="m" builtin="supersphere" params="8 .6 1.4" scale="1 1.2 .9"/>'
    geoms = """<geom type="plane" size="0 0 1" pos="0 0 -1" material="tiles"/>
    <geom type="box" size=".8 1 .7" pos="4 1.5 -.2" euler="10 20 30" material="paint"/>
    <geom type="mesh" mesh="m" pos="4 -1.2 0" material="tiles"/>
    <geom type="cylinder" size=".5 .8" pos="7 0 0" euler="60 0 0" material="paint"/>
    <light type="point" pos="1 0 3" diffuse=".9 .9 .8" specular=".6 .6 .6" castshadow="false"/>"""
    black = '<light dir="0 0 -1" ambient="0 0 0" diffuse="0 0 0" specular="0 0 0"/>'
    look = Appearance(fog_visibility=20.0)
    images = []
    for lights in ("", black):
        renderer = SceneRaytracer(make_scene(geoms + lights, textures + mesh), num_envs=1)
        seen = view(height=100, width=141, modalities=("rgb",))
        images.append(renderer.render(seen, poses_of([[0, 0, 0]], [[1, 0, 0, 0]]), look)["rgb"])
        renderer.close()
    assert images[0].float().std() > 20
    difference = (images[0].int() - images[1].int()).abs()
    assert difference.max() <= 1
    assert difference.float().mean() < 0.02
