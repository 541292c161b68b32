"""Bodies of scene files as objects of tasks: placed, moved, removed, drawn and touched."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import warp as wp

from drone_rl import InputError, Mover, define_task, event
from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.config.task import TASKS, BaseTaskSettings
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.scenes import load_scene
from drone_rl.sim.scenes.bodies import take_bodies
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.sim.worlds import Worlds

FORWARD, LEFT = 0, 1
SCENE = """<mujoco><asset><texture name="t" type="2d" builtin="flat" width="8" height="8"/>
<material name="wood" texture="t"/></asset><worldbody><light directional="true" dir="0 0 -1"/>
<geom name="wall" type="box" size="0.1 5 5" pos="20 0 0"/>
<body name="crate" pos="8 3 1"><freejoint/><geom type="box" size="0.5 0.5 0.5" material="wood"/>
  <body name="lid" pos="0 0 0.6"><geom type="box" size="0.5 0.5 0.1" rgba="1 0 0 1"/></body></body>
<body name="coin" mocap="true" pos="6 0 1"><geom type="cylinder" size="0.3 0.1"/></body>
<body name="lamp" pos="0 9 1"><geom type="sphere" size="0.2" contype="0" conaffinity="0"/></body>
</worldbody></mujoco>"""
COIN = {"body": "coin", "role": "goal"}


@event("test_slide")
def slide(mover: Mover, speed: float = 1.0) -> wp.vec3:
    return wp.vec3(0.0, -speed, 0.0)


@pytest.fixture(autouse=True, scope="module")
def task():
    """Reach the coin, which is 6 m ahead of the drone, 0.8 m large."""
    kind = define_task(
        "test_bodies",
        objects={"coin": COIN},
        reward={"reached": 1.0, "contact": -1.0},
        end=["out_of_bounds"],
        success=["all_goals"],
        start={"z": 1.0},
        step_limit=50,
    )
    yield
    del TASKS[kind.name], MAKERS[kind]


def settings(folder: Path, **objects: Any) -> BaseTaskSettings:
    """Return settings of the task in the scene with more objects."""
    file = folder / "bodies.xml"
    file.write_text(SCENE)
    given = {"name": "test_bodies", "scene": [str(file)], "objects": {"coin": COIN, **objects}}
    return BaseTaskSettings.read(given)


def begun(of: BaseTaskSettings, count: int = 1, **given: Any) -> Any:
    """Return environments after a reset."""
    worlds: Any = Worlds(count, of, **given)
    restart(worlds)
    return worlds


def restart(worlds: Any) -> None:
    count = worlds.num_envs
    worlds.reset(torch.arange(count), [np.random.RandomState(i) for i in range(count)])


def step(worlds: Any, action: int = FORWARD) -> list[float]:
    """Return the rewards of one action in all environments."""
    every = torch.arange(worlds.num_envs)
    return worlds.step(every, torch.full_like(every, action)).tolist()


def ahead(worlds: Any) -> torch.Tensor:
    """Return the distance of what is straight ahead of the drones' centres, metres. Shape: (N,)."""
    view = worlds.view(modality="depth", height=9, width=9)
    camera = 0.4 * min(1.0, worlds.task.drone_size / 1.6)
    return worlds.render(worlds.state, view)[:, 4, 4] + camera


def test_bodies_are_taken_out_of_the_scene_with_their_parts(tmp_path):
    """The box around crate and lid reaches from 0.5 to 1.7 m; a quarter turn swaps its sides."""
    file = tmp_path / "bodies.xml"
    file.write_text(SCENE)
    rest, (crate, coin) = take_bodies(load_scene(file), (("crate", 90.0), ("coin", 0.0)))
    assert crate.center == pytest.approx((8.0, 3.0, 1.1)) and crate.size == pytest.approx(
        (1, 1, 1.2)
    )
    assert coin.center == pytest.approx((6.0, 0.0, 1.0)) and coin.size == pytest.approx(
        (0.6, 0.6, 0.2)
    )
    counts = [
        (of.model.ngeom, of.model.ntex, sum(of.solid)) for of in (rest, crate.scene, coin.scene)
    ]
    assert counts == [(2, 1, 1), (2, 1, 2), (1, 0, 1)]
    _, (crate, lid) = take_bodies(load_scene(file), (("crate", 0.0), ("lid", 0.0)))
    assert crate.size == pytest.approx((1, 1, 1)) and lid.center == pytest.approx((8, 3, 1.6))


def test_a_body_is_drawn_and_touched_where_each_episode_places_it(tmp_path):
    """Its near side is half a metre nearer than its middle, and the drone's is 0.4 m ahead."""
    worlds = begun(settings(tmp_path, crate={"body": "crate", "x": [2.0, 5.0], "y": 0.0}), 8)
    places = worlds.state.places[:, 1]
    assert places[:, 0].std() > 0.3 and places[:, 2].tolist() == pytest.approx([1.1] * 8)
    assert ahead(worlds).tolist() == pytest.approx((places[:, 0] - 0.5).tolist(), abs=1e-3)
    rewards = [step(worlds) for _ in range(3)][-1]
    ends = places[:, 0] - 0.9
    is_stopped = ends < 3.0
    assert 0 < is_stopped.sum() < 8
    expected = torch.where(is_stopped, ends, 3.0)
    assert worlds.state.drone[:, 0].tolist() == pytest.approx(expected.tolist(), abs=1e-5)
    assert rewards == (-is_stopped.double()).tolist()
    assert worlds.state.touched[:, 1].tolist() == is_stopped.tolist()


