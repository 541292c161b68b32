"""Sections on one target: "response" (maps over its place) and "asymmetry"."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.context import Context
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.rollouts import run_to_end
from drone_rl.explanations.scenes import Scenes, empty_scene, place_target
from drone_rl.policies import ImageNetwork
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Grid, State
from drone_rl.utils.intervals import mean_interval
from drone_rl.utils.seeding import Stream, torch_generator

BLIND = 0.1  # a policy is blind to a target that changes its action probabilities by less than this
_RESPONSE, _OUTCOME = 0, 1  # numbers of the maps' grids


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "response", and "asymmetry": on the "dataset" and on the "grid" of the response map.

    Arrays: "response_..." and "outcome_...", the fields of `ResponseMap` and `OutcomeMap`.
    """
    scenes, network, seed = context.scenes, context.network, context.seed.value
    data, actions = context.dataset, scenes.actions
    response = response_map(scenes, network, seed=seed)
    outcome = outcome_map(scenes, network, seed=seed)
    maps = {"response": vars(response), "outcome": vars(outcome)}
    arrays = {f"{n}_{key}": array for n, fields in maps.items() for key, array in fields.items()}
    on_frames = asymmetry(network, data.tensor("observations"), data.episode, actions)
    numbers = {
        "response": summarise(response, outcome, scenes.task.strata),
        "asymmetry": {"dataset": on_frames, "grid": grid_asymmetry(response, actions)},
    }
    return numbers, arrays


@dataclasses.dataclass(frozen=True, kw_only=True)
class TargetGrid:
    """Places of one target: Z up, F ahead, L sideways."""

    height: NDArray  # (Z,); metres above the drone
    forward: NDArray  # (F,); metres ahead of it
    lateral: NDArray  # (L,); metres to its left
    oracle: NDArray  # (L,); the needed action: a turn where flying straight on would miss
    stratum: NDArray  # (L,); the task's stratum of a target there: its side


@dataclasses.dataclass(frozen=True, kw_only=True)
class ResponseMap(TargetGrid):
    """Action probabilities for one target at each place."""

    probabilities: NDArray  # (Z, F, L, A)
    without_target: NDArray  # (A,); action probabilities without a target
    blind: NDArray  # (Z, F, L) bool; see `find_blind`


@dataclasses.dataclass(frozen=True, kw_only=True)
class OutcomeMap(TargetGrid):
    """Whether greedy rollouts reach a target at each place."""

    collected: NDArray  # (Z, F, L) bool


def response_map(
    scenes: Scenes,
    network: ImageNetwork,
    *,
    num_lateral: int = 41,
    num_forward: int = 31,
    seed: int | None = None,
) -> ResponseMap:
    """Evaluate the policy with one target at each place of `Task.grid`; for `seed` see `shrink`."""
    fields, probs = _over_grid(
        scenes,
        (num_forward, num_lateral),
        (seed, _RESPONSE),
        lambda state: probabilities(network, scenes.observe(state)),
    )
    alone = probabilities(network, scenes.observe(empty_scene(scenes)))[0]
    needed = torch.from_numpy(fields["oracle"]).to(probs.device)
    return ResponseMap(
        **fields,
        probabilities=probs.cpu().numpy(),
        without_target=alone.cpu().numpy(),
        blind=find_blind(scenes.actions, probs, alone, needed).cpu().numpy(),
    )


def _over_grid(
    scenes: Scenes,
    shape: tuple[int, int],
    seed: tuple[int | None, int],
    evaluate: Callable[[State], Tensor],
) -> tuple[dict[str, NDArray], Tensor]:
    """Return the fields that both maps share, and results by place. Shape: (Z, F, L, ...)."""
    grid, (root, number) = scenes.task.grid(*shape), seed
    height, forward, lateral = grid if root is None else shrink(grid, root, number)
    ahead, aside = (one.flatten() for one in torch.meshgrid(forward, lateral, indexing="ij"))
    layers = [evaluate(place_target(scenes, ahead, aside, up)) for up in height.tolist()]
    nothing = torch.zeros_like(lateral)
    offsets = torch.stack([nothing, lateral, nothing], -1)
    fields = {
        "height": height,
        "forward": forward,
        "lateral": lateral,
        "oracle": scenes.needed(offsets),
        "stratum": scenes.task.stratum_at(offsets),
    }
    return {n: one.numpy() for n, one in fields.items()}, torch.stack(layers).unflatten(1, shape)


