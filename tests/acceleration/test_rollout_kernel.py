"""What the kernel decides by, with hand-computed numbers."""

import math

import pytest
import torch
import warp as wp

from drone_rl.acceleration.rollout_kernel import choose, standardise
from drone_rl.envs import StandardizePixels
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")


@wp.kernel(enable_backward=False)
def chosen(
    room: wp.array(dtype=float), draws: wp.array(dtype=float), actions: wp.array(dtype=int)
) -> None:
    i = wp.tid()
    actions[i] = choose(room, 2, 3, draws[i])


@wp.kernel(enable_backward=False)
def standardised(values: wp.array(dtype=float), mean: float, deviation: float) -> None:
    standardise(values, values.shape[0], mean, deviation)


def actions(logits, draws):
    made = torch.full((len(draws),), -1, dtype=torch.int32)
    room = torch.tensor([9.0, 9.0, *logits, 9.0])
    inputs = [wp.from_torch(v) for v in (room, torch.tensor(draws), made)]
    wp.launch(chosen, len(draws), inputs=inputs, device="cpu")
    return made.tolist()


@pytest.mark.parametrize("offset", [0.0, 500.0, -500.0])
def test_an_action_is_drawn_where_its_share_of_probability_lies(offset):
    # probabilities 0.2, 0.5, 0.3: the borders are at 0.2 and 0.7
    logits = [math.log(p) + offset for p in (0.2, 0.5, 0.3)]
    draws = [0.0, 0.19, 0.21, 0.5, 0.69, 0.71, 0.9999]
    assert actions(logits, draws) == [0, 0, 1, 1, 1, 2, 2]


def test_the_most_probable_action_is_taken_and_the_first_of_equals():
    assert actions([1.0, 3.0, 2.0], [-1.0]) == [1]
    assert actions([1.0, 2.0, 3.0], [-1.0]) == [2]
    assert actions([3.0, 2.0, 3.0], [-1.0]) == [0]


def test_standardised_as_the_transform_does_bit_for_bit():
    values = torch.rand(1000)
    expected = StandardizePixels()._apply_transform(values)
    inputs = [wp.from_torch(values), 0.53, 0.21]
    wp.launch(standardised, 1, inputs=inputs, device="cpu")
    assert torch.equal(values, expected)
