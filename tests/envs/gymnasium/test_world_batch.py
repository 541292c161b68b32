"""Options of the batch, and observations of environments in given states."""

import itertools

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, floating
from tests.second_task import Posts

pytest.importorskip("gymnasium", reason="Gymnasium is not installed")
from drone_rl.envs.gymnasium.world_batch import WorldBatch

TASK = "collect_cubes"


def streams(*seeds):
    return [np.random.default_rng(seed) for seed in seeds]


@pytest.mark.parametrize("task", [TASK, TaskSettings(num_cubes=5), None])
def test_options_set_task_and_camera(task):
    stage = WorldBatch(2, task, {"num_cubes": 2, "camera": {"width": 9}, "device": "cpu"})
    assert stage.worlds.task.settings == TaskSettings(num_cubes=2)
    assert stage.worlds.camera == CameraSettings(width=9)
    assert stage.observation_space.shape == (25, 9, 3)
    whole = WorldBatch(1, task, {"camera": CameraSettings(height=8), "render_mode": "rgb_array"})
    assert whole.observation_space.shape == (8, 64, 3)
    assert whole.render_mode == "rgb_array"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"num_cube": 2},
            r"unexpected keyword argument 'num_cube'; valid names: .*observations, .*"
            r"; did you mean num_cubes\?$",
        ),
        ({"num_cubes": 0}, "num_cubes=0 is out of range"),
        ({"step_limit": 5}, "step_limit=5 ends every episode"),
        ({"observations": "depth"}, "observations='depth' is unknown; give pixels, state"),
        ({"render_mode": "human"}, "render_mode='human' is unknown; give rgb_array"),
        ({"camera": {"fov": 3}}, "camera.fov is unknown; valid names: width"),
        ({"camera": {"width": 0}}, "camera.width=0 is out of range"),
        (
            {"camera": 64},
            "camera=64 is no CameraSettings; give drone_rl.config.camera.CameraSettings",
        ),
        ({"device": "tpu"}, "device=tpu is unknown"),
    ],
)
def test_invalid_options_are_named(options, message):
    with pytest.raises(InputError, match=f"^{message}"):
        WorldBatch(1, TASK, options)


def test_task_without_settings_rejects_task_options():
    assert WorldBatch(1, Posts(), {}).worlds.task.name == "posts"
    with pytest.raises(InputError, match=r"^unexpected keyword argument 'num_cubes'; valid names"):
        WorldBatch(1, Posts(), {"num_cubes": 2})


def test_episodes_depend_only_on_the_streams():
    stage, (one, two) = WorldBatch(2, TASK, {"observations": "state"}), streams(3, 4)
    stage.reset(torch.arange(2), [one, two])
    first = stage.info()["cube_positions"]
    again = streams(4)[0].uniform(-1, 1, (3, 2))[:, 0] * 6
    np.testing.assert_allclose(first[1, :, 1], again, rtol=1e-6)
    stage.reset(torch.tensor([1]), [two])
    after = stage.info()["cube_positions"]
    assert np.array_equal(after[0], first[0]) and not np.array_equal(after[1], first[1])


def test_state_observation_concatenates_the_true_state():
    stage = WorldBatch(1, TASK, {"observations": "state", "num_cubes": 2})
    stage.reset(torch.tensor([0]), streams(0))
    stage.worlds.state.cubes[0, :, 1] = torch.tensor([4.0, -5.0])
    stage.worlds.state.lateral[0] = torch.tensor([4.0, torch.nan])
    stage.worlds.state.side[0] = torch.tensor([0, -1])
    stage.step(torch.tensor([1]))
    (seen,) = stage.observe()
    wanted = {
        "cubes": [0],
        "collected": [0, 0],
        "side": [0, -1],
        "lateral": [4, 0],  # the second is unknown yet
        "next_cube": [0],
        "cube_positions": [15, 4, 2.5, 24, -5, 2.5],
        "drone": [0, 1, 2.5],
        "attitude": [1, 0, 0, 0],
    }
    assert stage.names == tuple(wanted)
    assert seen.tolist() == [*itertools.chain(*wanted.values())]
    assert seen in stage.observation_space
    info = stage.info()
    assert (info["cubes"].shape, info["cube_positions"].shape) == ((1, 1), (1, 2, 3))
    assert info["lateral"].tolist() == [[4, 0]]
    assert (info["end_reason"].tolist(), info["is_success"].tolist()) == ([0], [False])


def test_pixels_equal_the_batched_environment():
    stage, env = WorldBatch(2, TASK, {}), drone_rl.make_env(2, transforms=())
    env.reset()
    stage.worlds.state = env.base_env.worlds.state
    assert np.array_equal(stage.observe(), env.base_env.last_pixels.numpy())
    assert stage.observe() is not stage.observe()
    env.close()


def test_terminated_and_truncated_are_distinguished():
    stage = WorldBatch(4, TASK, {})
    ends = stage.worlds.task.ends
    stage.worlds.state.end_reason = torch.tensor(
        [ends.RUNNING, ends.ALL_CUBES, ends.SIDE_BOUNDARY, ends.STEP_LIMIT]
    )
    terminated, truncated = stage.flags()
    assert terminated.tolist() == [False, True, True, False]
    assert truncated.tolist() == [False, False, False, True]
    assert stage.info()["is_success"].tolist() == [False, True, False, False]


def test_film_shows_the_drone_from_behind():
    stage = WorldBatch(2, TASK, {"observations": "state", "render_mode": "rgb_array"})
    film = stage.film()
    assert (film.shape, film.dtype) == ((2, 360, 640, 3), np.uint8)
    assert film[0, :, 320].std() > 10  # sky, drone, ground


def test_options_set_dynamics_and_actions(monkeypatch):
    floating(monkeypatch)
    given = {"dynamics": {"mode": "simple_flight"}, "actions": {"move_speed": 1.0}}
    made = WorldBatch(1, TASK, given).worlds.dynamics
    assert (made.settings, made.action_settings.move_speed) == (FLIGHT, 1.0)
    for wrong, message in (
        ({"dynamics": {"mas": 1.0}}, r"dynamics\.mas is unknown"),
        ({"dynamics": {"gusts": 1.0}}, r"dynamics\.gusts=1\.0 moves nothing"),
        ({"actions": {"kind": "x"}}, r"actions\.kind='x' is unknown"),
    ):
        with pytest.raises(InputError, match=f"^{message}"):
            WorldBatch(1, TASK, wrong)
