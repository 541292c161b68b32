import pytest
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torch import nn
from torchrl.data import Categorical
from torchrl.modules import ProbabilisticActor

from drone_rl.objectives import ReinforceLoss, original_returns
from drone_rl.policies.actor import RandomSource, SeededCategorical
from drone_rl.utils.errors import InputError


class Linear(nn.Module):
    """Two logits, linear in the observation (Eq. 1)."""

    def __init__(self, features=2):
        super().__init__()
        self.theta = nn.Parameter(torch.zeros(features, 2))

    def forward(self, observation):
        return observation @ self.theta


def make(features=2, seed=0, in_key="observation"):
    network = Linear(features)
    actor = ProbabilisticActor(
        TensorDictModule(network, in_keys=[in_key], out_keys=["logits"]),
        in_keys=["logits"],
        spec=Categorical(2),
        distribution_class=SeededCategorical,
        distribution_kwargs={"source": RandomSource(torch.Generator().manual_seed(seed))},
        default_interaction_type="random",
    )
    return network, actor


def make_batch(n=6, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return TensorDict(
        {
            "observation": torch.randn(n, 2, generator=generator),
            "action": torch.randint(2, (n,), generator=generator),
            "return_to_go": torch.randn(n, 1, generator=generator),
            "next": {"done": torch.ones(n, 1, dtype=torch.bool)},
        },
        [n],
    )


def gradient(loss, network, batch):
    network.zero_grad()
    losses = loss(batch)
    sum(v for k, v in losses.items() if k.startswith("loss_")).backward()
    return network.theta.grad.clone()


def test_gradient_equals_the_analytic_one_of_a_linear_policy():
    """d/dtheta[:, b] of log pi(a|s) is s (1[a = b] - pi(b|s))."""
    network, actor = make()
    with torch.no_grad():
        network.theta.copy_(torch.tensor([[0.3, -0.2], [0.1, 0.4]]))
    batch = make_batch()
    probabilities = (batch["observation"] @ network.theta.detach()).softmax(-1)
    chosen = nn.functional.one_hot(batch["action"], 2)
    weighted = (chosen - probabilities) * batch["return_to_go"]
    expected = -(batch["observation"].T @ weighted) / len(batch)
    torch.testing.assert_close(
        gradient(ReinforceLoss(actor, entropy_coeff=0.0), network, batch), expected
    )


def test_algorithm_4_matches_a_hand_computed_step():
    """Rewards 0, 0, 1, discount 1/2: g = 1/4, 1/2, 1; mean 7/12, deviation sqrt(14)/12.

    With theta = 0 both actions have probability 1/2, so the gradient of log pi(a) with respect to
    the logits is +-1/2, and theta moves by alpha g_t (1[a_t = b] - 1/2) s_t.
    """
    network, actor = make(features=1)
    reward = torch.tensor([[0.0], [0.0], [1.0]])
    done = torch.tensor([[False], [False], [True]])
    normalised = original_returns.standardized(reward, done, 0.5)
    root = 14**0.5
    torch.testing.assert_close(normalised[:, 0], torch.tensor([-4 / root, -1 / root, 5 / root]))
    batch = TensorDict(
        {
            "observation": torch.ones(3, 1),
            "action": torch.tensor([0, 0, 1]),
            "return_to_go": normalised,
        },
        [3],
    )
    optimizer = torch.optim.SGD(network.parameters(), lr=0.1)
    gradient(ReinforceLoss(actor, reduction="sum", entropy_coeff=0.0), network, batch)
    optimizer.step()
    step = 0.1 * 0.5 * (-4 - 1 - 5) / root
    torch.testing.assert_close(network.theta.detach(), torch.tensor([[step, -step]]))


def test_values_match_hand_computed_ones():
    """-log pi is log 2 at every step; returns are 1, 2, 3, so the sum is 6 log 2."""
    _, actor = make()
    batch = make_batch(3)
    batch["return_to_go"] = torch.tensor([[1.0], [2.0], [3.0]])
    log2 = torch.tensor(2.0).log().item()

    def loss(**kwargs):
        return ReinforceLoss(actor, **kwargs)(batch)

    assert float(loss()["loss_actor"].detach()) == pytest.approx(2 * log2)
    assert float(loss(reduction="sum")["loss_actor"].detach()) == pytest.approx(6 * log2)
    batch["next", "done"] = torch.tensor([[False], [True], [True]])
    averaged = loss(reduction="episode_mean", entropy_coeff=1.0)
    assert float(averaged["loss_actor"].detach()) == pytest.approx(6 / 2 * log2)
    assert float(averaged["loss_entropy"].detach()) == pytest.approx(-3 / 2 * log2)
    each = loss(reduction="none", entropy_coeff=0.5)
    assert each["loss_actor"].tolist() == pytest.approx([log2, 2 * log2, 3 * log2])
    assert each["loss_entropy"].tolist() == pytest.approx([-0.5 * log2] * 3)
    assert float(loss(entropy_coeff=0.0)["loss_entropy"].detach()) == 0.0
    assert float(loss()["entropy"]) == pytest.approx(log2)


def test_a_batch_in_which_no_episode_ends_is_divided_by_one():
    _, actor = make()
    batch = make_batch(3)
    batch["next", "done"] = torch.zeros(3, 1, dtype=torch.bool)
    summed, averaged = (ReinforceLoss(actor, reduction=r) for r in ("sum", "episode_mean"))
    assert torch.equal(averaged(batch)["loss_actor"], summed(batch)["loss_actor"])
    assert [averaged.divisor(batch), summed.divisor(batch)] == [1, 1]
    assert ("next", "done") in averaged.in_keys and ("next", "done") not in summed.in_keys


def test_returns_are_detached():
    network, actor = make()
    batch = make_batch()
    plain = gradient(ReinforceLoss(actor, entropy_coeff=0.0), network, batch)
    batch["return_to_go"] = batch["return_to_go"].clone().requires_grad_()
    assert torch.equal(gradient(ReinforceLoss(actor, entropy_coeff=0.0), network, batch), plain)
    assert batch["return_to_go"].grad is None


def test_masked_loss_equals_sliced_loss():
    network, actor = make()
    batch = make_batch()
    mask = torch.tensor([True, True, False, True, False, True])
    masked = batch.clone().set(("collector", "mask"), mask)
    loss = ReinforceLoss(actor, entropy_coeff=0.0)
    torch.testing.assert_close(
        gradient(loss, network, masked), gradient(loss, network, batch[mask])
    )


def test_invalid_arguments_raise():
    _, actor = make()
    with pytest.raises(InputError, match="mean, sum, episode_mean or none"):
        ReinforceLoss(actor, reduction="median")
    with pytest.raises(InputError, match="entropy_coeff=-1"):
        ReinforceLoss(actor, entropy_coeff=-1)
