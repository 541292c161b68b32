"""The shipped scenes: what their pictures and pages promise."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import BaseTaskSettings
from drone_rl.config.reach import ReachSettings
from drone_rl.sim.scenes.scene_file import load_scene
from drone_rl.sim.worlds import Worlds

FILES = Path(drone_rl.__file__).parent / "sim" / "scenes" / "files"


@pytest.mark.parametrize("name", ["indoor", "outdoor"])
def test_marks_starts_and_a_goal_that_touch_nothing(name):
    scene = load_scene(FILES / f"{name}.xml")
    assert scene.warnings == ()
    names = [site.name for site in scene.sites]
    assert any(of.startswith("start") for of in names) and "goal" in names
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    (goal,) = [site.position for site in scene.sites if site.name == "goal"]
    geom = np.zeros(1, np.int32)
    around = [(np.cos(a), np.sin(a), 0.0) for a in np.linspace(0, 6, 12)]
    for direction in [*around, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]:
        far = mujoco.mj_ray(model, data, np.array(goal), np.array(direction), None, 1, -1, geom)
        assert far < 0 or far > 0.4


def test_indoor_doorways_are_wide_enough():
    scene = load_scene(FILES / "indoor.xml")
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    geom = np.zeros(1, np.int32)
    for x, y, along in ((2.0, 4.2, 0), (7.0, 4.2, 0), (4.2, 6.1, 1)):
        side = np.eye(3)[along]
        for way in (side, -side):
            place = np.array([x, y, 1.2])
            assert mujoco.mj_ray(model, data, place, way, None, 1, -1, geom) >= 0.45


def test_most_straight_paths_to_the_kitchen_are_blocked():
    goal = {"goal": {**ReachSettings().objects["goal"].values(), "site": "kitchen"}}
    given = {"name": "reach", "start": {"site": "anywhere"}, "objects": goal}
    worlds = Worlds(1, BaseTaskSettings.read(given, "task"))
    rng = np.random.RandomState(0)
    state = worlds.start(torch.stack([worlds.task.sample(rng) for _ in range(300)]))
    solids = worlds.task.solids(state).solids
    place, goal = state.body.position, state.places[:, 0]
    fraction = solids.sweep_at(place, goal, 0.15, worlds.task.solids(state).places).fraction
    assert 0.1 < float((fraction > 1.0).double().mean()) < 0.3


def test_outdoor_trees_stand_on_the_ground():
    scene = load_scene(FILES / "outdoor.xml")
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    ground = model.geom("hills").id
    trees = [i for i in range(model.nbody) if model.body(i).name.startswith("tree_")]
    assert len(trees) == 26
    down, geom = np.array([0.0, 0.0, -1.0]), np.zeros(1, np.int32)
    for body in trees:
        above = data.xpos[body] + [0.0, 0.0, 20.0]
        deep = mujoco.mj_ray(model, data, above, down, None, 1, body, geom)
        assert geom[0] == ground and 20.0 - deep == pytest.approx(0.2, abs=0.15)


def test_the_camera_is_inside_of_a_small_drone():
    """It would look through walls that the drone can't pass."""
    worlds = Worlds(1, BaseTaskSettings.read({"name": "reach", "drone_size": 0.3}, "task"))
    model = worlds.scene.model
    assert model.cam_pos[model.camera("drone/front_center").id].tolist() == pytest.approx(
        [0.075, 0.0, 0.0]
    )
