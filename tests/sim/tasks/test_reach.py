"""Reaching goals in scenes: starts, paths by hand, the oracle, and what can't work."""

import math
from typing import Any

import numpy as np
import pytest
import torch

from drone_rl import InputError
from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.config.task import BaseTaskSettings
from drone_rl.sim.tasks import as_task
from drone_rl.sim.worlds import Worlds
from tests.house import SITES, write_house

TURNING = ActionSettings(kind="moves_turning", turn_step=30.0)


def reach(*paths, **changes):
    return BaseTaskSettings.read({"name": "reach", "scene": [*map(str, paths)], **changes}, "task")


def begun(settings, count, actions=TURNING, dynamics=None) -> Any:
    made = Worlds(count, settings, actions=actions, dynamics=dynamics)
    made.reset(torch.arange(count), [np.random.RandomState(i) for i in range(count)])
    return made


def test_starts_are_in_their_site_and_away_from_walls(tmp_path):
    made = begun(reach(write_house(tmp_path)), 200)
    x, y, z = made.state.body.position.unbind(1)
    assert x.min() >= 0.5 and x.max() <= 2.5 and y.min() >= 0.5 and y.max() <= 3.5
    assert x.min() < 0.7 and x.max() > 2.3 and (z == 1.0).all()
    assert made.state.places[:, 0].unique(dim=0).tolist() == [[5.0, 3.2, 1.0]]


def test_without_a_site_episodes_start_in_all_rooms(tmp_path):
    made = begun(reach(write_house(tmp_path, '<site name="goal" pos="5 3.2 1"/>')), 300)
    x, y, _ = made.state.body.position.unbind(1)
    assert 0.3 < (x < 3.0).double().mean() < 0.7
    near = torch.stack([x, 6 - x, y, 4 - y]).amin(0)
    assert near.min() >= 0.25  # the radius and start.apart


def test_progress_is_along_the_path_through_the_doorway(tmp_path):
    """From (1, 3.2) the goal is 4 m away; the way there passes (3, 2.6 - 0.15 or more)."""
    start = '<site name="start" pos="1 3.2 1"/><site name="goal" pos="5 3.2 1"/>'
    made = begun(reach(write_house(tmp_path, start), start={"heading": 0}), 1)
    (grid, *_), *_ = made.task.routes.routes
    below = 3.2 - 2.6 + 0.15
    assert grid.values.max() < 8.0
    before = made.state.body.position.clone()
    reward = made.step(torch.arange(1), torch.tensor([0]))
    assert made.state.body.position[0].tolist() == pytest.approx([1.3, 3.2, 1.0])
    shortest = 2 * math.hypot(2, below)
    after = math.hypot(1.7, below) + math.hypot(2, below)
    # a knight's moves are at most 3% longer, and paths keep 0.07 m more from the wall
    assert float(reward) == pytest.approx(0.3 * (shortest - after) - 0.01, abs=0.03)
    assert before[0].tolist() == pytest.approx([1, 3.2, 1])


@pytest.mark.parametrize(
    ("actions", "dynamics"),
    [
        (TURNING, None),
        (ActionSettings(kind="velocity", yaw_rate=90.0), None),
        (
            ActionSettings(kind="velocity", yaw_rate=90.0),
            DynamicsSettings(mode="simple_flight", control_ticks=66),
        ),
    ],
    ids=["moves", "speeds", "flight"],
)
def test_the_oracle_reaches_the_goal_without_a_contact(tmp_path, actions, dynamics):
    made = begun(reach(write_house(tmp_path)), 30, actions, dynamics)
    oracle, state = made.task.oracle, made.state
    assert oracle.can_fly(made.dynamics.actions)
    for _ in range(120):
        running = (state.end_reason == 0).nonzero()[:, 0]
        if not len(running):
            break
        after, _ = made.advance(state[running], oracle.choose(made, state[running]))
        state[running] = after
    ends = made.task.ends
    assert state.end_reason.tolist() == [ends.SUCCESS] * 30


def test_climbing_starts_need_actions_that_climb(tmp_path):
    settings = reach(write_house(tmp_path), start={"z": [0.5, 1.8]})
    with pytest.raises(InputError, match="actions=moves_full"):
        Worlds(1, settings, actions=TURNING)
    made = begun(settings, 50, ActionSettings(kind="moves_full"))
    z = made.state.body.position[:, 2]
    assert z.min() >= 0.5 and z.max() <= 1.8 and z.max() - z.min() > 0.8


def test_each_episode_is_in_one_of_the_scenes_with_its_own_goal(tmp_path):
    other = SITES.replace("5 3.2 1", "5 0.8 1")
    paths = [write_house(tmp_path), write_house(tmp_path, other, name="other")]
    made = begun(reach(*paths), 40)
    scene = made.task.scene_of(made.state)
    assert 0 < scene.sum() < 40
    y = torch.where(scene == 1, 0.8, 3.2).double()
    torch.testing.assert_close(made.state.places[:, 0, 1], y)
    assert made.task.routes_of(made.state)[:, 0].tolist() == scene.tolist()


