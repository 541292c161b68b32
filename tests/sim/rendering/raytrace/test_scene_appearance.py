"""Appearance of scene files: colors, textures and lights by name, and of the whole scene."""

import numpy as np
import pytest
import torch

from drone_rl import define_task
from drone_rl.config import AppearanceSettings, CameraSettings
from drone_rl.config.task import TASKS, BaseTaskSettings
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.sim.visual_randomization import AppearanceSampler
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.perturbations import scene_appearance, sun_at
from drone_rl.utils.errors import InputError

ROOM = """<mujoco><visual><headlight active="0"/></visual>
<asset><texture type="skybox" builtin="flat" rgb1="0 1 0" rgb2="0 1 0" width="8" height="48"/>
<material name="paint" specular="0"/></asset>
<worldbody><light name="lamp_1" type="directional" dir="1 0 0" ambient=".2 .2 .2"
diffuse=".4 .4 .4" castshadow="false"/>
<geom name="wall_left" type="box" size=".1 1 3" pos="5 1 0" rgba="1 0 0 1" material="paint"/>
<geom name="post" type="box" size=".1 1 3" pos="5 -1 0" rgba="1 1 1 1" material="paint"/>
</worldbody></mujoco>"""
FULL = (0.2 + 0.4) * 255
"""Light on the walls."""


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    """A task in a scene of a red and a white wall under a green sky."""
    path = tmp_path_factory.mktemp("scene") / "room.xml"
    path.write_text(ROOM)
    ball = {"shape": "ball", "role": "goal", "size": [1, 1, 1], "x": 30.0, "y": 0.0, "z": 0.0}
    kind = define_task(
        "test_room",
        objects={"ball": ball},
        reward={"progress": 1.0},
        end=["out_of_bounds"],
        success=["all_goals"],
        start={"x": 0.0, "y": 0.0, "z": 0.0},
    )
    yield BaseTaskSettings.read({"name": "test_room", "scene": [str(path)]})
    del TASKS[kind.name], MAKERS[kind]


def render(task, **appearance):
    """Return what two environments see of the red wall, the white one and the sky above."""
    worlds = Worlds(2, task, CameraSettings(width=32, height=32))
    states = [np.random.RandomState(i) for i in range(2)]
    worlds.reset(torch.arange(2), states)
    sampler = AppearanceSampler(AppearanceSettings(**appearance), 2, task=task)
    sampler.reset(torch.arange(2), states)
    look = sampler.current() if sampler.varies else sampler.middle
    images = worlds.render(worlds.state, appearance=look).numpy().astype(int)
    worlds.close()
    return images[:, 16, 13], images[:, 16, 18], images[:, 1, 16]


def test_scene_keeps_what_is_not_set(task):
    red, white, sky = render(task, exposure=0.5)
    np.testing.assert_allclose(red, [[FULL / 2, 0, 0]] * 2, atol=1)
    np.testing.assert_allclose(white, [[FULL / 2] * 3] * 2, atol=1)
    np.testing.assert_allclose(sky, [[0, 127, 0]] * 2, atol=1)


def test_walls_vary_and_the_rest_does_not(task):
    wall = {"color": [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]}
    red, white, sky = render(task, objects={"wall*": wall})
    assert np.abs(red[0] - red[1]).max() > 20
    np.testing.assert_allclose(white, [[FULL] * 3] * 2, atol=1)
    np.testing.assert_allclose(sky, [[0, 255, 0]] * 2, atol=1)


def test_materials_are_names_and_textures_multiply_colors(task):
    cover = {"texture": "grid", "tile": 1000.0, "color": [0.0, 1.0, 1.0]}
    red, white, _ = render(task, objects={"paint": cover})
    assert red[0, 0] == 0
    assert (red == white).all()
    assert 0 < red[0, 1] <= FULL + 1


def test_lights_vary_by_name(task):
    _, white, sky = render(task, lights={"lamp*": {"strength": 0.5, "color": [1.0, 0.0, 1.0]}})
    np.testing.assert_allclose(white, [[FULL / 2, 0, FULL / 2]] * 2, atol=1)
    np.testing.assert_allclose(sky, [[0, 255, 0]] * 2, atol=1)


def test_ambient_and_sun_are_relative_to_those_of_tasks(task):
    _, white, _ = render(task, ambient_strength=0.7, sun_strength=0.375)
    np.testing.assert_allclose(white, [[(0.4 + 0.2) * 255] * 3] * 2, atol=1)


def test_fog_and_sky_apply(task):
    # at 4.9 m of a visibility of 4.9 m 5% of the contrast is left
    _, white, sky = render(task, fog_visibility=4.9, sky_horizon=[0.0, 0.0, 1.0])
    np.testing.assert_allclose(white[0], 0.05 * FULL + 0.95 * np.array([0, 0, 255]), atol=2)
    np.testing.assert_allclose(sky, [[0, 0, 255]] * 2, atol=1)


def test_perturbations_begin_with_the_scene_as_it_is(task):
    worlds = Worlds(1, task, CameraSettings(width=32, height=32))
    base = scene_appearance(worlds.scene)
    own, same = worlds.render(worlds.state), worlds.render(worlds.state, appearance=base)
    assert (own == same).all()
    low = sun_at(5.0).change(base, torch.zeros(1, 0))  # shines at the walls
    steep = sun_at(85.0).change(base, torch.zeros(1, 0))
    bright, dim = (worlds.render(worlds.state, appearance=look)[0, 16, 18] for look in (low, steep))
    assert int(bright[0]) > int(dim[0]) + 20
    worlds.close()


def test_unknown_names_are_refused(task):
    with pytest.raises(InputError, match=r"'wal' names nothing in the scene; names there: .*post"):
        render(task, objects={"wal": {"color": [0, 0, 0]}})
    with pytest.raises(InputError, match="task=collect_cubes has none"):
        AppearanceSampler(AppearanceSettings(objects={"wall": {}}), 1)
