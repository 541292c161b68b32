"""Values at cuts, gradients and passes by hand; a state that is all there is."""

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
"""A picture is (value, something): the critic below says its first number."""
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
        optimiser = torch.optim.Adam(model.parameters(), lr=lr)
        return ActorCriticLearner(
            network=network,
            model=model,
            estimator=Advantages(GAMMA, LMBDA, scale),
            loss=kind(model.actor, model.critic, functional=False, **(loss or {})),
            optimiser=optimiser,
            generator=generator(2),
            scheduler=torch.optim.lr_scheduler.StepLR(optimiser, 1, 0.5),
            **kwargs,
        )

    return build


def pictures(values):
    """Of the given values, the second number their index. Shape: (*, 1, 1, 2)."""
    values = torch.tensor(values)
    other = torch.arange(values.numel()).reshape(values.shape) / 10
    return torch.stack([values, other], -1)[..., None, None, :]


@pytest.fixture
def batch():
    """Two rows: in the first an episode ends after 2 steps, in the second one is cut after 1."""
    done = torch.tensor([[0, 1, 0], [1, 0, 0]]).bool()[..., None]
    terminated = torch.tensor([[0, 1, 0], [0, 0, 0]]).bool()[..., None]
    following = {
        "pixels": pictures([[4.0, 7.0, 8.0], [6.0, 3.0, 5.0]]),
        "reward": torch.tensor([[0.0, 2.0, 1.0], [0.0, 1.0, 0.0]])[..., None],
        "done": done,
        "terminated": terminated,
    }
    seen = {"pixels": pictures([[1.0, 4.0, 2.0], [1.0, 2.0, 3.0]])}
    return TensorDict(
        {**seen, "action": torch.tensor([[0, 1, 2], [2, 1, 0]]), "next": following}, [2, 3]
    )


WANTED = [0.6, -2.0, 3.0, 2.0, 0.4, -0.5]
"""With d = r + 0.5 V(next) - V and weight 0.2 of the next one within the episode and the batch:
row 0: 0 + 2 - 1 - 0.2 * 2; 2 - 4 (it ends there); 1 + 4 - 2 (the batch ends there);
row 1: 0 + 3 - 1 (the time limit cuts it); 1 + 1.5 - 2 - 0.2 * 0.5; 0 + 2.5 - 3."""


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("chunk", [1, 4, 100])
def test_advantages_at_the_end_the_time_limit_and_the_end_of_the_batch(
    make_learner, batch, own, chunk
):
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
    learner.optimiser.zero_grad()
    learner._losses(steps.copy())[name].backward()
    return learner.network.layers[-1].weight.grad.clone()


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
def test_before_the_first_step_the_gradient_is_the_policys(make_learner, batch, kind):
    """-mean of A grad log p, with ratios of 1 (to p); for linear logits x (onehot - p)."""
    learner = make_learner(kind)
    steps = learner.estimate(batch).reshape(-1)
    x = batch["pixels"].reshape(6, 2)
    p = learner.network(batch["pixels"]).softmax(-1).reshape(6, 3).detach()
    push = torch.tensor(WANTED)[:, None] * (torch.eye(3)[batch["action"].flatten()] - p)
    torch.testing.assert_close(gradient(learner, steps), -(push.T @ x) / 6)


@pytest.mark.parametrize(("ratio", "is_clipped"), [(1.1, False), (1.3, True)])
def test_a_ratio_beyond_the_bound_teaches_nothing_more(make_learner, batch, ratio, is_clipped):
    learner = make_learner(loss={"clip_epsilon": 0.2})
    steps = learner.estimate(batch).reshape(-1)
    steps["action_log_prob"] = steps["action_log_prob"] - math.log(ratio)
    steps["advantage"] = torch.ones(6, 1)
    assert bool(gradient(learner, steps).abs().max() < 1e-6) is is_clipped
    steps["advantage"] = -torch.ones(6, 1)  # towards the bound it still does
    assert gradient(learner, steps).abs().max() > 1e-3


def test_values_may_be_clipped_too(make_learner, batch):
    """An option of TorchRL's loss, which compares with the values that an update begins with."""
    terms = []
    for most in (None, 0.01):
        learner = make_learner(loss={"clip_value": most}, epochs=4, lr=1.0)
        terms.append(learner.update(learner.estimate(batch))["loss/loss_critic"])
    assert terms[0] != pytest.approx(terms[1])


def passes(learner):
    """What the loss is given, in order."""
    seen, losses = [], learner._losses

    def spy(chunk):
        seen.append(chunk["pixels"][:, 0, 0].tolist())
        return losses(chunk)

    learner._losses = spy
    return seen


def test_one_step_of_all_for_a2c(make_learner, batch):
    learner = make_learner(A2CLoss)
    seen = passes(learner)
    learner.update(learner.estimate(batch))
    everything = sorted(batch["pixels"].reshape(6, 2).tolist())
    assert [sorted(pass_) for pass_ in seen] == [everything]