@pytest.mark.parametrize("red_first", [False, True])
def test_each_scene_has_its_own_headlight(tmp_path, red_first):
    paths = [write_house(tmp_path), write_house(tmp_path, name="red")]
    red = '<visual><headlight ambient="0.3 0 0" diffuse="0 0 0"/></visual><worldbody>'
    paths[1].write_text(paths[1].read_text().replace("<worldbody>", red))
    paths = paths[::-1] if red_first else paths
    both = begun(reach(*paths), 12)
    shown, scene = both.render(both.state), both.task.scene_of(both.state)
    for number, path in enumerate(paths):
        alone = begun(reach(path), 12)
        alone.state.body, alone.state.places = both.state.body, both.state.places
        is_here = scene == number
        assert is_here.any() and torch.equal(alone.render(alone.state)[is_here], shown[is_here])


def test_goals_in_a_region_are_all_over_it(tmp_path):
    sites = SITES.replace('pos="5 3.2 1" size="0.1"', 'type="box" pos="4.5 2 1" size="1 1.5 0.1"')
    made = begun(reach(write_house(tmp_path, sites)), 100)
    x, y, z = made.state.places[:, 0].unbind(1)
    assert 3.5 <= x.min() < 3.7 and 5.3 < x.max() <= 5.5 and (z == 1.0).all()
    assert 0.5 <= y.min() < 0.8 and 3.2 < y.max() <= 3.5
    assert len(made.task.routes.routes) == 1


@pytest.mark.parametrize(
    ("sites", "changes", "message"),
    [
        ('<site name="start" pos="1 1 1"/>', {}, "no site whose name begins with goal"),
        (SITES, {"start": {"site": "door"}}, "no site whose name begins with door"),
        (SITES.replace("1.5 2 1", "1.5 2 3.5"), {}, r"different heights.*task\.start\.z=1$"),
        ('<site name="start" pos="3 1 1"/><site name="goal" pos="5 3 1"/>', {}, "inside"),
        ('<site name="goal" pos="3 0.7 1"/>', {"drone_size": 1.0}, "does not fit at goal"),
        (SITES, {"drone_size": 1.2}, "no path of a drone of 1.2 m leads from start to goal"),
        (SITES, {"step_limit": 10}, "step_limit=10"),
        (
            SITES.replace("5 3.2 1", "9 3.2 1"),
            {},
            r"x = 0\.3 to 5\.8 m .* goal is outside of this, at \(9, 3.2, 1\); move it",
        ),
        (SITES.replace("1.5 2 1", "0.2 2 1").replace("1 1.5", "0.06 1.5"), {}, "start.apart=0"),
    ],
)
def test_what_can_not_work_is_one_line(tmp_path, sites, changes, message):
    with pytest.raises(InputError, match=message) as error:
        Worlds(1, reach(write_house(tmp_path, sites), **changes), actions=TURNING)
    assert "\n" not in str(error.value)


def test_an_episode_has_twice_the_steps_of_the_longest_path(tmp_path):
    """4 m from (1, 3) to (5, 3) through the doorway: 10 steps of 0.4 m, and as many again."""
    sites = '<site name="start" pos="1 2 1"/><site name="goal" pos="5 2 1"/>'
    scene, speeds = write_house(tmp_path, sites), ActionSettings(kind="velocity", forward_speed=2)
    flight = DynamicsSettings(mode="simple_flight", tick=0.004, control_ticks=50)  # 0.2 s
    how: Any
    for how in ({"actions": TURNING}, {"actions": speeds, "dynamics": flight}):
        Worlds(1, reach(scene, step_limit=21, step_length=0.4), **how)
        with pytest.raises(InputError, match=r"step_limit=19, .* up to 10 actions of 0.4 m"):
            Worlds(1, reach(scene, step_limit=19, step_length=0.4), **how)


def test_a_mesh_without_sites_gets_the_mjcf_that_has_them(tmp_path):
    path = tmp_path / "hall.obj"
    path.write_text("v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    with pytest.raises(
        InputError, match=r'<mesh name="m" file="hall\.obj" scale="1 1 1"/>.*<site name="goal"'
    ):
        as_task(reach(path))


def test_a_scene_without_solids_is_refused(tmp_path):
    path = tmp_path / "empty.xml"
    geom = '<geom size="1" contype="0" conaffinity="0"/>'
    path.write_text(f'<mujoco><worldbody>{geom}<site name="goal"/></worldbody></mujoco>')
    with pytest.raises(InputError, match="nothing is solid"):
        as_task(reach(path))


def test_cameras_are_inside_the_drone_next_to_walls(tmp_path):
    made = begun(reach(write_house(tmp_path)), 1)
    model = made.scene.model
    for name in ("front_center", "front_left", "back_center", "bottom_center"):
        assert np.linalg.norm(model.camera(f"drone/{name}").pos) < 0.5 * made.task.drone_size
