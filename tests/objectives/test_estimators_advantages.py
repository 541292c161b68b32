"""Hand-computed generalized advantages of running, truncated and terminated episodes."""

import pytest
import torch
from tensordict import TensorDict

from drone_rl.objectives import Advantages

GAMMA, LMBDA = 0.5, 0.4


def row(value, after, reward, done, terminated):
    def column(values, dtype=torch.float32):
        return torch.tensor(values, dtype=dtype)[None, :, None]

    end = {"done": column(done, torch.bool), "terminated": column(terminated, torch.bool)}
    following = {"state_value": column(after), "reward": column(reward), **end}
    return TensorDict({"state_value": column(value), "next": following}, [1, len(value)])


def test_advantages_match_hand_computed_values():
    """Steps 0 and 1 terminate an episode, step 2 truncates another, 3 and 4 belong to a third.

    With d = r + 0.5 V(next) - V and weight 0.2 of the next advantage within an episode:
    step 4, the end of the batch: 0 + 0.5 * 8 - 3 = 1
    step 3: 1 + 0.5 * 3 - 2 = 0.5, and 0.2 * 1 = 0.7
    step 2, truncated: 0 + 0.5 * 6 - 1 = 2; independent of step 3
    step 1, terminated: 2 - 4 = -2; the next value is 0, regardless of the critic
    step 0: 0 + 0.5 * 4 - 1 = 1, and 0.2 * -2 = 0.6
    """
    batch = row(
        value=[1.0, 4.0, 1.0, 2.0, 3.0],
        after=[4.0, 100.0, 6.0, 3.0, 8.0],
        reward=[0.0, 2.0, 0.0, 1.0, 0.0],
        done=[0, 1, 1, 0, 0],
        terminated=[0, 1, 0, 0, 0],
    )
    found = Advantages(GAMMA, LMBDA, scale=False)(batch)
    assert found["advantage"].flatten().tolist() == pytest.approx([0.6, -2.0, 2.0, 0.7, 1.0])
    wanted = [1.6, 2.0, 3.0, 2.7, 4.0]  # advantage and value
    assert found["value_target"].flatten().tolist() == pytest.approx(wanted)


def test_rows_are_independent():
    one = row([1.0, 2.0], [2.0, 3.0], [0.0, 1.0], [0, 0], [0, 0])
    two = row([5.0, 4.0], [4.0, 0.0], [1.0, 0.0], [0, 1], [0, 1])
    both = Advantages(GAMMA, LMBDA, scale=False)(torch.cat([one, two]))["advantage"]
    alone = [Advantages(GAMMA, LMBDA, scale=False)(r)["advantage"] for r in (one, two)]
    torch.testing.assert_close(both, torch.cat(alone))


def test_scaled_advantages_are_standardized():
    batch = row([0.0, 0.0], [0.0, 0.0], [1.0, 3.0], [1, 1], [1, 1])
    found = Advantages(GAMMA, LMBDA, scale=True)(batch)
    assert found["advantage"].flatten().tolist() == pytest.approx([-(0.5**0.5), 0.5**0.5])
    assert found["value_target"].flatten().tolist() == [1.0, 3.0]  # not scaled
