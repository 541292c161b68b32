"""The map of a scene: paths of episodes, how they end, and success by start."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import torch

from drone_rl.config import ActionSettings
from drone_rl.config.task import BaseTaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.explanations import scene_map
from drone_rl.explanations.report import scene_map as scene_map_part
from drone_rl.policies.baselines import ConstantAgent, OracleAgent
from drone_rl.sim.scenes.scene_file import load_scene
from drone_rl.trust.scene_map import Path3D, by_start, draw_map, fly_paths
from tests.house import SITES, write_house

STARTS = SITES.replace('"start"', '"start_west"') + '<site name="start_east" pos="4 1 1"/>'


def environment(tmp_path):
    scene = write_house(tmp_path, STARTS)
    task = BaseTaskSettings.read({"name": "reach", "scene": [str(scene)]}, "task")
    actions = ActionSettings(kind="moves_turning", turn_step=30.0)
    return DroneEnv(20, task, seed=0, pixels=False, actions=actions)


def test_paths_lead_from_starts_to_ends(tmp_path):
    env = environment(tmp_path)
    paths = fly_paths(env, OracleAgent(), 30)
    assert len(paths) == 30 and {path.outcome for path in paths} == {"success"}
    rates = by_start(paths)
    assert [*rates] == ["start_east", "start_west"]
    assert sum(rate.trials for rate in rates.values()) == 30
    for path in paths:
        assert np.linalg.norm(path.points[-1] - path.goals[0]) <= 0.35 + 1e-6
        assert (path.points[0, 0] == 4.0) == (path.start == "start_east")
        assert np.linalg.norm(np.diff(path.points, axis=0), axis=1).max() <= 0.3 + 1e-6


def test_the_map_counts_contacts_and_shows_walls(tmp_path):
    env: Any = environment(tmp_path)
    paths = fly_paths(env, ConstantAgent(torch.tensor(0)), 20)  # straight on
    hit = [path for path in paths if path.outcome == "contact"]
    assert len(hit) > 10
    figure = draw_map(env.worlds.task.scenes[0], paths)
    bars = figure.axes[1]
    assert f"{20 - len(hit)} of 20" in figure.get_suptitle()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"touches something (X): {len(hit)}" in texts
    assert [label.get_text().split("\n")[0] for label in bars.get_yticklabels()] == [
        "start_east",
        "start_west",
    ]


def test_the_lower_section_is_above_the_ground_of_a_mountain(tmp_path):
    file = tmp_path / "top.xml"
    file.write_text(
        '<mujoco><worldbody><geom type="box" pos="0 0 50" size="5 5 50"/></worldbody></mujoco>'
    )
    points = np.array([[0.0, 0, 101], [1, 0, 101]])
    figure = draw_map(load_scene(file), [Path3D(points, points[1:], 0, "start", "success")])
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts[-1] == "solid at 100.5 m, flown over"


def test_an_explanation_shows_the_map(tmp_path):
    env: Any = environment(tmp_path)
    context: Any = SimpleNamespace(
        scenes=SimpleNamespace(task=env.worlds.task), env=env, restart=OracleAgent
    )
    found: Any = scene_map.section(context)
    assert found.by_start["start_east"].share == 1.0
    assert found.picture.shape[2] == 3 and found.picture.dtype == np.uint8
    assert scene_map_part.draw(found, context)["scene_map"].height == len(found.picture)
