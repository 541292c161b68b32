import pytest
import torch
from tensordict import TensorDict

from drone_rl import objectives
from drone_rl.objectives import LeaveOneOut, RewardToGo, TimeBaseline, returns
from drone_rl.utils.errors import InputError


def batch(rewards, ends):
    reward = torch.tensor(rewards)[:, None]
    done = torch.tensor(ends, dtype=torch.bool)[:, None]
    return TensorDict({"next": {"reward": reward, "done": done}}, [len(rewards)])


NAMES = [n for n in objectives.__all__ if n not in ("ReinforceLoss", "ReturnEstimator")]


@pytest.mark.parametrize("name", NAMES)
def test_writes_returns_of_the_rewards_shape(name):
    data = getattr(objectives, name)()(batch([0.0, 1.0, 1.0], [0, 1, 1]))
    assert data["return_to_go"].shape == (3, 1)
    assert data["return_to_go"].isfinite().all()


def test_keys_can_be_chosen():
    estimator = RewardToGo(0.5, reward_key="r", done_key="d", out_key=("a", "b"))
    data = TensorDict({"r": torch.ones(2, 1), "d": torch.tensor([[False], [True]])}, [2])
    assert estimator(data)["a", "b"].flatten().tolist() == [1.5, 1.0]


def test_scale():
    data = LeaveOneOut(0.9, scale=True)(batch([0.0, 1.0, 1.0, 1.0], [0, 1, 0, 1]))
    assert float(data["return_to_go"].square().mean()) == pytest.approx(1.0)


def test_time_baseline_never_contains_the_episode_it_is_subtracted_from():
    estimator = TimeBaseline(0.5, decay=0.9, max_steps=4)
    data = batch([0.0, 2.0], [0, 1])
    assert estimator(data)["return_to_go"].flatten().tolist() == [1.0, 2.0]  # baseline was 0
    assert estimator.baseline.tolist() == [1.0, 2.0, 0.0, 0.0]  # first sight: the mean itself
    other = batch([0.0, 0.0, 4.0], [0, 0, 1])  # returns 1, 2, 4
    assert estimator(other)["return_to_go"].flatten().tolist() == [0.0, 0.0, 4.0]
    assert estimator.baseline.tolist() == [1.0, 2.0, 4.0, 0.0]
    estimator(batch([0.0, 4.0], [0, 1]))  # returns 2, 4: 0.9 old + 0.1 new
    torch.testing.assert_close(estimator.baseline, torch.tensor([1.1, 2.2, 4.0, 0.0]))


def test_time_baseline_resumes_from_its_state():
    first = TimeBaseline(0.5, max_steps=4)
    first(batch([0.0, 2.0], [0, 1]))
    second = TimeBaseline(0.5, max_steps=4)
    second.load_state_dict(first.state_dict())
    data = batch([1.0, 1.0], [0, 1])
    assert torch.equal(first(data.clone())["return_to_go"], second(data.clone())["return_to_go"])


def test_estimator_is_the_pure_function():
    data = batch([0.0, 1.0, 1.0], [0, 1, 1])
    expected = returns.reward_to_go(data["next", "reward"], data["next", "done"], 0.7)
    assert torch.equal(RewardToGo(0.7)(data)["return_to_go"], expected)


@pytest.mark.parametrize("gamma", [-0.1, 1.1])
def test_bad_discount_is_refused(gamma):
    with pytest.raises(InputError, match="rate from 0 to 1"):
        RewardToGo(gamma)


def test_bad_decay_is_refused():
    with pytest.raises(InputError, match=r"decay=1\.0"):
        TimeBaseline(decay=1.0)
