"""`drone-rl export format=onnx`: write an ONNX model and check that it agrees with the policy."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.envs import base_env
from drone_rl.envs.rollout import ActorAgent, steps
from drone_rl.policies.actor import Exploring
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import make_onnx, open_onnx
from drone_rl.trust.export import recorded_command
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import as_path, make_folder, write_atomically
from drone_rl.utils.seeding import root_seed

MAX_DIFFERENCE = 1e-5
"""Largest allowed difference of a probability from PyTorch's."""
_NUM_ENVS, _STEPS = 100, 100
"""Numbers of environments and steps of the comparison: 10,000 images."""


@dataclasses.dataclass(frozen=True)
class Agreement:
    """Differences of the action probabilities of two implementations."""

    frames: int
    """Number of images that both evaluated."""
    difference: float
    """Largest difference of a probability; NaN if one is NaN."""
    actions_differ: int
    """Number of images whose most probable action differs; see `Actions.probabilities`."""


@torch.no_grad()
def agreement(
    env: EnvBase,
    actor: TensorDictModuleBase,
    other: Callable[..., Tensor],
    num_steps: int,
) -> Agreement:
    """Run a policy with sampled actions and compare another implementation at every step.

    The actor writes "logits"; `other` takes the readings of each input in order, see
    `drone_rl.envs.readings`, for a recurrent policy also `is_init`, which episodes start, bool
    (N, 1), and returns `Actions.probabilities` (N, A) on the CPU. Environments whose episode ends
    are reset.
    """
    base = base_env(env)
    actions = base.worlds.dynamics.actions
    agent, probs, others = Exploring(ActorAgent(actor), greedy=False), [], []
    run = steps(agent, base.observer, base.start(), num_steps=num_steps, restart=base.start)
    for context, act, *_ in run:
        assert act.distribution is not None
        probs.append(actions.probabilities(act.distribution).cpu())
        starts = {"is_init": context.starts[:, None].cpu()} if "is_init" in actor.in_keys else {}
        readings = [values.cpu() for values in context.readings.values()]
        others.append(other(*readings, **starts))
    mine, its = torch.cat(probs), torch.cat(others)
    return Agreement(
        frames=len(mine),
        difference=float((mine - its).abs().max()),
        actions_differ=int((actions.chosen(mine) != actions.chosen(its)).sum()),
    )


def export_onnx(
    policy: str | Path | Policy,
    target: str | Path,
    *,
    command: str | None = None,
    seed: int | None = None,
) -> Agreement:
    """Write a policy as an ONNX model if the model agrees with the policy on the CPU.

    Args:
        policy: The policy, or an argument of `load_policy`.
        target: Path of the file to write, usually *.onnx; see `drone_rl.policies.zoo.make_onnx`.
        command: The training command, for the metadata; None takes it from the policy's file or
            folder.
        seed: Root of the random streams of the comparison; a fresh one by default.

    Returns:
        Agreement of the model and PyTorch in 10,000 steps of the policy's episodes.

    Raises:
        InputError: The policy can't be converted, the model differs, or the file can't be written.
    """
    target = as_path(target, "target")
    if target.is_dir():
        raise InputError(f"target={target} is a folder; give a file in it, such as policy.onnx")
    make_folder(target.parent)
    policy = policy if isinstance(policy, Policy) else load_policy(policy)
    metadata = {"command": command or recorded_command(policy.path, policy.state) or "unknown"}
    content = make_onnx(policy.description, policy.make_network(), metadata)
    model = open_onnx(content)
    without_faults = dataclasses.replace(policy, description=policy.description.without_faults())
    with without_faults.flying(_NUM_ENVS, seed=root_seed(seed).value) as (env, actor):
        agreed = agreement(env, actor, model, _STEPS)
    if not agreed.difference <= MAX_DIFFERENCE:
        raise InputError(
            f"the ONNX model of policy {policy.name} returns probabilities that differ by up to "
            f"{agreed.difference:.2g} from the policy's, more than {MAX_DIFFERENCE:g}; export it "
            "with format=safetensors"
        )
    try:
        write_atomically(target, content)
    except OSError as error:
        raise InputError(
            f"the ONNX file {target} can't be written ({error.strerror}); free some space or "
            "choose another folder"
        ) from error
    return agreed