def test_a_body_is_placed_outside_of_what_is_solid(tmp_path):
    """A crate of 1 m has 0.7 m before a wall at x = 18.2, and as much from there to one at 19.9."""
    crate = {"body": "crate", "x": [17.0, 20.0], "y": 0.0}
    of = settings(tmp_path, crate=crate)
    file = Path(of.scene[0])  # pyright: ignore[reportAttributeAccessIssue]
    thin = '<geom name="thin" type="box" size="0.001 5 5" pos="18.2 0 0"/></worldbody>'
    file.write_text(SCENE.replace("</worldbody>", thin))
    x = begun(of, 100).state.places[:, 1, 0]
    assert bool(((x < 17.71) | (x > 18.69) & (x < 19.41)).all())
    assert 0.3 < (x < 17.71).double().mean() < 0.7


def test_a_body_whose_whole_range_is_solid_is_named_at_once(tmp_path):
    """Its far side, half a metre from its middle, is in the wall at x = 19.9."""
    of = settings(tmp_path, crate={"body": "crate", "x": [19.5, 19.8], "y": 0.0})
    with pytest.raises(InputError, match=r"crate: something is solid wherever .* 19.5 to 19.8, y"):
        begun(of)


def test_a_body_that_is_touched_is_removed_until_the_next_episode(tmp_path):
    """Behind the coin, 5.7 m ahead, is the wall, 19.9 m ahead."""
    worlds = begun(settings(tmp_path))
    assert ahead(worlds).tolist() == pytest.approx([5.7], abs=1e-3)
    rewards = [step(worlds)[0] for _ in range(6)]
    assert rewards == [0, 0, 0, 0, 0, 1] and worlds.state.drone[0, 0] == 6.0
    assert ahead(worlds).tolist() == pytest.approx([13.9], abs=1e-3)
    assert bool(worlds.state.end_reason == worlds.task.success_end)
    restart(worlds)
    assert ahead(worlds).tolist() == pytest.approx([5.7], abs=1e-3)


def test_a_body_that_moves_touches_a_drone_that_it_passes(tmp_path):
    """It goes from y = 5 to -1 in a step in which the drone goes from 2 to 3."""
    door = {"body": "crate", "x": 3.0, "y": 5.0, "z": 1.0, "event": {"test_slide": {"speed": 60.0}}}
    worlds = begun(settings(tmp_path, crate=door), 2)
    worlds.state.body.position[:] = torch.tensor([[3.0, 2.0, 1.0], [0.0, -1.0, 1.0]])
    assert step(worlds, LEFT) == [-1.0, 0.0]
    assert worlds.state.places[:, 1].tolist() == [[3.0, -1.0, 1.0]] * 2
    assert worlds.state.touched.tolist() == [[False, True], [False, False]]
    worlds.state.body.position[1, 1] = -1.0
    assert ahead(worlds)[1] == pytest.approx(2.5, abs=1e-3)


def test_a_quadrotor_bounces_off_a_body(tmp_path):
    """Its ball is as large as the task's drone, 0.8 m, and the crate's near side is at x = 2.5."""
    worlds = begun(
        settings(tmp_path, crate={"body": "crate", "x": 3.0, "y": 0.0}),
        dynamics=DynamicsSettings(mode="simple_flight"),
        actions=ActionSettings(kind="velocity"),
    )
    flown = [
        (
            float(worlds.step(torch.arange(1), torch.tensor([[1.0, 0.0, 0.0]]))),
            worlds.state.drone[0, 0],
        )
        for _ in range(40)
    ]
    assert min(reward for reward, _ in flown) == -1.0
    assert max(x for _, x in flown) == pytest.approx(2.1, abs=0.02)


def test_dm_control_has_the_same_bodies(tmp_path):
    env: Any = make_environment(settings(tmp_path), random_state=0, pixels=False)
    env.reset()
    assert env.physics.named.data.xpos["coin/coin"].tolist() == pytest.approx([6, 0, 1])
    rewards = [env.step(FORWARD).reward for _ in range(6)]
    assert rewards == [0, 0, 0, 0, 0, 1]
    assert env.physics.named.data.xpos["coin/coin"][2] < -100.0


def test_segmentation_and_names_are_those_of_the_role(tmp_path):
    worlds = begun(settings(tmp_path, lamp={"body": "lamp", "role": "decoration"}))
    scene = worlds.scene
    of_coin = worlds.render(worlds.state, worlds.view(modality="segmentation", height=9, width=9))
    assert scene.semantic_classes[of_coin[0, 4, 4]] is SemanticClass.TARGET
    lamp = scene.props.index(1)
    assert scene.semantic_classes[lamp] is SemanticClass.DECORATION
    assert scene.model.body(scene.model.geom_bodyid[lamp]).name == "lamp/lamp"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"body": "crat"}, "no body 'crat'; its bodies: crate, lid, coin, lamp"),
        ({"body": "lamp"}, "nothing in it can be touched"),
        ({"body": "crate", "shape": "ball"}, "leave out shape"),
    ],
)
def test_unusable_bodies_are_named(tmp_path, given, message):
    with pytest.raises(InputError, match=message):
        Worlds(1, settings(tmp_path, thing=given))


def test_bodies_need_a_scene(tmp_path):
    with pytest.raises(InputError, match=r"task\.objects\.coin\.body=coin needs one scene"):
        Worlds(1, BaseTaskSettings.read({"name": "test_bodies"}))
