"""Spaces and actions, compared with hand-written ones."""

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings
from drone_rl.sim.actions import MOVES, Entry
from drone_rl.utils.errors import InputError

spaces = pytest.importorskip("gymnasium.spaces", reason="Gymnasium is not installed")
from drone_rl.envs.gymnasium.world_batch import (  # noqa: E402 (after the skip)
    action_space,
    image_space,
    read_action,
    vector_space,
)


class Thrusts:
    """Actions of two numbers from -1 to 1."""

    names = ("roll", "pitch")
    entry = Entry((2,), torch.float32, -1.0, 1.0)


def test_image_space_has_the_size_of_the_camera():
    space = image_space(CameraSettings(width=7, height=5))
    assert space == spaces.Box(0, 255, (5, 7, 3), np.uint8)


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
        (-1, (), _MOVES),
        (1.0, (), _MOVES),
        ("left", (), _MOVES),
        (None, (), _MOVES),
        (True, (), _MOVES),
        ([1], (), _MOVES),
        (1, (2,), _BOTH),
        ([0, 3], (2,), _BOTH),
        ([0, 1, 2], (2,), _BOTH),
        ([[0], [1, 2]], (2,), _BOTH),
        ([0.0, 1.0], (2,), _BOTH),
    ],
)
def test_invalid_actions_raise(given, batch, wanted):
    with pytest.raises(InputError, match=f"^action=.* is invalid; give {wanted}") as caught:
        read_action(given, MOVES, batch)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", [[0.0, 1.1], [0.0, np.nan], [0.0], 0.5])
def test_actions_out_of_bounds_raise(given):
    with pytest.raises(InputError, match=r"shape \(2,\) of: numbers from -1 to 1$"):
        read_action(given, Thrusts())