def shrink(grid: Grid, seed: int, number: int = 0) -> Grid:
    """Move the outermost places inwards by random lengths, and all others in proportion.

    These places are unknown beforehand, so no policy can be fitted to their frames. They stay
    evenly spaced, and symmetric sideways. Each end moves by less than half the distance of two
    neighbours.
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


def find_blind(actions: Actions, probs: Tensor, alone: Tensor, needed: Tensor) -> Tensor:
    """Return where a turn is needed, not chosen, and the target has almost no effect. (Z, F, L).

    `probs` (Z, F, L, A) are action probabilities with a target there, `alone` (A,) those without
    one; `needed` (L,) is -1 where the needed action is unknown.
    """
    unmoved = actions.distance(probs, alone) < BLIND
    needs_turn = (needed >= 0) & actions.turns(needed)
    return unmoved & needs_turn & ~actions.agrees(actions.chosen(probs), needed)


def outcome_map(
    scenes: Scenes,
    network: ImageNetwork,
    *,
    num_lateral: int = 21,
    num_forward: int = 8,
    seed: int | None = None,
) -> OutcomeMap:
    """Run greedy rollouts from each place of a coarser grid; see `response_map`."""
    task = scenes.task

    def reached(state: State) -> Tensor:
        target = task.next_target(state)
        return task.is_reached(run_to_end(scenes, network, state), target)

    shape = (num_forward, num_lateral)
    fields, collected = _over_grid(scenes, shape, (seed, _OUTCOME), reached)
    return OutcomeMap(**fields, collected=collected.cpu().numpy())


def summarise(response: ResponseMap, outcome: OutcomeMap, strata: Sequence[str]) -> dict[str, Any]:
    """Return counts by height and stratum, such as "left", "ahead" and "right".

    "rows" has for each height and side the fraction of places at which the policy is "blind" (None
    if the grid has none on that side, or the needed action is unknown), and the number of "places"
    and of those "collected".
    """
    rows, is_known = [], bool((response.oracle >= 0).all())
    for layer, height in enumerate(response.height.tolist()):
        for number, side in enumerate(strata):
            blind = response.blind[layer][:, response.stratum == number]
            collected = outcome.collected[layer][:, outcome.stratum == number]
            rows.append(
                {
                    "height": height,
                    "side": side,
                    "blind": float(blind.mean()) if blind.size and is_known else None,
                    "collected": int(collected.sum()),
                    "places": int(collected.size),
                }
            )
    return {"without_target": response.without_target.tolist(), "blind_below": BLIND, "rows": rows}


def asymmetry(
    network: ImageNetwork, observations: Tensor, episode: NDArray, actions: Actions
) -> dict[str, Any]:
    """Compare the policy with its mirror image on observations x (T, C, H, W).

    "signed" is the mean of pi(left | x) - pi(right | mirrored x), below 0 if the policy prefers
    right; "absolute" the mean distance of the probabilities; "worst" the frames with the largest.
    """
    here = probabilities(network, observations)
    there = actions.mirror(probabilities(network, observations.flip(-1)))
    signed = (actions.prob_left(here) - actions.prob_left(there)).double().cpu().numpy()
    distance = actions.distance(here, there).double().cpu().numpy()
    worst = np.argsort(-distance, kind="stable")[:8]
    return {
        "signed": mean_interval(signed, episode, low=-1.0).model_dump(),
        "absolute": mean_interval(distance, episode).model_dump(),
        "worst": [{"frame": int(t), "distance": float(distance[t])} for t in worst],
    }


def grid_asymmetry(response: ResponseMap, actions: Actions) -> dict[str, float]:
    """Compare a response map with its mirror image, which is the map read backwards."""
    here, there = response.probabilities, actions.mirror(response.probabilities[:, :, ::-1])
    signed = actions.prob_left(here) - actions.prob_left(there)
    distance = actions.distance(here, there)
    return {"signed": float(signed.mean()), "absolute": float(distance.mean())}
