"""Options of the batch, spaces and actions, and observations of environments in given states."""

import itertools

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.actions import MOVES, Entry
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, floating
from tests.second_task import Posts

spaces = pytest.importorskip("gymnasium.spaces", reason="Gymnasium is not installed")
from drone_rl.envs.gymnasium.world_batch import (  # noqa: E402 (after the skip)
    WorldBatch,
    action_space,
    read_action,
    vector_space,
)

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
        ({"camera": {"fov": 3}}, "camera.fov is unknown; valid names: width"),
        ({"transforms": ["grey"]}, "transforms.*grey.*did you mean gray"),
        (
            {"transforms": ["gray"], "observations": "state"},
            "transforms change images, but observations=state; leave one of them out",
        ),
    ],
)
def test_invalid_options_are_named(options, message):
    with pytest.raises(InputError, match=f"^{message}"):
        WorldBatch(1, TASK, options)


def test_task_without_settings_rejects_task_options():
    assert WorldBatch(1, Posts(), {}).worlds.task.name == "posts"
    with pytest.raises(InputError, match=r"^unexpected keyword argument 'num_cubes'; valid names"):
        WorldBatch(1, Posts(), {"num_cubes": 2})


def test_state_observation_concatenates_the_true_state():
    stage = WorldBatch(1, TASK, {"observations": "state", "num_cubes": 2})
    stage.reset(torch.tensor([0]), streams(0))
    stage.worlds.state.places[0, :, 1] = torch.tensor([4.0, -5.0])
    stage.worlds.state.noted[0] = torch.tensor([4.0, torch.nan])
    stage.worlds.state.sides[0] = torch.tensor([0, -1])
    stage.step(torch.tensor([1]))
    (seen,) = stage.observe(False)
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


def test_options_set_dynamics_and_actions(monkeypatch):
    floating(monkeypatch)
    given = {"dynamics": {"mode": "simple_flight"}, "actions": {"move_speed": 1.0}}
    made = WorldBatch(1, TASK, given).worlds.dynamics
    assert (made.settings, made.action_settings.move_speed) == (FLIGHT, 1.0)
    for wrong, message in (
        ({"dynamics": {"mas": 1.0}}, r"dynamics\.mas is unknown"),
        ({"dynamics": {"gusts": 1.0}}, r"dynamics\.gusts=1\.0 moves nothing"),
        ({"actions": {"kind": "x"}}, r"actions\.kind='x': it must be"),
    ):
        with pytest.raises(InputError, match=f"^{message}"):
            WorldBatch(1, TASK, wrong)


class Thrusts:
    """Actions of two numbers from -1 to 1."""

    names = ("roll", "pitch")
    entry = Entry((2,), torch.float32, -1.0, 1.0)


def test_state_space_concatenates_entries_and_bounds():
    space = vector_space(
        {
            "flags": Entry((2,), torch.bool),
            "side": Entry((1,), torch.int64, -1, 2),
            "places": Entry((2, 2), torch.float64),
        }
    )
    most = np.finfo(np.float32).max
    assert space.low.tolist() == [0, 0, -1, *[-most] * 4]
    assert space.high.tolist() == [1, 1, 2, *[most] * 4]
    assert space.dtype == np.float32


def test_action_space_is_discrete_or_bounded():
    assert action_space(MOVES.entry) == spaces.Discrete(3)
    assert action_space(Entry((2,), torch.int64, 0, 4)) == spaces.MultiDiscrete([5, 5])
    assert action_space(Thrusts.entry) == spaces.Box(-1, 1, (2,), np.float32)


@pytest.mark.parametrize("given", [2, np.int64(2), np.array(2), torch.tensor(2), np.uint8(2)])
def test_read_action_returns_one_action(given):
    action = read_action(given, MOVES)
    assert (action.shape, action.dtype, int(action)) == ((), torch.int64, 2)


def test_read_action_returns_one_action_per_environment():
    assert read_action([0, 2], MOVES, (2,)).tolist() == [0, 2]
    assert read_action(np.array([[0.5, -1]]), Thrusts(), (1,)).tolist() == [[0.5, -1]]


_MOVES = r"one of: 0 forward, 1 left, 2 right$"


_BOTH = r"an array of shape \(2,\) of: 0 forward, 1 left, 2 right$"


@pytest.mark.parametrize(
    ("given", "batch", "wanted"),
    [
        (3, (), _MOVES),
        (None, (), _MOVES),
        ([0, 3], (2,), _BOTH),
        ([[0], [1, 2]], (2,), _BOTH),
    ],
)
def test_invalid_actions_raise(given, batch, wanted):
    with pytest.raises(InputError, match=f"^action=.* is invalid; give {wanted}") as caught:
        read_action(given, MOVES, batch)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "given",
    [
        [0.0, np.nan],
        [0.0],
    ],
)
def test_actions_out_of_bounds_raise(given):
    with pytest.raises(InputError, match=r"shape \(2,\) of: numbers from -1 to 1$"):
        read_action(given, Thrusts())
