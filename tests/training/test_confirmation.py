"""A policy must solve the task with its most probable actions."""

import pytest
import torch

import drone_rl
from drone_rl.config import TaskSettings
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.policies import MLP
from drone_rl.training import confirmation as confirming
from drone_rl.training.confirmation import Confirmation
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import Stream

SETTINGS = TrainSettings(
    task=TaskSettings(num_cubes=1, first_distance=5.0, lateral_bound=3.0, step_limit=20),
    trainer=TrainerSettings(confirm_episodes=40),
    seed=3,
)


def always(*logits):
    network = MLP((1, 25, 64), 3, hidden=(4,))
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.bias.copy_(torch.tensor(logits))
    return network


def test_confirmation_uses_the_most_probable_action():
    ahead = SETTINGS.replace(task=SETTINGS.task.replace(lateral_bound=0.5))
    straight = Confirmation(ahead, always(0.02, 0.01, 0.0))
    assert straight(1)
    names = ("confirming_attempts", "confirming_flights", "confirming_flights_succeeded")
    assert straight.result == dict(zip(names, (1, 40, 40), strict=True))
    confirmation = Confirmation(ahead, always(0.01, 0.02, 0.0))  # samples may reach it
    assert confirmation.result == dict.fromkeys(names, 0)
    assert not confirmation(1) and not confirmation(2)
    assert confirmation.result == dict(zip(names, (2, 40, 0), strict=True))


def test_each_update_confirms_in_new_environments(monkeypatch):
    calls, run = [], confirming.end_reasons

    def note(actor, env, episodes):
        base = env.base_env
        base.reset()
        calls.append(
            (
                base.stream,
                base.first_world,
                len(base.worlds.state),
                base.worlds.state.places.clone(),
            )
        )
        base.set_seed(SETTINGS.seed)
        return run(actor, env, episodes)

    monkeypatch.setattr(confirming, "end_reasons", note)
    confirmation = Confirmation(SETTINGS, always(1.0, 0.0, 0.0))
    shares = [(confirmation(update), confirmation.succeeded)[1] for update in (1, 1, 2)]
    assert shares[0] == shares[1]
    assert [a[:3] for a in calls] == [(Stream.CONFIRMATION, n, 40) for n in (250, 250, 500)]
    assert torch.equal(calls[0][3], calls[1][3]) and not torch.equal(calls[0][3], calls[2][3])


@pytest.mark.parametrize(("episodes", "reason"), [(0, "solved"), (8, "frames")])
def test_training_continues_until_confirmed(tmp_path, episodes, reason):
    """The first reward meets the threshold, so only confirmation can continue the training."""
    trainer = SETTINGS.trainer.replace(
        total_frames=400, target_share=1e-3, confirm_episodes=episodes
    )
    collector = SETTINGS.collector.replace(num_envs=4)
    optimizer = SETTINGS.optimizer.replace(lr=1e-9)
    settings = SETTINGS.replace(trainer=trainer, collector=collector, optimizer=optimizer)
    done = drone_rl.train(settings, folder=tmp_path / "run", progress=silent)
    assert done.reason == reason
    assert done.result.confirming_flights == episodes
