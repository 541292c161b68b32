"""One optimizer step for each batch, independent of the minibatch size."""

import pytest
import torch
from tensordict import TensorDict
from torch import nn

from drone_rl.objectives import TimeBaseline
from drone_rl.training.learners import NotANumberError, add_gradients, descend


@pytest.mark.parametrize("reduction", ["mean", "sum", "episode_mean"])
def test_minibatch_gradients_sum_to_the_batch_gradient(make_trainer, reduction):
    gradients = []
    for size in (10_000, 3):
        trainer = make_trainer(chunk_frames=size)
        learner = trainer.learner
        learner.loss.reduction = reduction
        learner.optimizer.step, learner.scheduler = lambda: None, None
        learner.update(trainer.collector.collect())
        gradients.append(learner.network.weight.grad.clone())
    torch.testing.assert_close(*gradients)


def test_sgd_step_matches_the_hand_computed_one(make_trainer):
    """One frame with return 2: the gradient of -2 log p(a) is 2 (p - onehot(a))."""
    learner = make_trainer().learner
    learner.optimizer = torch.optim.SGD(learner.network.parameters(), lr=0.5)
    learner.scheduler = None
    frame = torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    before = learner.network.bias.detach().clone()
    p = learner.network(frame).softmax(-1)[0].detach()
    batch = make_trainer().collector.collect()[:1]
    batch.update({"pixels": frame, "action": torch.tensor([1])})
    batch["return_to_go"] = torch.tensor([[2.0]])
    metrics = learner.update(batch)
    step = -0.5 * 2 * (p - torch.tensor([0.0, 1.0]))
    torch.testing.assert_close(learner.network.bias.detach() - before, step)
    assert metrics["loss/loss_actor"] == pytest.approx(float(-2 * p[1].log()))
    assert metrics["train/learning_rate"] == 0.5


def test_masked_steps_do_not_change_the_update(make_trainer):
    """In two rows of 3 steps, 2 steps have no known return; the update uses the other 4."""
    weights = []
    for pieces in (True, False):
        learner = make_trainer(chunk_frames=2).learner
        pixels = torch.arange(24.0).reshape(6, 4) / 24
        done = torch.tensor([0, 0, 1, 1, 0, 0]).bool()[:, None]
        reward = torch.tensor([0.0, 1.0, 1.0, 3.0, 5.0, 7.0])[:, None]
        batch = TensorDict(
            {
                "pixels": pixels,
                "action": torch.tensor([0, 1, 1, 0, 1, 0]),
                "next": {"reward": reward, "done": done},
            },
            [6],
        )
        estimator = TimeBaseline(0.9, max_steps=4)
        learner.update(estimator(batch.reshape(2, 3) if pieces else batch[:4]))
        weights.append(learner.network.weight.detach().clone())
    assert torch.equal(*weights)


X = torch.tensor([[1.0], [2.0], [6.0]])


def squares(layer, reduce=torch.mean):
    """Return the loss (w x)^2 and a metric."""

    def losses(chunk):
        value = reduce(layer(chunk["x"]).square())
        return TensorDict({"loss_square": value, "mean": chunk["x"].mean()}, [])

    return losses


def one_weight(value=1.0):
    layer = nn.Linear(1, 1, bias=False)
    nn.init.constant_(layer.weight, value)
    return layer


@pytest.mark.parametrize("chunk", [1, 2, 3, 100])
@pytest.mark.parametrize(("is_sum", "wanted"), [(False, 41 / 3), (True, 41.0)])
def test_gradient_and_terms_match_hand_computed_values(chunk, is_sum, wanted):
    """1 + 4 + 36 = 41; the gradient of w^2 s at w = 1 is 2 s."""
    layer = one_weight()
    losses = squares(layer, torch.sum if is_sum else torch.mean)
    divisor = (lambda _: 1) if is_sum else len
    terms = add_gradients(TensorDict({"x": X}, [3]), losses, chunk, divisor)
    assert terms == {"loss_square": pytest.approx(wanted), "mean": pytest.approx(3.0)}
    assert float(layer.weight.grad) == pytest.approx(2 * wanted)


@pytest.mark.parametrize(("most", "step"), [(None, 6.0), (10.0, 6.0), (1.5, 1.5)])
def test_gradient_norm_is_clipped(most, step):
    layer = one_weight()
    layer.weight.grad = torch.tensor([[6.0]])
    optimizer = torch.optim.SGD(layer.parameters(), lr=1.0)
    assert descend(optimizer, layer.named_parameters(), most) == pytest.approx(6.0)
    assert float(layer.weight.detach()) == pytest.approx(1.0 - step)


def test_nan_gradient_raises_without_a_step():
    layer = one_weight(float("nan"))
    with pytest.raises(NotANumberError, match=r"^loss_square is NaN"):
        add_gradients(TensorDict({"x": X}, [3]), squares(layer), 2)
    layer = one_weight()
    layer.weight.grad = torch.tensor([[float("inf")]])
    with pytest.raises(NotANumberError, match=r"^the gradient of weight is NaN or infinite"):
        descend(torch.optim.SGD(layer.parameters(), lr=1.0), layer.named_parameters(), None)
    assert float(layer.weight.detach()) == 1.0
