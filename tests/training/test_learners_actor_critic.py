"""Hand-computed advantages, gradients and epochs of the actor-critic learner, and its state."""

import copy
import math

import pytest
import torch
from tensordict import TensorDict
from torch import nn
from torchrl.objectives import A2CLoss, ClipPPOLoss

from drone_rl.objectives import Advantages
from drone_rl.policies import MLP, ActorCritic
from drone_rl.training import ActorCriticLearner, NotANumberError
from drone_rl.training.learners import check_batch
from drone_rl.utils.errors import InputError

SHAPE = (1, 1, 2)
"""An observation is (value, index); the critic below returns its first number."""
GAMMA, LMBDA = 0.5, 0.4


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture
def make_learner():
    def build(kind=ClipPPOLoss, *, own=False, scale=False, lr=0.1, loss=None, **kwargs):
        network = MLP(SHAPE, 3, hidden=(), generator=generator())
        nn.init.normal_(network.layers[-1].weight, generator=generator(1))
        critic = MLP(SHAPE, 1, hidden=(), generator=generator()) if own else None
        model = ActorCritic(network, critic, generator())
        with torch.no_grad():
            for parameter in model.critic.parameters():
                parameter.copy_(torch.eye(*parameter.shape) if parameter.ndim == 2 else 0.0)
        optimizer = torch.optim.Adam(model.parameters(), lr=lr)
        return ActorCriticLearner(
            network=network,
            model=model,
            estimator=Advantages(GAMMA, LMBDA, scale),
            loss=kind(model.actor, model.critic, functional=False, **(loss or {})),
            optimizer=optimizer,
            generator=generator(2),
            scheduler=torch.optim.lr_scheduler.StepLR(optimizer, 1, 0.5),
            **kwargs,
        )

    return build


def observations(values):
    """Return observations with these values and their indices. Shape: (*, 1, 1, 2)."""
    values = torch.tensor(values)
    other = torch.arange(values.numel()).reshape(values.shape) / 10
    return torch.stack([values, other], -1)[..., None, None, :]


@pytest.fixture
def batch():
    """Return two rows: a termination after 2 steps, and a truncation after 1 step."""
    done = torch.tensor([[0, 1, 0], [1, 0, 0]]).bool()[..., None]
    terminated = torch.tensor([[0, 1, 0], [0, 0, 0]]).bool()[..., None]
    following = {
        "pixels": observations([[4.0, 7.0, 8.0], [6.0, 3.0, 5.0]]),
        "reward": torch.tensor([[0.0, 2.0, 1.0], [0.0, 1.0, 0.0]])[..., None],
        "done": done,
        "terminated": terminated,
    }
    seen = {"pixels": observations([[1.0, 4.0, 2.0], [1.0, 2.0, 3.0]])}
    return TensorDict(
        {**seen, "action": torch.tensor([[0, 1, 2], [2, 1, 0]]), "next": following}, [2, 3]
    )


WANTED = [0.6, -2.0, 3.0, 2.0, 0.4, -0.5]
"""With d = r + 0.5 V(next) - V and weight 0.2 of the next one within the episode and the batch:
row 0: 0 + 2 - 1 - 0.2 * 2; 2 - 4 (terminated); 1 + 4 - 2 (end of the batch);
row 1: 0 + 3 - 1 (truncated); 1 + 1.5 - 2 - 0.2 * 0.5; 0 + 2.5 - 3."""


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("chunk", [1, 4, 100])
def test_advantages_at_termination_truncation_and_batch_end(make_learner, batch, own, chunk):
    learner = make_learner(own=own, chunk_frames=chunk)
    steps = learner.estimate(batch)
    assert steps["advantage"].flatten().tolist() == pytest.approx(WANTED)
    values = [1.0, 4.0, 2.0, 1.0, 2.0, 3.0]
    targets = [a + v for a, v in zip(WANTED, values, strict=True)]
    assert steps["value_target"].flatten().tolist() == pytest.approx(targets)
    chances = learner.network(batch["pixels"]).log_softmax(-1).detach()
    taken = chances.gather(-1, batch["action"][..., None]).flatten()
    torch.testing.assert_close(steps["action_log_prob"].flatten(), taken)
    assert float(steps["entropy"].mean()) == pytest.approx(
        float(-(chances.exp() * chances).sum(-1).mean())
    )


def gradient(learner, steps, name="loss_objective"):
    learner.optimizer.zero_grad()
    learner._losses(steps.copy())[name].backward()
    return learner.network.layers[-1].weight.grad.clone()


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
def test_gradient_before_the_first_step_is_the_policy_gradient(make_learner, batch, kind):
    """It is -mean(A grad log p), as all ratios are 1; for linear logits, x (onehot - p)."""
    learner = make_learner(kind)
    steps = learner.estimate(batch).reshape(-1)
    x = batch["pixels"].reshape(6, 2)
    p = learner.network(batch["pixels"]).softmax(-1).reshape(6, 3).detach()
    push = torch.tensor(WANTED)[:, None] * (torch.eye(3)[batch["action"].flatten()] - p)
    torch.testing.assert_close(gradient(learner, steps), -(push.T @ x) / 6)


