"""Claims about the inputs of a policy: that one is ignored, matters, or is exported alike."""

import dataclasses
from typing import Any

import torch

from benchmarks.benchmark import Setup
from benchmarks.inputs.export import measure_export
from benchmarks.inputs.goal import PLUGIN, SEEING, TASK, TASK_NAME, WALKING, own_folder
from benchmarks.inputs.placebos import measure_placebos
from benchmarks.seeing import train
from drone_rl.collectors.complete_episodes import rollout
from drone_rl.envs import base_env
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.trust.repetition import exchange_inputs
from drone_rl.utils.plugins import import_plugin
from drone_rl.utils.seeding import Stream

_EPISODES = 200


def bench_inputs(setup: Setup) -> dict[str, Any]:
    """Train a policy of three inputs, and let copies of it ignore one.

    Returns:
        "ignored_input_found", of "ignored_input_tried" copies that ignore their image or their goal
        those whose verdict would name it; "ignored_input_false", verdicts on the policy itself that
        would say that it ignores one; and the figures of `measure_export` and `measure_placebos`.
    """
    seeds = range(2 if setup.quick else 20)
    run = setup.runs / "inputs" / "train"
    most, settings = 20_000 if setup.quick else 600_000, (PLUGIN, TASK_NAME, *SEEING, *WALKING)
    with own_folder() as folder:
        train(run, 0, most, *settings, where=folder)
    import_plugin(str(TASK))
    return measure_claims(load_policy(run), seeds, setup.quick)


def measure_claims(policy: Policy, seeds: range, quick: bool) -> dict[str, Any]:
    """Return the figures of `bench_inputs` for a policy that sees gray, goal and last_action."""
    blind = {name: without(policy, name) for name in ("gray", "goal")}
    found = [name in _ignored(one, seed) for seed in seeds for name, one in blind.items()]
    return {
        "ignored_input_found": sum(found),
        "ignored_input_tried": len(found),
        "ignored_input_false": sum(bool(_ignored(policy, seed)) for seed in seeds),
        **measure_export(policy, 3_000 if quick else 90_000),
        **measure_placebos(2 if quick else 8),
    }


def without(policy: Policy, name: str) -> Policy:
    """Return a copy whose actions do not change with an input: its weights are zero."""
    weights = {key: weight.clone() for key, weight in policy.state.weights.items()}
    if f"branches.{name}.conv1.weight" in weights:
        weights[f"branches.{name}.conv1.weight"].zero_()
    else:
        shapes = policy.description.shapes
        vectors = [key for key, shape in shapes.items() if len(shape) == 1]
        first = sum(shapes[key][0] for key in vectors[: vectors.index(name)])
        weights["branches.vectors.0.weight"][:, first : first + shapes[name][0]] = 0.0
    return dataclasses.replace(policy, state=policy.state.replace(weights=weights))


@torch.no_grad()
def _ignored(policy: Policy, seed: int) -> list[str]:
    """Return the inputs that a verdict in some environments says to be ignored."""
    with policy.flying(100, seed=seed, stream=Stream.REPORT) as (env, actor):
        state = base_env(env).state_dict()
        greedy = rollout(actor, env, _EPISODES)
        base_env(env).load_state_dict(state)
        uses = exchange_inputs(env, actor, greedy)
    return [name for name, use in uses.items() if use.is_ignored]
