"""Policies with random weights."""

from pathlib import Path

import torch

import drone_rl
from drone_rl.config.transforms import Gray
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import describe


def untrained(network, *transforms, seed=0, **settings):
    """Return a policy of these settings, by default of gray images, and with random weights."""
    if "inputs" not in settings:
        settings["transforms"] = transforms or (Gray(),)
    settings = drone_rl.TrainSettings(network=network, **settings)
    description = describe(settings)
    weights = description.build_network(torch.Generator().manual_seed(seed)).state_dict()
    policy = drone_rl.load_policy("good")
    state = policy.state.replace(weights=weights, description=description)
    return Policy("untrained", Path("none"), description, state)
