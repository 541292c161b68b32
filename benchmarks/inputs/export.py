"""Exported models and `policy.act` against the network of a policy with several inputs."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import make_onnx, open_onnx
from drone_rl.trust.onnx_export import agreement
from drone_rl.utils.seeding import root_seed

_NUM_ENVS = 300


def measure_export(policy: Policy, num_actions: int = 90_000) -> dict[str, float]:
    """Compare its ONNX model and `policy.act_batch`, given readings, with the trained network.

    Both act in the policy's episodes, without simulated errors of its inputs.

    Returns:
        "inputs_onnx_difference", the greatest of a probability of the ONNX model, and
        "inputs_onnx_differ", the greedy actions of either that differ, of `num_actions` of each.
    """
    clean = dataclasses.replace(policy, description=policy.description.without_faults())
    names, count = [*policy.description.inputs], policy.make_network().num_actions

    def act(*readings: Tensor) -> Tensor:
        acted = policy.act_batch(**dict(zip(names, readings, strict=True)))
        return torch.nn.functional.one_hot(acted, count).float()

    model = open_onnx(make_onnx(policy.description, policy.make_network(), {}))
    found = []
    for implementation in (model, act):
        with clean.flying(_NUM_ENVS, seed=root_seed(None).value) as (env, actor):
            found.append(agreement(env, actor, implementation, -(-num_actions // _NUM_ENVS)))
    return {
        "inputs_onnx_difference": found[0].difference,
        "inputs_onnx_differ": sum(one.actions_differ for one in found),
    }
