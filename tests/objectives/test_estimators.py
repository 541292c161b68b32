import pytest
import torch
from tensordict import TensorDict

from drone_rl import objectives
from drone_rl.config.learning import Gae, Returns
from drone_rl.objectives import Advantages, ReturnEstimator, TimeBaseline, original_returns, returns
from drone_rl.utils.errors import InputError


def batch(rewards, ends):
    reward = torch.tensor(rewards)[:, None]
    done = torch.tensor(ends, dtype=torch.bool)[:, None]
    return TensorDict({"next": {"reward": reward, "done": done}}, [len(rewards)])


BUILT_IN = (v for v in Returns.registry.values() if v.__module__ == Returns.__module__)
NAMES = [variant.factory.__name__ for variant in BUILT_IN if variant is not Gae]


def test_time_baseline_excludes_the_current_batch():
    estimator = TimeBaseline(0.5, decay=0.9, max_steps=4, scale=False)
    data = batch([0.0, 2.0], [0, 1])
    assert estimator(data)["return_to_go"].flatten().tolist() == [1.0, 2.0]  # baseline was 0
    assert estimator.baseline.tolist() == [1.0, 2.0, 0.0, 0.0]  # the first batch sets the mean
    other = batch([0.0, 0.0, 4.0], [0, 0, 1])  # returns 1, 2, 4
    assert estimator(other)["return_to_go"].flatten().tolist() == [0.0, 0.0, 4.0]
    assert estimator.baseline.tolist() == [1.0, 2.0, 4.0, 0.0]
    estimator(batch([0.0, 4.0], [0, 1]))  # returns 2, 4: 0.9 old + 0.1 new
    torch.testing.assert_close(estimator.baseline, torch.tensor([1.1, 2.2, 4.0, 0.0]))


def test_time_baseline_resumes_from_its_state():
    first = TimeBaseline(0.5, max_steps=4, scale=False)
    first(batch([0.0, 2.0], [0, 1]))
    second = TimeBaseline(0.5, max_steps=4, scale=False)
    second.load_state_dict(first.state_dict())
    data = batch([1.0, 1.0], [0, 1])
    assert torch.equal(first(data.clone())["return_to_go"], second(data.clone())["return_to_go"])


def test_time_baseline_ignores_steps_beyond_max_steps():
    estimator = TimeBaseline(0.5, decay=0.5, max_steps=2, scale=False)
    long = batch([0.0, 0.0, 4.0], [0, 0, 1])  # returns 1, 2, 4
    assert estimator(long)["return_to_go"].flatten().tolist() == [1.0, 2.0, 4.0]
    assert estimator.baseline.tolist() == [1.0, 2.0] and estimator.seen.tolist() == [True, True]
    assert estimator(long)["return_to_go"].flatten().tolist() == [0.0, 0.0, 4.0]


PURE = {
    "TotalReward": lambda r, d: returns.total_reward(r, d),
    "RewardToGo": lambda r, d: returns.reward_to_go(r, d, 0.7),
    "Standardized": lambda r, d: original_returns.standardized(r, d, 0.7),
    "LinearRamp": lambda r, d: original_returns.linear_ramp(r, d),
    "SuccessScaled": lambda r, d: original_returns.success_scaled(r, d, 0.7, 2.0),
    "TimeBaseline": lambda r, d: original_returns.time_baseline(r, d, 0.7, torch.zeros(0)),
    "LeaveOneOut": lambda r, d: returns.leave_one_out(r, d, 0.7),
    "BatchNormalized": lambda r, d: returns.batch_normalized(r, d, 0.7),
}


@pytest.mark.parametrize("scale", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_estimator_equals_the_pure_function(name, scale):
    arguments = {} if name in ("TotalReward", "LinearRamp") else {"gamma": 0.7}
    if name == "SuccessScaled":
        arguments["max_reward"] = 2.0
    data = batch([0.0, 1.0, 1.0, 0.0, 0.0, 3.0], [0, 1, 1, 0, 0, 1])
    expected = PURE[name](data["next", "reward"], data["next", "done"])
    found = getattr(objectives, name)(scale=scale, **arguments)(data)["return_to_go"]
    assert torch.equal(found, returns.scale_to_unit(expected) if scale else expected)


@pytest.mark.parametrize(
    ("result", "fault"),
    [
        (lambda _: None, "None"),
        (lambda reward: reward[:, 0], r"a Tensor of shape \(2,\)"),
        (lambda reward: reward / 0.0, "NaN or infinity"),
    ],
)
def test_wrong_returns_of_an_estimator_of_ones_own_are_named(result, fault):
    class Own(ReturnEstimator):
        def estimate(self, reward, done):
            return result(reward)

    where = rf"Own of {__file__} returns {fault} for rewards of shape \(2, 1\); return a tensor"
    with pytest.raises(InputError, match=where):
        Own(scale=False)(batch([0.0, 1.0], [0, 1]))


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


def test_scaled_advantages_are_standardized():
    batch = row([0.0, 0.0], [0.0, 0.0], [1.0, 3.0], [1, 1], [1, 1])
    found = Advantages(GAMMA, LMBDA, scale=True)(batch)
    assert found["advantage"].flatten().tolist() == pytest.approx([-(0.5**0.5), 0.5**0.5])
    assert found["value_target"].flatten().tolist() == [1.0, 3.0]  # not scaled