def test_every_pass_goes_through_every_step_once_in_an_order_of_its_own(make_learner, batch):
    learner = make_learner(epochs=3, minibatch_size=2)
    seen = passes(learner)
    learner.update(learner.estimate(batch))
    assert [len(minibatch) for minibatch in seen] == [2] * 9
    orders = [[x for minibatch in seen[i : i + 3] for x in minibatch] for i in (0, 3, 6)]
    everything = sorted(batch["pixels"].reshape(6, 2).tolist())
    assert [sorted(order) for order in orders] == [everything] * 3
    assert orders[0] != orders[1] != orders[2]


@pytest.mark.parametrize(("frames", "sizes"), [(4, [3, 3]), (5, [6]), (1, [1] * 6), (99, [6])])
def test_minibatches_are_of_about_the_size_and_alike(make_learner, batch, frames, sizes):
    learner = make_learner(minibatch_size=frames)
    seen = passes(learner)
    learner.update(learner.estimate(batch))
    assert [len(minibatch) for minibatch in seen] == sizes


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
def test_chunks_change_nothing(make_learner, batch, kind):
    learners = [make_learner(kind, chunk_frames=chunk) for chunk in (100, 2)]
    told = [learner.update(learner.estimate(batch)) for learner in learners]
    assert told[0] == pytest.approx(told[1], rel=1e-4, abs=1e-6)
    weights = [learner.network.layers[-1].weight for learner in learners]
    torch.testing.assert_close(*weights)


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
def test_what_is_told(make_learner, batch, kind):
    learner = make_learner(kind, max_grad_norm=1e-3)
    told = learner.update(learner.estimate(batch))
    names = {"loss/loss_objective", "loss/loss_critic", "loss/loss_entropy", "loss/entropy"}
    assert names | {"loss/grad_norm", "train/learning_rate"} <= set(told)
    assert ("loss/clip_fraction" in told) is (kind is ClipPPOLoss)
    assert told["train/learning_rate"] == 0.05  # of the next step
    assert told["loss/grad_norm"] > 1e-3  # as it was
    assert set(learner.update(learner.estimate(batch))) == set(told)


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
@pytest.mark.parametrize("own", [False, True])
def test_it_learns_what_to_do_and_what_that_is_worth(make_learner, kind, own):
    """One picture; action 2 earns 1 and the episode ends."""
    learner = make_learner(kind, own=own, scale=True, epochs=3)
    learner.scheduler = None
    look = pictures([0.0, 1.0, 2.0] * 8)[:, None]
    look[..., 0] = 1.0
    action = torch.arange(24)[:, None] % 3
    ends = torch.ones(24, 1, 1, dtype=torch.bool)
    reward = (action == 2).float()[..., None]
    following = {"pixels": look, "reward": reward, "done": ends, "terminated": ends}
    batch = TensorDict({"pixels": look, "action": action, "next": following}, [24, 1])
    for _ in range(60):
        learner.update(learner.estimate(batch))
    assert (learner.network(look).softmax(-1)[..., 2] > 0.9).all()
    value = learner._look(look[:, 0])["state_value"].detach()
    assert float(value.mean()) == pytest.approx(1 / 3, abs=0.1)  # of the batch that it was shown


def test_not_a_number_changes_nothing(make_learner, batch):
    """The third minibatch fails: the two steps before it are taken back."""
    learner = make_learner(epochs=2, minibatch_size=2)
    learner.update(learner.estimate(batch))
    before = copy.deepcopy(learner.state_dict())
    losses, calls = learner._losses, []

    def break_down(chunk):
        calls.append(chunk)
        found = losses(chunk)
        return found if len(calls) < 3 else found.apply(lambda value: value * float("nan"))

    learner._losses = break_down
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


def test_a_state_is_all_there_is(make_learner, batch):
    first, second = (make_learner(epochs=2, minibatch_size=2) for _ in range(2))
    first.update(first.estimate(batch))
    state = copy.deepcopy(first.state_dict())
    second.generator.manual_seed(99)
    second.check_state(state)
    second.load_state_dict(state)
    told = [learner.update(learner.estimate(batch)) for learner in (first, second)]
    assert told[0] == told[1]
    assert_same(first.state_dict(), second.state_dict())


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("policy", {"weight": torch.zeros(3, 2)}, "policy has other names"),
        ("critic", {"weight": torch.zeros(1, 2)}, "critic has other names"),
        (
            "critic",
            {"module.weight": torch.zeros(1, 3), "module.bias": torch.zeros(1)},
            r"critic\.module",
        ),
        ("optimiser", {}, "optimiser has other names"),
        ("scheduler", None, "scheduler has other names"),
        ("minibatches", torch.zeros(3), "minibatches is not of shape"),
    ],
)
def test_state_of_another_learner_is_refused(make_learner, part, value, message):
    learner = make_learner()
    with pytest.raises(InputError, match=message):
        learner.check_state({**learner.state_dict(), part: value})
    learner.check_state(learner.state_dict())


def test_a_batch_without_next_observations_or_estimates(make_learner, batch):
    learner = make_learner()
    with pytest.raises(InputError, match="no entry 'action_log_prob'"):
        check_batch(batch, learner)
    check_batch(learner.estimate(batch), learner)
    del batch["next", "pixels"]
    message = r"no entry \('next', 'pixels'\), .* such as collector=rollouts$"
    with pytest.raises(InputError, match=message):
        learner.estimate(batch)
