"""What only a simulator allows: change one thing, draw the scene again, and ask the policy."""

import dataclasses
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.hooks import outputs, probabilities
from drone_rl.explanations.patches import sample_frames
from drone_rl.explanations.scenes import DARK_GROUND, Region, Scenes
from drone_rl.policies import PictureNetwork
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import State
from drone_rl.utils.intervals import episode_means, mean_bounds

OTHER_TARGETS = Appearance(
    colors={SemanticClass.TARGET: (0.9, 0.85, 0.2), SemanticClass.OBSTACLE: (0.9, 0.85, 0.2)}
)
MOVED_METRES = 2.0


@dataclasses.dataclass
class Intervention:
    """One change to many scenes, and what it did to the policy."""

    name: str
    area: Tensor  # (T, H, W) bool
    """Pixels that the change touched."""
    effect: NDArray  # (T,)
    """Distance of the wishes before and after; NaN where there was nothing to change."""
    frames: Tensor  # (T, H, W, 3) uint8
    """The pictures after the change."""


def intervene(
    scenes: Scenes, network: PictureNetwork, state: State, regions: Tensor, seed: int = 0
) -> list[Intervention]:
    """Takes the next cube away, moves it, recolours it; changes a patch of ground.

    The ground means nothing: what that patch does is what any change does.

    Args:
        scenes: Where they are drawn.
        network: The policy's.
        state: The scenes.
        regions: `Region` of each pixel. Shape: (T, H, W).
        seed: Of the patches' places.
    """
    before = scenes.frames(state)
    base = probabilities(network, scenes.transform(before))
    visible = regions == Region.NEXT_TARGET
    ground = _patches(regions == Region.GROUND, visible.sum((1, 2)), seed)
    recoloured = scenes.frames(state, OTHER_TARGETS)
    repainted = scenes.frames(state, DARK_GROUND)
    moved = scenes.frames(to_the_middle(scenes, state))
    changes = {
        "target taken away": (scenes.frames(scenes.task.without_next(state)), visible),
        "target moved": (moved, (moved != before).any(-1)),
        "target recoloured": (torch.where(visible[..., None], recoloured, before), visible),
        "ground patch changed": (torch.where(ground[..., None], repainted, before), ground),
    }
    return [
        Intervention(name, area, _effect(network, scenes, base, frames, area), frames)
        for name, (frames, area) in changes.items()
    ]


def _effect(
    network: PictureNetwork, scenes: Scenes, base: Tensor, frames: Tensor, area: Tensor
) -> NDArray:
    after = probabilities(network, scenes.transform(frames))
    change = scenes.actions.distance(after, base)
    touched = area.flatten(1).any(1)
    return torch.where(touched, change, torch.nan).double().cpu().numpy()


def to_the_middle(scenes: Scenes, state: State) -> State:
    """The next cube moved sideways towards the middle of the picture, and no farther than there."""
    lateral = scenes.task.next_offset(state)[:, 1].nan_to_num()
    return scenes.task.next_moved(state, -lateral.clamp(-MOVED_METRES, MOVED_METRES))


def _patches(ground: Tensor, size: Tensor, seed: int) -> Tensor:
    """A square of ground in each picture, of about as many pixels as the cube has. (T, H, W)."""
    rng = np.random.default_rng(seed)
    patches = torch.zeros_like(ground)
    for t, free in enumerate(ground):
        places = free.nonzero()
        if not len(places) or not size[t]:
            continue
        row, column = places[int(rng.integers(len(places)))].tolist()
        half = max(1, round(float(size[t]) ** 0.5)) // 2
        rows = slice(max(0, row - half), row + half + 1)
        columns = slice(max(0, column - half), column + half + 1)
        patches[t, rows, columns] = free[rows, columns]
    return patches


FLIGHTS_AN_EPISODE = 2
"""Frames of an episode from which flights go on, evenly spread."""
PATIENCE = 80
"""Steps after which a cube that is neither collected nor passed counts as missed."""


@dataclasses.dataclass(frozen=True)
class Flights:
    """How flights went on, until one cube of each was collected or passed."""

    collected: NDArray
    """Whether that cube was. Shape: (N,), bool."""
    decided: NDArray
    """Steps until then, or until the flight ended. Shape: (N,)."""
    lateral: NDArray
    """The drone's y after each step, metres; its last one once decided. Shape: (N, steps + 1)."""
    actions: NDArray
    """-1 once decided. Shape: (N, steps)."""


