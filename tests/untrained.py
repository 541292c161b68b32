"""Policies with random weights."""

from pathlib import Path

import torch

import drone_rl
from drone_rl.config.transforms import Gray
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import PolicyDescription


def untrained(network, *transforms, seed=0):
    """Return a policy of these settings, by default of gray images, and with random weights."""
    policy = drone_rl.load_policy("good")
    camera, steps = policy.description.camera, transforms or (Gray(),)
    description = PolicyDescription(policy.task, camera, steps, network)
    weights = description.build_network(torch.Generator().manual_seed(seed)).state_dict()
    state = {**policy.state, "policy": weights, "description": description.as_dict()}
    return Policy("untrained", Path("none"), description, state)
