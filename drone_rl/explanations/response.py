"""Sections "response" (maps over the place of one target) and "asymmetry" (left against right)."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.context import Context
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.rollouts import run_to_end
from drone_rl.explanations.scenes import Scenes, empty_scene, place_target
from drone_rl.policies import PictureNetwork
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Grid
from drone_rl.utils.intervals import mean_interval
from drone_rl.utils.seeding import Stream, torch_generator

BLIND = 0.1
"""A policy is blind to a target that changes its action probabilities by less than this."""
_RESPONSE, _OUTCOME = 0, 1
"""Numbers of the maps' grids."""


def policy_response(context: Context) -> "ResponseMap":
    """Return the response map of the policy, computed once."""
    scenes, network, seed = context.scenes, context.network, context.seed.value
    return context.shared("response", lambda: response_map(scenes, network, seed=seed))


def response_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "response".

    Arrays: "response_..." and "outcome_...", the fields of `ResponseMap` and `OutcomeMap`.
    """
    response = policy_response(context)
    outcome = outcome_map(context.scenes, context.network, seed=context.seed.value)
    arrays = {
        f"{name}_{field.name}": getattr(one, field.name)
        for name, one in (("response", response), ("outcome", outcome))
        for field in dataclasses.fields(one)
    }
    return {"response": summarise(response, outcome, context.scenes.task.strata)}, arrays


def asymmetry_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "asymmetry": on the "dataset" and on the "grid" of the response map."""
    actions = context.scenes.actions
    numbers = {
        "dataset": asymmetry(context.network, context.observations, context.episode, actions),
        "grid": grid_asymmetry(policy_response(context), actions),
    }
    return {"asymmetry": numbers}, {}


@dataclasses.dataclass
class ResponseMap:
    """Action probabilities for one target at each place of a grid: Z up, F ahead, L sideways."""

    height: NDArray  # (Z,)
    """Metres above the drone."""
    forward: NDArray  # (F,)
    """Metres ahead of it."""
    lateral: NDArray  # (L,)
    """Metres to its left."""
    probabilities: NDArray  # (Z, F, L, A)
    without_target: NDArray  # (A,)
    """Action probabilities without a target."""
    oracle: NDArray  # (L,)
    """The needed action: a turn where flying straight on would miss."""
    stratum: NDArray  # (L,)
    """The task's stratum of a target there: its side."""
    blind: NDArray  # (Z, F, L) bool
    """See `find_blind`."""


@dataclasses.dataclass
class OutcomeMap:
    """Whether greedy rollouts reach a target at each place; fields as in `ResponseMap`."""

    height: NDArray  # (Z,)
    forward: NDArray  # (f,)
    lateral: NDArray  # (l,)
    collected: NDArray  # (Z, f, l) bool
    oracle: NDArray  # (l,)
    stratum: NDArray  # (l,)


def response_map(
    scenes: Scenes,
    network: PictureNetwork,
    *,
    num_lateral: int = 41,
    num_forward: int = 31,
    seed: int | None = None,
) -> ResponseMap:
    """Evaluate the policy with one target at each place of a grid.

    Args:
        scenes: Renders the frames.
        network: The policy's network.
        num_lateral: Places sideways; see `Task.grid`.
        num_forward: Places ahead.
        seed: Seed of the places, see `shrink`; fixed places by default.
    """
    grid = scenes.task.grid(num_forward, num_lateral)
    height, forward, lateral = grid if seed is None else shrink(grid, seed, _RESPONSE)
    ahead, aside = torch.meshgrid(forward, lateral, indexing="ij")
    layers = []
    for up in height.tolist():
        observed = scenes.observe(place_target(scenes, ahead.flatten(), aside.flatten(), up))
        layers.append(probabilities(network, observed).view(num_forward, num_lateral, -1))
    every = torch.stack(layers)
    alone = probabilities(network, scenes.observe(empty_scene(scenes)))[0]
    needed = scenes.needed(_offsets(lateral)).to(every.device)
    return ResponseMap(
        height=height.numpy(),
        forward=forward.numpy(),
        lateral=lateral.numpy(),
        probabilities=every.cpu().numpy(),
        without_target=alone.cpu().numpy(),
        oracle=needed.cpu().numpy(),
        stratum=scenes.task.stratum_at(_offsets(lateral)).numpy(),
        blind=find_blind(scenes.actions, every, alone, needed).cpu().numpy(),
    )


def shrink(grid: Grid, seed: int, number: int = 0) -> Grid:
    """Move the outermost places inwards by random lengths, and all others in proportion.

    Nobody can know these places beforehand and fit a policy to their frames. Places stay evenly
    spaced, and symmetric sideways.

    Args:
        grid: Of the task.
        seed: Root of the random stream.
        number: Of one grid among several from this seed.

    Returns:
        The same number of places. Each end has moved by less than half the distance between two
        places.
    """
    generator = torch_generator(seed, Stream.SCENES, number=number)
    near, far, aside = (0.5 * torch.rand(3, dtype=torch.float64, generator=generator)).tolist()
    lateral = _between(grid.lateral, aside, aside)
    lateral = 0.5 * (lateral - lateral.flip(0))  # symmetric to the last bit
    return Grid(grid.height, _between(grid.forward, near, far), lateral)