def outcomes(
    scenes: Scenes, network: PictureNetwork, state: State, episode: NDArray
) -> dict[str, Any]:
    """What becomes of flights when the next cube stands elsewhere, and of the ground repainted.

    Args:
        scenes: Where they are drawn.
        network: The policy's; it takes the most probable action.
        state: Worlds of the data set. T of them.
        episode: Shape: (T,).

    Returns:
        Means over episodes with intervals: "collected", by variant ("as it was", "moved left",
        "moved right"); "follows": metres that the drone went sideways with the cube, a metre, 0 of
        a policy that does not look at it, 1 of one that always goes there; "missed_when_moved":
        how much less often it is collected then; "path_changed": share of flights that differ at
        all when the cube is taken away; "ground_changed": share of flights whose outcome differs
        when the ground is repainted, at most its "upper95". "flights": how many each.
    """
    rows = _starts(scenes, state, episode)
    start, group = state[torch.from_numpy(rows)].to(scenes.worlds.device), episode[rows]
    task = scenes.task
    target = task.next_target(start)
    variants = {
        "as it was": start,
        "moved left": task.next_moved(start, MOVED_METRES),
        "moved right": task.next_moved(start, -MOVED_METRES),
        "taken away": task.without_next(start),
    }
    flown = {name: fly(scenes, network, s, target) for name, s in variants.items()}
    repainted = fly(scenes, network, start, target, DARK_GROUND)
    was, left, right = (flown[n] for n in ("as it was", "moved left", "moved right"))
    moved = (left.collected.astype(float) + right.collected) / 2

    def mean(values: NDArray, low: float = 0.0) -> dict[str, Any]:
        return mean_bounds(episode_means(values.astype(np.float64), group), low, 1.0)

    return {
        "flights": len(rows),
        "collected": {n: mean(f.collected) for n, f in flown.items() if n != "taken away"},
        "follows": mean(followed(left, right), -1.0),
        "missed_when_moved": mean(was.collected - moved, -1.0),
        "path_changed": mean(differ(was, flown["taken away"])),
        "ground_changed": mean(was.collected != repainted.collected),
    }


@torch.no_grad()
def fly(
    scenes: Scenes,
    network: PictureNetwork,
    state: State,
    target: Tensor,
    appearance: Appearance | None = None,
) -> Flights:
    """Flies on, taking the most probable action, until one cube of each world is decided.

    Args:
        scenes: Where they are drawn.
        network: The policy's.
        state: Where the flights begin; a policy with a memory remembers the first picture alone.
        target: The cube of each world. Shape: (N,).
        appearance: How the worlds look; as the task has it by default.
    """
    task = scenes.task
    world = torch.arange(len(target), device=target.device)
    now, on = state[world], torch.ones_like(target, dtype=torch.bool)
    decided, lateral, actions = torch.zeros_like(target), [now.body.position[:, 1]], []
    earlier: list[Tensor] = []
    for _ in range(PATIENCE):
        if not on.any():
            break
        flying = on.nonzero()[:, 0]
        seen = scenes.frames(now[flying], appearance)
        past = [pictures[flying] for pictures in earlier]
        action = torch.full_like(target, -1)
        given = scenes.actions.greedy(outputs(network, scenes.transform(seen, past)))
        action[flying] = scenes.actions.part(given)
        now[flying] = scenes.worlds.advance(now[flying], given.to(target.device))[0]
        decided[flying] += 1
        actions.append(action)
        lateral.append(now.body.position[:, 1].clone())
        on = ~task.is_behind(now, target) & ~task.is_reached(now, target) & (now.end_reason == 0)
        earlier = _remember(earlier, seen, flying, len(target), scenes.memory)
    return Flights(
        task.is_reached(now, target).cpu().numpy(),
        decided.cpu().numpy(),
        torch.stack(lateral, 1).cpu().numpy(),
        torch.stack(actions, 1).cpu().numpy() if actions else np.zeros((len(target), 0), int),
    )


def followed(left: Flights, right: Flights) -> NDArray:
    """How far the drone went with a cube, a metre that the cube was moved; cut to [-1, 1].

    Both flights are looked at when the first of them has got to its cube, so that a flight which
    merely lasts longer follows nothing.

    Args:
        left: With the cube moved to the left.
        right: With the cube moved to the right.
    """
    when = np.minimum(left.decided, right.decided)
    ends = [f.lateral[np.arange(len(when)), when] for f in (left, right)]
    return ((ends[0] - ends[1]) / (2 * MOVED_METRES)).clip(-1.0, 1.0)


def differ(first: Flights, second: Flights) -> NDArray:
    """Whether two flights took another action at any step that both took. Shape: (N,), bool."""
    steps = min(first.actions.shape[1], second.actions.shape[1])
    one, two = first.actions[:, :steps], second.actions[:, :steps]
    return ((one != two) & (one >= 0) & (two >= 0)).any(1)


def _starts(scenes: Scenes, state: State, episode: NDArray) -> NDArray:
    """Frames with a next cube ahead, a few an episode."""
    there = (~scenes.task.next_offset(state)[:, 0].isnan()).nonzero()[:, 0].cpu().numpy()
    return there[sample_frames(episode[there], FLIGHTS_AN_EPISODE)]


def _remember(
    earlier: list[Tensor], seen: Tensor, flying: Tensor, count: int, memory: int
) -> list[Tensor]:
    """The last pictures of all worlds, of which those that still fly have just seen one more."""
    if not memory:
        return []
    newest = seen.new_zeros(count, *seen.shape[1:])
    newest[flying] = seen
    return [*earlier, newest][-memory:]
