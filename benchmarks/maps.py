"""Reliability of the tests of heat maps.

The benchmark counts how many adversarial maps pass the tests, and how many true maps do.
"""

import time
from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.adversarial_maps import adversarial_maps
from benchmarks.benchmark import Setup
from benchmarks.known_map_policies import make_policies, path_weights
from drone_rl.envs import worlds_of
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.patches import has_effect, make_grid, patch_effects, placebo_maps
from drone_rl.explanations.rollouts import collect, select_frames
from drone_rl.explanations.scenes import Scenes, alternatives
from drone_rl.explanations.trust import Trial, check_maps
from drone_rl.policies import ImageNetwork, SmallCNN
from drone_rl.policies.environment import make_env
from drone_rl.policies.policy import BasePolicy
from drone_rl.policies.zoo import policy_names, policy_path, read_policy
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.collect_cubes import CollectCubes
from drone_rl.sim.tasks.objects import ObjectState

NUM_METHODS = 5
"""Number of methods of an explanation, for the correction for multiple tests."""


def bench_maps(setup: Setup) -> dict[str, Any]:
    """Count trusted adversarial maps, and trusted true maps of policies with known maps.

    Returns:
        "placebo_maps_...": trusted adversarial maps, their total, the number of policies and the
        names of trusted maps by policy; "planted_maps_...": the fraction of true maps that are
        trusted, their number, the failed tests of the others, and trusted maps of blind policies;
        "maps_s": seconds.
    """
    begin = time.perf_counter()
    env = make_env(64)
    scenes = Scenes(env)
    state, episode = imagined(scenes, 14 if setup.quick else 40, 4 if setup.quick else 6)
    found = count_maps(scenes, state, episode, expert(scenes, state), setup.quick)
    env.close()
    return {**found, "maps_s": time.perf_counter() - begin}


def count_maps_in_flights(policy: BasePolicy, prefix: str, quick: bool) -> dict[str, Any]:
    """Count trusted maps in frames of a policy's own flights, see `count_maps`.

    Returns:
        "PREFIX_placebos_trusted" of "PREFIX_placebos_total" adversarial maps, and
        "PREFIX_planted_found", the fraction of "PREFIX_planted_total" true maps that are trusted.
    """
    with policy.flying(64, seed=0) as (env, actor):
        flights = collect(env, actor, num_episodes=14 if quick else 40)
        rows = select_frames(flights.episode, 56 if quick else 240)
        state = flights.state(worlds_of(env))[torch.from_numpy(rows)]
        episode, actions = flights.episode[rows], flights.tensor("actions")[rows]
        found = count_maps(Scenes(env), state, episode, actions, quick)
    return {
        f"{prefix}_placebos_trusted": found["placebo_maps_trusted"],
        f"{prefix}_placebos_total": found["placebo_maps_total"],
        f"{prefix}_planted_found": found["planted_maps_found"],
        f"{prefix}_planted_total": found["planted_maps_total"],
    }


def count_maps(
    scenes: Scenes, state: State, episode: np.ndarray, actions: Tensor, quick: bool
) -> dict[str, Any]:
    """Count trusted maps in some states of environments.

    Args:
        scenes: Scenes of the task.
        state: The states, T.
        episode: Episode of each, (T,).
        actions: What policies with known maps should do there, (T,).
        quick: Whether to test few policies.

    Returns:
        See `bench_maps`.
    """
    seen, absent = scenes.observe(state), scenes.absent
    others = list(alternatives(scenes, state).values())
    grid = make_grid(*seen.shape[-2:])

    def trial(network: ImageNetwork) -> Trial:
        """The trial on the frames in which some patch affects a policy."""
        effects = patch_effects(network, seen, others, grid)
        whole = Trial(
            network=network,
            observations=seen,
            actions=probabilities(network, seen).argmax(-1),
            effects=effects,
            placebos=placebo_maps(seen, absent, others, 0),
            episode=episode,
            grid=grid,
        )
        return whole[has_effect(effects)]

    planted = make_policies(absent, seen, actions)
    planted = planted[::7] if quick else planted
    failed = {p.name: failed_tests(trial(p.network)) for p in planted}
    seeing = [p for p in planted if not p.is_blind]
    policies = {p.name: p.network for p in seeing[:: 3 if quick else 2]}
    policies |= shipped(absent) if not quick else {}
    policies |= untrained(absent, 1 if quick else 4)
    trusted = {name: trusted_adversarial(trial(n), absent) for name, n in policies.items()}
    return {
        "placebo_maps_trusted": sum(len(names) for names, _ in trusted.values()),
        "placebo_maps_total": sum(total for _, total in trusted.values()),
        "placebo_maps_policies": len(trusted),
        "placebo_maps_believed": {n: names for n, (names, _) in trusted.items() if names},
        "planted_maps_found": float(np.mean([not failed[p.name] for p in seeing])),
        "planted_maps_total": len(seeing),
        "planted_maps_missed": {p.name: failed[p.name] for p in seeing if failed[p.name]},
        "planted_maps_blind_trusted": sum(not failed[p.name] for p in planted if p.is_blind),
        "planted_maps_blind_total": len(planted) - len(seeing),
    }