@pytest.mark.parametrize(("ratio", "is_clipped"), [(1.1, False), (1.3, True)])
def test_clipped_ratios_have_no_gradient(make_learner, batch, ratio, is_clipped):
    learner = make_learner(loss={"clip_epsilon": 0.2})
    steps = learner.estimate(batch).reshape(-1)
    steps["action_log_prob"] = steps["action_log_prob"] - math.log(ratio)
    steps["advantage"] = torch.ones(6, 1)
    assert bool(gradient(learner, steps).abs().max() < 1e-6) is is_clipped
    steps["advantage"] = -torch.ones(6, 1)  # a step towards the bound has a gradient
    assert gradient(learner, steps).abs().max() > 1e-3


def record_chunks(learner):
    """Record the chunks that the loss receives, in order."""
    seen, losses = [], learner._losses

    def spy(chunk):
        seen.append(chunk["pixels"][:, 0, 0].tolist())
        return losses(chunk)

    learner._losses = spy
    return seen


def test_every_epoch_visits_every_step_once_in_a_new_order(make_learner, batch):
    learner = make_learner(epochs=3, minibatch_size=2)
    seen = record_chunks(learner)
    learner.update(learner.estimate(batch))
    assert [len(minibatch) for minibatch in seen] == [2] * 9
    orders = [[x for minibatch in seen[i : i + 3] for x in minibatch] for i in (0, 3, 6)]
    everything = sorted(batch["pixels"].reshape(6, 2).tolist())
    assert [sorted(order) for order in orders] == [everything] * 3
    assert orders[0] != orders[1] != orders[2]


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
def test_chunk_size_does_not_change_the_update(make_learner, batch, kind):
    learners = [make_learner(kind, chunk_frames=chunk) for chunk in (100, 2)]
    metrics = [learner.update(learner.estimate(batch)) for learner in learners]
    assert metrics[0] == pytest.approx(metrics[1], rel=1e-4, abs=1e-6)
    weights = [learner.network.layers[-1].weight for learner in learners]
    torch.testing.assert_close(*weights)


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
@pytest.mark.parametrize("own", [False, True])
def test_learns_policy_and_value(make_learner, kind, own):
    """One observation; action 2 has reward 1 and the episode ends."""
    learner = make_learner(kind, own=own, scale=True, epochs=3)
    learner.scheduler = None
    look = observations([0.0, 1.0, 2.0] * 8)[:, None]
    look[..., 0] = 1.0
    action = torch.arange(24)[:, None] % 3
    ends = torch.ones(24, 1, 1, dtype=torch.bool)
    reward = (action == 2).float()[..., None]
    following = {"pixels": look, "reward": reward, "done": ends, "terminated": ends}
    batch = TensorDict({"pixels": look, "action": action, "next": following}, [24, 1])
    for _ in range(60):
        learner.update(learner.estimate(batch))
    assert (learner.network(look).softmax(-1)[..., 2] > 0.9).all()
    value = learner._evaluate(TensorDict({"pixels": look[:, 0]}, [len(look)]))[
        "state_value"
    ].detach()
    assert float(value.mean()) == pytest.approx(1 / 3, abs=0.1)  # mean reward of the batch


def test_nan_restores_the_state_before_the_update(make_learner, batch):
    """The third minibatch fails, so the two steps before it are undone."""
    learner = make_learner(epochs=2, minibatch_size=2)
    learner.update(learner.estimate(batch))
    before = copy.deepcopy(learner.state_dict())
    losses, calls = learner._losses, []

    def fail(chunk):
        calls.append(chunk)
        found = losses(chunk)
        return found if len(calls) < 3 else found.apply(lambda value: value * float("nan"))

    learner._losses = fail
    with pytest.raises(NotANumberError, match="is NaN or infinite"):
        learner.update(learner.estimate(batch))
    assert len(calls) == 3
    assert_same(learner.state_dict(), before)


def assert_same(one, two):
    assert type(one) is type(two) or isinstance(one, dict)
    if isinstance(one, torch.Tensor):
        assert torch.equal(one, two)
    elif isinstance(one, dict):
        assert one.keys() == two.keys()
        for key in one:
            assert_same(one[key], two[key])
    elif isinstance(one, list | tuple):
        for a, b in zip(one, two, strict=True):
            assert_same(a, b)
    else:
        assert one == two


def test_missing_entries_raise(make_learner, batch):
    learner = make_learner()
    with pytest.raises(InputError, match="no entry 'action_log_prob'"):
        check_batch(batch, learner.in_keys, "ActorCriticLearner")
    check_batch(learner.estimate(batch), learner.in_keys, "ActorCriticLearner")
    del batch["next", "pixels"]
    message = r"no entry \('next', 'pixels'\), .* such as collector=rollouts$"
    with pytest.raises(InputError, match=message):
        learner.estimate(batch)
