"""Are liars trusted, and true maps found? On policies of many kinds, some planted."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.adversarial_maps import liars
from benchmarks.known_map_policies import Planted, plant, reach
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.scenes import Scenes
from drone_rl.explanations.trust import Pictures, Trial, check_maps, draw_pictures
from drone_rl.policies import PictureNetwork, SmallCNN
from drone_rl.policies.environment import make_env
from drone_rl.policies.zoo import load_exported, parse, policy_names, policy_path
from drone_rl.sim.tasks.collect_cubes import CollectCubes, WorldState

NUM_METHODS = 5
"""Methods that an explanation tries; a candidate is judged as one of so many."""


def bench_maps(folder: Path, quick: bool) -> dict[str, Any]:
    """How many liars are trusted, and how many true maps of planted policies.

    Args:
        folder: Not used: nothing is written.
        quick: Whether to take a few policies and episodes only.
    """
    del folder
    begin = time.perf_counter()
    env = make_env(64)
    scenes = Scenes(env)
    state, episode = imagined(scenes, 14 if quick else 40, 4 if quick else 6)
    pictures = draw_pictures(scenes, state, episode)
    planted = plant(pictures.absent, pictures.observations, expert(scenes, state))
    planted = planted[::7] if quick else planted
    missing = {p.name: trusts(pictures, p) for p in planted}
    looking = [p for p in planted if not p.is_blind]
    policies = {p.name: p.network for p in looking[:: 3 if quick else 2]}
    policies |= shipped(pictures) if not quick else {}
    policies |= untrained(pictures, 1 if quick else 4)
    lied = {name: believed(pictures, network) for name, network in policies.items()}
    env.close()
    return {
        "placebo_maps_trusted": sum(len(names) for names, _ in lied.values()),
        "placebo_maps_total": sum(tried for _, tried in lied.values()),
        "placebo_maps_policies": len(lied),
        "placebo_maps_believed": {n: names for n, (names, _) in lied.items() if names},
        "planted_maps_found": float(np.mean([not missing[p.name] for p in looking])),
        "planted_maps_total": len(looking),
        "planted_maps_missed": {p.name: missing[p.name] for p in looking if missing[p.name]},
        "planted_maps_blind_trusted": sum(not missing[p.name] for p in planted if p.is_blind),
        "planted_maps_blind_total": len(planted) - len(looking),
        "maps_s": time.perf_counter() - begin,
    }


def trusts(pictures: Pictures, planted: Planted) -> list[str]:
    """The tests that the true map of a planted policy fails; none if it is trusted."""
    trial = _trial(pictures, planted.network)
    checks = check_maps(trial, {"true": reach}, num_methods=NUM_METHODS)
    return checks["methods"]["true"]["failed"]


def believed(pictures: Pictures, network: PictureNetwork) -> tuple[list[str], int]:
    """Names of the liars that are trusted on a policy, and how many there were."""
    trial = _trial(pictures, network)
    other = SmallCNN(network.in_shape, 3, generator=torch.Generator().manual_seed(99))
    candidates = liars(pictures.absent, other)
    methods = check_maps(trial, candidates, num_methods=NUM_METHODS)["methods"]
    return [name for name, method in methods.items() if method["trusted"]], len(candidates)


def imagined(scenes: Scenes, episodes: int, frames: int) -> tuple[WorldState, np.ndarray]:
    """Worlds with the drone at random places on its way, some in each of many episodes."""
    task = scenes.worlds.task
    assert isinstance(task, CollectCubes)  # whose cubes the planted policies look for
    settings = task.settings
    random_state = np.random.RandomState(0)
    cubes = torch.stack([CollectCubes(settings).draw(random_state) for _ in range(episodes)])
    state = CollectCubes(settings).start(cubes.repeat_interleave(frames, 0))
    where = torch.from_numpy(random_state.uniform(size=(len(state.drone), 2)))
    state.drone[:, 0] = where[:, 0] * (settings.last_distance - settings.touch_distance)
    state.drone[:, 1] = (2 * where[:, 1] - 1) * settings.lateral_bound
    state.passed = state.cubes[..., 0] <= state.drone[:, None, 0] + settings.touch_distance
    return state.to(scenes.worlds.device), np.repeat(np.arange(episodes), frames)


def expert(scenes: Scenes, state: WorldState) -> Tensor:
    """What the next cube calls for, if there is one. Shape: (T,)."""
    return scenes.needed(scenes.task.next_offset(state))


def shipped(pictures: Pictures) -> dict[str, PictureNetwork]:
    """The policies that travel with the package and choose among moves on such pictures."""
    networks = {}
    for name in policy_names():
        exported = load_exported(policy_path(name))
        description = parse(exported["description"])
        is_of_moves = description.actions.kind == "moves"  # others' outputs are no three logits
        if description.input.shape != tuple(pictures.absent.shape) or not is_of_moves:
            continue
        parameters = exported["policy"]
        network = SmallCNN(pictures.absent.shape, 3, hidden=(128,))
        network.load_state_dict(parameters)
        networks[name] = network
    return networks


def untrained(pictures: Pictures, count: int = 4) -> dict[str, PictureNetwork]:
    """Policies of random weights, with opinions."""
    networks = {}
    for seed in range(count):
        generator = torch.Generator().manual_seed(seed)
        network = SmallCNN(pictures.absent.shape, 3, generator=generator)
        with torch.no_grad():
            network.layers.get_parameter("logits.weight").mul_(300)
        networks[f"random weights {seed}"] = network
    return networks


def _trial(pictures: Pictures, network: PictureNetwork) -> Trial:
    greedy = probabilities(network, pictures.observations).argmax(-1)
    return pictures.trial(network, greedy)