def failed_tests(trial: Trial) -> list[str]:
    """Return the tests that the true map of a policy fails; none if it is trusted."""
    checks = check_maps(trial, {"true": path_weights}, num_methods=NUM_METHODS)
    return [*checks.methods["true"].failed]


def trusted_adversarial(trial: Trial, absent: Tensor) -> tuple[list[str], int]:
    """Return the names of the adversarial maps that are trusted on a policy, and their total."""
    other = SmallCNN(trial.network.in_shape, 3, generator=torch.Generator().manual_seed(99))
    candidates = adversarial_maps(absent, other)
    methods = check_maps(trial, candidates, num_methods=NUM_METHODS).methods
    return [name for name, method in methods.items() if method.trusted], len(candidates)


def imagined(scenes: Scenes, episodes: int, frames: int) -> tuple[ObjectState, np.ndarray]:
    """Return states with the drone at random positions, several of each episode.

    Args:
        scenes: Scenes of the default task.
        episodes: Number of episodes.
        frames: Number of states of each episode.

    Returns:
        The states, and the episode of each.
    """
    task = scenes.worlds.task
    assert isinstance(task, CollectCubes)  # the policies with known maps look for cubes
    settings = task.settings
    random_state = np.random.RandomState(0)
    cubes = torch.stack([CollectCubes(settings).sample(random_state) for _ in range(episodes)])
    state = task.start(cubes.repeat_interleave(frames, 0))
    where = torch.from_numpy(random_state.uniform(size=(len(state.drone), 2)))
    state.drone[:, 0] = where[:, 0] * (settings.last_distance - settings.touch_distance)
    state.drone[:, 1] = (2 * where[:, 1] - 1) * settings.lateral_bound
    state.present = state.places[..., 0] > state.drone[:, None, 0] + settings.touch_distance
    task.look_ahead(state)
    return state.to(scenes.worlds.device), np.repeat(np.arange(episodes), frames)


def expert(scenes: Scenes, state: ObjectState) -> Tensor:
    """Return the action that approaches the next cube. Shape: (T,)."""
    return scenes.needed(scenes.task.edits.next_offset(state))


def shipped(absent: Tensor) -> dict[str, ImageNetwork]:
    """Return the shipped policies with discrete moves and this image shape, by name."""
    networks = {}
    for name in policy_names():
        exported = read_policy(policy_path(name))
        description = exported.description
        is_of_moves = (
            description.actions.settings.kind == "moves"
        )  # else outputs are not three logits
        if description.shapes["pixels"] != tuple(absent.shape) or not is_of_moves:
            continue
        parameters = exported.weights
        network = SmallCNN(absent.shape, 3, hidden=(128,))
        network.load_state_dict(parameters)
        networks[name] = network
    return networks


def untrained(absent: Tensor, count: int = 4) -> dict[str, ImageNetwork]:
    """Return policies with random weights and confident outputs, by name."""
    networks = {}
    for seed in range(count):
        generator = torch.Generator().manual_seed(seed)
        network = SmallCNN(absent.shape, 3, generator=generator)
        with torch.no_grad():
            network.layers.get_parameter("logits.weight").mul_(300)
        networks[f"random weights {seed}"] = network
    return networks
