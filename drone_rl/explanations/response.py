"""Sections "response" (maps over the place of one target) and "asymmetry"."""

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config.inputs import ImageInput
from drone_rl.explanations.context import Context, needs, objects
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.results import (
    Asymmetry,
    Mirrored,
    OutcomeMap,
    Response,
    ResponseMap,
    ResponseRow,
)
from drone_rl.explanations.rollouts import run_to_end
from drone_rl.explanations.scenes import Scenes, place_target
from drone_rl.policies import ImageNetwork
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Grid, State
from drone_rl.sim.tasks.common import SIDES
from drone_rl.utils.intervals import mean_interval
from drone_rl.utils.seeding import Stream, torch_generator

BLIND = 0.1  # a policy is blind to a target that changes its action probabilities by less than this
SHOWN = 3  # frames that differ most from their mirror images
_RESPONSE, _OUTCOME = 0, 1  # numbers of the maps' grids


@needs(objects)
def section(context: Context) -> Response:
    """Evaluate the policy with one target at many places."""
    scenes, network, seed = context.scenes, context.network, context.seed.value
    response = response_map(scenes, network, seed=seed)
    outcome = outcome_map(scenes, network, seed=seed)
    here, actions = response.probabilities, scenes.actions
    there = actions.mirror(here[:, :, ::-1])  # the mirrored map is the map read backwards
    return Response(
        rows=count_places(response, outcome),
        blind_below=BLIND,
        asymmetry=float(actions.distance(here, there).mean()),
        map=response,
        outcome=outcome,
    )


def mirror_images(context: Context) -> str | None:
    """Need inputs with known mirror images."""
    for name, seen in context.scenes.inputs.items():
        is_image = isinstance(seen, ImageInput)
        if is_image and (seen.modality == "normals" or seen.camera.name.startswith("front_")):
            return f"The mirror image of {name} is not known."
    return None


@needs(mirror_images)
def asymmetry_section(context: Context) -> Asymmetry:
    """Compare the policy with its mirror image on the analysed frames."""
    data, scenes = context.dataset, context.scenes
    inputs = {scenes.name: data.tensor("observations"), **data.others}
    mirrored = {name: scenes.mirror(name, values) for name, values in inputs.items()}
    here, there = context.evaluate(inputs), context.evaluate(mirrored)
    return asymmetry(here, there, data.episode, scenes.actions)


def response_map(
    scenes: Scenes,
    network: ImageNetwork,
    *,
    num_lateral: int = 41,
    num_forward: int = 31,
    seed: int | None = None,
) -> ResponseMap:
    """Evaluate the policy with one target at each place of its grid; for `seed` see `shrink`."""
    fields, probs = _over_grid(
        scenes,
        (num_forward, num_lateral),
        (seed, _RESPONSE),
        lambda state: probabilities(network, scenes.observe(state), scenes.rest(state)),
    )
    one = place_target(scenes, torch.ones(1), torch.zeros(1))
    rest = scenes.rest(scenes.task.edits.without_next(one))
    alone = probabilities(network, scenes.absent[None], rest)[0]
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
    grid, (root, number) = scenes.task.edits.grid(*shape), seed
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
        "stratum": scenes.task.edits.stratum_at(offsets),
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
        target = task.edits.next_target(state)
        return task.edits.is_reached(run_to_end(scenes, network, state), target)

    shape = (num_forward, num_lateral)
    fields, collected = _over_grid(scenes, shape, (seed, _OUTCOME), reached)
    return OutcomeMap(**fields, collected=collected.cpu().numpy())


def count_places(response: ResponseMap, outcome: OutcomeMap) -> tuple[ResponseRow, ...]:
    """Return results by height and side."""
    rows, is_known = [], bool((response.oracle >= 0).all())
    for layer, height in enumerate(response.height.tolist()):
        for number, side in enumerate(SIDES):
            blind = response.blind[layer][:, response.stratum == number]
            collected = outcome.collected[layer][:, outcome.stratum == number]
            rows.append(
                ResponseRow(
                    height=height,
                    side=side,
                    blind=float(blind.mean()) if blind.size and is_known else None,
                    collected=int(collected.sum()),
                    places=int(collected.size),
                )
            )
    return tuple(rows)


def asymmetry(here: Tensor, mirrored: Tensor, episode: NDArray, actions: Actions) -> Asymmetry:
    """Compare action probabilities (T, A) on frames and on their mirror images."""
    there = actions.mirror(mirrored)
    signed = (actions.prob_left(here) - actions.prob_left(there)).double().cpu().numpy()
    distance = actions.distance(here, there).double().cpu().numpy()
    worst = np.argsort(-distance, kind="stable")[:SHOWN]
    return Asymmetry(
        signed=mean_interval(signed, episode, low=-1.0),
        absolute=mean_interval(distance, episode),
        worst=tuple(Mirrored(frame=int(t), distance=float(distance[t])) for t in worst),
    )
