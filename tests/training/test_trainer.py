import signal

import pytest
import torch

from drone_rl.training import Callback, CheckpointCallback, NotANumberError, signals
from drone_rl.training.metrics import episode_rewards, running_mean
from drone_rl.utils.checkpoint import load_checkpoint
from drone_rl.utils.errors import InputError
from tests.training_loop import run


class At(Callback):
    """Call a function after an update."""

    def __init__(self, update, action):
        self.update, self.action, self.metrics = update, action, []

    def on_update(self, trainer, metrics):
        self.metrics.append(metrics)
        if trainer.progress.updates == self.update:
            self.action(trainer)


def parameters(trainer):
    return torch.cat([p.detach().flatten() for p in trainer.learner.network.parameters()])


def test_learns_the_bandit(make_trainer):
    trainer = make_trainer(total_frames=4000)
    before = trainer.learner.network(torch.zeros(4)).softmax(-1)[1].item()
    assert run(trainer) == "frames"
    assert trainer.learner.network(torch.zeros(4)).softmax(-1)[1].item() > before + 0.3


def test_seed_determines_parameters_bit_for_bit(make_trainer):
    first, second, other = make_trainer(), make_trainer(), make_trainer(1)
    for trainer in (first, second, other):
        run(trainer)
    assert torch.equal(parameters(first), parameters(second))
    assert not torch.equal(parameters(first), parameters(other))


class Terminated(BaseException):
    """Raised by the handler of SIGTERM that the caller of a training had set."""


@pytest.fixture
def sigterm_raises():
    def stop(*_):
        raise Terminated

    before = signal.signal(signal.SIGTERM, stop)
    yield
    signal.signal(signal.SIGTERM, before)


def test_sigterm_of_a_cluster_and_of_its_sweep_lets_the_update_finish(make_trainer, sigterm_raises):
    def twice(_):
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)

    trainer = make_trainer(callbacks=[At(2, twice)])
    assert run(trainer) == "SIGTERM"
    assert trainer.progress.updates == 2


def test_a_later_sigterm_aborts_at_once(make_trainer, sigterm_raises, monkeypatch):
    def twice(_):
        signal.raise_signal(signal.SIGTERM)
        monkeypatch.setattr(signals, "_REPEAT_S", -1.0)
        signal.raise_signal(signal.SIGTERM)

    with pytest.raises(Terminated):
        run(make_trainer(callbacks=[At(2, twice)]))


def test_second_ctrl_c_aborts_at_once(make_trainer):
    def twice(_):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    # a background process may ignore Ctrl-C
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run(make_trainer(callbacks=[At(2, twice)]))
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("where", ["loss", "gradient"])
def test_nan_stops_and_keeps_the_last_good_checkpoint(make_trainer, tmp_path, where):
    trainer = make_trainer(callbacks=[CheckpointCallback(tmp_path, interval_s=0.0)])
    good = []

    def poison(trainer):
        good.append(parameters(trainer).clone())
        if where == "loss":
            estimate = trainer.collector.postproc
            trainer.collector.postproc = lambda b: estimate(b).set(
                "return_to_go", torch.full_like(b["next", "reward"], float("nan"))
            )
        else:
            trainer.learner.network.weight.register_hook(lambda g: g * float("inf"))

    trainer.callbacks.append(At(2, poison))
    name = "loss_actor" if where == "loss" else "gradient of weight"
    with pytest.raises(NotANumberError, match=f"{name} is NaN or infinite at update 3"):
        run(trainer)
    assert torch.equal(parameters(trainer), good[0])
    assert load_checkpoint(tmp_path / "last.pt")["progress"]["updates"] == 2


def test_training_is_solved_only_after_confirmation(make_trainer):
    calls = []

    def confirm(update):
        calls.append(update)
        return len(calls) == 3

    trainer = make_trainer(target=0.5, running_decay=0.9, total_frames=100_000)
    run(trainer)
    first = trainer.progress.updates
    trainer = make_trainer(target=0.5, running_decay=0.9, total_frames=100_000)
    trainer.confirm = confirm
    assert run(trainer) == "solved"
    assert calls[0] == first and calls[2] == trainer.progress.updates
    assert calls == sorted(set(calls)) and trainer.progress.running_reward >= 0.5
    calls.clear()
    trainer = make_trainer(target=0.5, running_decay=0.9, total_frames=100_000)
    trainer.confirm, trainer.confirm_interval = confirm, 7
    assert run(trainer) == "solved"
    assert calls[0] >= first and [n % 7 for n in calls] == [0, 0, 0]


def test_without_a_target_confirmations_at_intervals_decide(make_trainer):
    calls = []
    trainer = make_trainer(target=None, total_frames=100_000)
    trainer.confirm, trainer.confirm_interval = lambda n: calls.append(n) or len(calls) == 3, 5
    assert run(trainer) == "solved" and calls == [5, 10, 15]


def test_stops_at_episodes(make_trainer):
    trainer = make_trainer(total_episodes=16)
    assert run(trainer) == "episodes"
    assert trainer.progress.episodes == 16


def test_progress_counts_frames_and_episodes(make_trainer):
    trainer, batches = make_trainer(total_frames=100), []
    collect = trainer.collector.collect
    trainer.collector.collect = lambda: batches.append(collect()) or batches[-1]
    assert run(trainer) == "frames"
    progress = trainer.progress
    assert progress.updates == len(batches) and progress.frames == sum(len(b) for b in batches)
    assert progress.frames - len(batches[-1]) < 100 <= progress.frames
    assert progress.episodes == sum(int(b["next", "done"].sum()) for b in batches)
    mean = 0.0
    for batch in batches:
        mean = running_mean(mean, episode_rewards(batch), 0.99)
    assert progress.running_reward == mean
    assert progress.seconds > 0


@pytest.mark.parametrize("reward", [torch.nan, 3e38])
def test_rewards_that_overflow_end_the_training(make_trainer, reward):
    trainer = make_trainer()
    batch = next(iter(trainer.collector))
    batch["next", "reward"].fill_(reward)
    batch["next", "episode_reward"] = batch["next", "reward"] * 2.0  # in float32
    trainer.collector = [batch]
    with pytest.raises(InputError, match="the reward of an episode is NaN or infinite"):
        run(trainer)
    assert trainer.progress.updates == 0