def _between(places: Tensor, first: float, last: float) -> Tensor:
    """Return evenly spaced places; the ends move inwards by fractions of a step."""
    if len(places) < 2:
        return places
    steps = torch.linspace(first, len(places) - 1 - last, len(places), dtype=torch.float64)
    step = (places[-1] - places[0]) / (len(places) - 1)
    return places[0] + step * steps


def find_blind(actions: Actions, wishes: Tensor, alone: Tensor, needed: Tensor) -> Tensor:
    """Return where a turn is needed, not chosen, and the target has almost no effect.

    Args:
        actions: Actions of the policy.
        wishes: Action probabilities with a target there. Shape: (Z, F, L, A).
        alone: Action probabilities without a target. Shape: (A,).
        needed: The needed action, -1 where it is unknown. Shape: (L,).

    Returns:
        Shape: (Z, F, L), bool.
    """
    unmoved = actions.distance(wishes, alone) < BLIND
    needs_turn = (needed >= 0) & actions.turns(needed)
    return unmoved & needs_turn & ~actions.agrees(actions.chosen(wishes), needed)


def outcome_map(
    scenes: Scenes,
    network: PictureNetwork,
    *,
    num_lateral: int = 21,
    num_forward: int = 8,
    seed: int | None = None,
) -> OutcomeMap:
    """Run greedy rollouts from each place of a coarser grid.

    Args:
        scenes: Renders and steps the environments.
        network: The policy's network.
        num_lateral: Places sideways; see `Task.grid`.
        num_forward: Places ahead.
        seed: See `response_map`.
    """
    grid = scenes.task.grid(num_forward, num_lateral)
    height, forward, lateral = grid if seed is None else shrink(grid, seed, _OUTCOME)
    ahead, aside = torch.meshgrid(forward, lateral, indexing="ij")
    only = torch.zeros(num_forward * num_lateral, dtype=torch.int64, device=scenes.worlds.device)
    layers = []
    for up in height.tolist():
        starts = place_target(scenes, ahead.flatten(), aside.flatten(), up)
        ends = run_to_end(scenes, network, starts)
        layers.append(scenes.task.is_reached(ends, only).view(num_forward, num_lateral))
    return OutcomeMap(
        height=height.numpy(),
        forward=forward.numpy(),
        lateral=lateral.numpy(),
        collected=torch.stack(layers).cpu().numpy(),
        oracle=scenes.needed(_offsets(lateral)).numpy(),
        stratum=scenes.task.stratum_at(_offsets(lateral)).numpy(),
    )


def summarise(response: ResponseMap, outcome: OutcomeMap, strata: Sequence[str]) -> dict[str, Any]:
    """Return counts by height and side.

    Args:
        response: Response map.
        outcome: Outcome map.
        strata: Names of the task's strata, such as sides.

    Returns:
        "without_target"; "rows": for each height and side ("left", "ahead" where flying straight on
        is enough, "right") the fraction of places at which the policy is "blind" (None if the grid
        has none on that side), and the number of "places" and of those "collected".
    """
    rows = []
    for layer, height in enumerate(response.height.tolist()):
        for number, side in enumerate(strata):
            blind = response.blind[layer][:, response.stratum == number]
            collected = outcome.collected[layer][:, outcome.stratum == number]
            rows.append(
                {
                    "height": height,
                    "side": side,
                    "blind": float(blind.mean()) if blind.size else None,
                    "collected": int(collected.sum()),
                    "places": int(collected.size),
                }
            )
    return {"without_target": response.without_target.tolist(), "blind_below": BLIND, "rows": rows}


def _offsets(lateral: Tensor) -> Tensor:
    """Return places beside the drone, at its height. Shape: (L,) to (L, 3)."""
    nothing = torch.zeros_like(lateral)
    return torch.stack([nothing, lateral, nothing], -1)


def asymmetry(
    network: PictureNetwork, observations: Tensor, episode: NDArray, actions: Actions
) -> dict[str, Any]:
    """Compare pi(left | x) with pi(right | mirrored x) over a data set.

    Args:
        network: The policy's network.
        observations: Shape (T, C, H, W).
        episode: Shape (T,).
        actions: Actions of the policy.

    Returns:
        "signed": mean of pi(left | x) - pi(right | mirrored x), below 0 if the policy prefers
        right; "absolute": mean distance between the policy and its mirror image; "worst": frames
        with the largest distances.
    """
    here = probabilities(network, observations)
    there = actions.mirror(probabilities(network, observations.flip(-1)))
    signed = (actions.leaning(here) - actions.leaning(there)).double().cpu().numpy()
    distance = actions.distance(here, there).double().cpu().numpy()
    worst = np.argsort(-distance, kind="stable")[:8]
    return {
        "signed": mean_interval(signed, episode, low=-1.0),
        "absolute": mean_interval(distance, episode),
        "worst": [{"frame": int(t), "distance": float(distance[t])} for t in worst],
    }


def grid_asymmetry(response: ResponseMap, actions: Actions) -> dict[str, Any]:
    """Compare a response map with its mirror image, which is the map read backwards."""
    here, there = response.probabilities, actions.mirror(response.probabilities[:, :, ::-1])
    signed, distance = actions.leaning(here) - actions.leaning(there), actions.distance(here, there)
    at = np.unravel_index(distance.argmax(), distance.shape)
    return {
        "signed": float(signed.mean()),
        "absolute": float(distance.mean()),
        "worst": {
            "distance": float(distance.max()),
            "height": float(response.height[at[0]]),
            "forward": float(response.forward[at[1]]),
            "lateral": float(response.lateral[at[2]]),
        },
    }
