"""Trainings in two threads of one process, and what a training leaves behind."""

import os
import random
import threading
from collections import OrderedDict

import numpy as np
import pytest
import torch
from torch import nn
from torchrl.envs.utils import exploration_type
from torchrl.modules.tensordict_module.rnn import recurrent_mode

import drone_rl
from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.config.learning import Episodes, Ppo, Rollouts
from drone_rl.config.networks import Lstm, SmallCnn
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.networks import orthogonal

TINY = TrainSettings(
    task=TaskSettings(num_cubes=1),
    camera=CameraSettings(height=16, width=24),
    network=SmallCnn(channels=(4,), hidden=(8,)),
    collector=Episodes(num_envs=6),
    evaluate_after=0,
    trainer=TrainerSettings(
        total_frames=250, target_share=0.01, confirm_episodes=5, confirm_share=1.0
    ),
)
PPO = Ppo(num_steps=8, minibatch_size=24)
VARIANTS = {
    "fused": {},
    "recurrent": {"network": Lstm(channels=(4,), hidden=(8,), memory=4)},
    "ppo": {
        "objective": PPO,
        "returns": PPO.needs["returns"],
        "collector": Rollouts(num_envs=6, num_threads=2),
    },
}


def weights(settings, folder, seed):
    training = drone_rl.train(
        settings.replace(seed=seed), folder=folder / str(seed), progress=lambda *_: None
    )
    return training.policy.make_network().state_dict()


def process_state():
    counts = []
    thread = threading.Thread(target=lambda: counts.append(torch.get_num_threads()))
    thread.start()
    thread.join()
    return (
        torch.get_rng_state().tolist(),
        str(np.random.get_state()),
        random.getstate(),
        (torch.get_num_threads(), *counts),
        exploration_type(),
        dict(os.environ),
        recurrent_mode(),
    )


def check_two_at_once(settings, tmp_path):
    before = process_state()
    alone = {seed: weights(settings, tmp_path / "alone", seed) for seed in (0, 1)}
    assert process_state() == before
    together = {}

    def work(seed):
        together[seed] = weights(settings, tmp_path / "together", seed)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for seed in (0, 1):
        assert alone[seed].keys() == together[seed].keys()
        assert all(torch.equal(alone[seed][name], together[seed][name]) for name in alone[seed])
    assert process_state() == before


@pytest.mark.parametrize("variant", VARIANTS)
def test_two_trainings_at_once_equal_each_alone(variant, tmp_path):
    check_two_at_once(TINY.replace(**VARIANTS[variant]), tmp_path)


def test_two_trainings_with_dropout_at_once_equal_each_alone(registered, tmp_path):
    @registered
    @drone_rl.register_network("with_dropout")
    class WithDropout(PolicyNetwork):
        def __init__(self, in_shape, num_actions, *, size: int = 8, generator=None):
            layers = OrderedDict(
                flatten=nn.Flatten(),
                fc=nn.Linear(torch.Size(in_shape).numel(), size),
                dropout=nn.Dropout(0.5),
                logits=nn.Linear(size, num_actions),
            )
            super().__init__(in_shape, layers, orthogonal(generator))

    check_two_at_once(TINY.replace(network=WithDropout.Settings()), tmp_path)
