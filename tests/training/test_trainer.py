import signal

import pytest
import torch

from drone_rl.training import Callback, CheckpointCallback, NotANumberError, load_checkpoint
from drone_rl.training.metrics import batch_metrics, episode_rewards, running_mean


class At(Callback):
    """Does something after an update."""

    def __init__(self, update, action):
        self.update, self.action, self.metrics = update, action, []

    def on_update(self, trainer, metrics):
        self.metrics.append(metrics)
        if trainer.progress.updates == self.update:
            self.action(trainer)


def parameters(trainer):
    return torch.cat([p.detach().flatten() for p in trainer.network.parameters()])


def test_learns_the_bandit(make_trainer):
    trainer = make_trainer(total_frames=4000)
    before = trainer.network(torch.zeros(4)).softmax(-1)[1].item()
    assert trainer.run() == "frames"
    assert trainer.network(torch.zeros(4)).softmax(-1)[1].item() > before + 0.3


def test_same_seed_gives_the_same_parameters_byte_for_byte(make_trainer):
    first, second, other = make_trainer(), make_trainer(), make_trainer(1)
    for trainer in (first, second, other):
        trainer.run()
    assert torch.equal(parameters(first), parameters(second))
    assert not torch.equal(parameters(first), parameters(other))


def test_resumed_is_bit_for_bit_the_uninterrupted(make_trainer, tmp_path):
    whole = make_trainer(total_frames=400)
    whole.run()
    half = make_trainer(total_frames=150, callbacks=[CheckpointCallback(tmp_path)])
    half.run()
    torch.rand(17)  # somebody else draws in between
    resumed = make_trainer(seed=5, total_frames=400)
    resumed.load_state_dict(load_checkpoint(tmp_path / "last.pt"))
    assert resumed.progress.updates == half.progress.updates
    resumed.run()
    assert torch.equal(parameters(resumed), parameters(whole))
    assert resumed.progress.frames == whole.progress.frames
    assert resumed.progress.running_cubes == whole.progress.running_cubes
    lr = [t.optimiser.param_groups[0]["lr"] for t in (resumed, whole)]
    assert lr[0] == lr[1]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_saves_and_stops_after_the_update(make_trainer, tmp_path, number):
    before = signal.getsignal(number)
    kill = At(3, lambda _: signal.raise_signal(number))
    trainer = make_trainer(callbacks=[kill, CheckpointCallback(tmp_path)])
    assert trainer.run() == number.name
    assert trainer.progress.updates == 3
    assert load_checkpoint(tmp_path / "last.pt")["progress"]["updates"] == 3
    assert signal.getsignal(number) == before


def test_second_ctrl_c_aborts_at_once(make_trainer):
    def twice(_):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    # a process started in the background may have been told to ignore Ctrl-C
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            make_trainer(callbacks=[At(2, twice)]).run()
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("where", ["loss", "gradient"])
def test_nan_stops_names_itself_and_keeps_the_last_good_checkpoint(make_trainer, tmp_path, where):
    trainer = make_trainer(callbacks=[CheckpointCallback(tmp_path, interval_s=0.0)])
    good = []

    def poison(trainer):
        good.append(parameters(trainer).clone())
        if where == "loss":
            estimate = trainer.estimator.forward
            trainer.estimator.forward = lambda b: estimate(b).set(
                "return_to_go", torch.full_like(b["next", "reward"], float("nan"))
            )
        else:
            trainer.network.weight.register_hook(lambda g: g * float("inf"))

    trainer.callbacks.append(At(2, poison))
    name = "loss_actor" if where == "loss" else "gradient of weight"
    with pytest.raises(NotANumberError, match=f"{name} is NaN or infinite at update 3"):
        trainer.run()
    assert torch.equal(parameters(trainer), good[0])
    assert load_checkpoint(tmp_path / "last.pt")["progress"]["updates"] == 2


def test_stops_when_solved(make_trainer):
    trainer = make_trainer(target=0.5, running_decay=0.9, total_frames=100_000)
    assert trainer.run() == "solved"
    assert trainer.progress.running_cubes >= 0.5


def test_stops_at_episodes(make_trainer):
    trainer = make_trainer(total_episodes=16)
    assert trainer.run() == "episodes"
    assert trainer.progress.episodes == 16


@pytest.mark.parametrize("reduction", ["mean", "sum"])
def test_minibatches_add_up_to_the_whole_batch(make_trainer, reduction):
    gradients = []
    for size in (10_000, 3):
        trainer = make_trainer(minibatch_frames=size)
        trainer.loss.reduction = reduction
        batch = trainer.estimator(trainer.collector.collect())
        trainer.optimiser.step = lambda: None
        trainer._learn(batch)
        gradients.append(trainer.network.weight.grad.clone())
    torch.testing.assert_close(*gradients)


def test_metrics_of_an_update(make_trainer):
    at = At(-1, None)
    make_trainer(callbacks=[at], max_grad_norm=1e-3).run()
    names = {"train/cubes", "train/running_cubes", "train/length", "loss/loss_actor"}
    assert names | {"loss/entropy", "loss/grad_norm", "time/frames_per_second"} <= set(
        at.metrics[0]
    )


def test_running_mean_by_hand():
    assert running_mean(0.0, torch.tensor([1.0, 2.0]), 0.9) == pytest.approx(0.29)


def test_episode_rewards_and_batch_metrics_by_hand():
    from tensordict import TensorDict

    batch = TensorDict(
        {
            "next": {
                "reward": torch.tensor([0.0, 1.0, 1.0])[:, None],
                "done": torch.tensor([0, 1, 1]).bool()[:, None],
                "info": {"end_reason": torch.tensor([0, 2, 1])[:, None]},
            }
        },
        [3],
    )
    assert episode_rewards(batch).tolist() == [1.0, 1.0]
    assert batch_metrics(batch) == {
        "train/cubes": 1.0,
        "train/length": 1.5,
        "end/all_cubes": 0.5,
        "end/front_boundary": 0.5,
        "end/side_boundary": 0.0,
        "end/step_limit": 0.0,
    }
