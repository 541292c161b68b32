"""Section "truth": tests of the heat maps against the effects of changes to the scene."""

import dataclasses
import functools
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations import trust
from drone_rl.explanations.context import Context, image, needs, objects
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.results import Outcomes, Truth
from drone_rl.explanations.rollouts import Step, run_from, spread_frames
from drone_rl.explanations.scenes import DARK_GROUND, Region, Scenes
from drone_rl.policies import ImageNetwork
from drone_rl.sim.dynamics.state import heading_of
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.scene_edits import turned
from drone_rl.utils.intervals import mean_interval


@needs(image, interventions=objects)
def section(context: Context) -> Truth:
    """Test the heat maps, none if the weights are unknown; measure effects of changes."""
    data, scenes, network = context.dataset, context.scenes, context.network
    episode, seed = data.episode, context.seed.value
    state = data.state(scenes.worlds)
    trial = trust.make_trial(context)
    changes, outcomes = [], None
    if scenes.task.edits is not None:
        regions = data.tensor("regions")
        changes = intervene(scenes, network, state, regions, seed, data.rest)
        outcomes = measure_outcomes(scenes, network, state, episode, data.memory)
    shown_frame = clear_frame(changes[0]) if changes else 0
    methods = trust.method_maps(context.explainer) if network.has_weights else {}
    effects = trial.effects if len(trial.effects) else np.zeros((1, trial.grid.count))
    return Truth(
        **vars(trust.check_maps(trial, methods)),
        interventions={c.name: mean_interval(c.effect, episode) for c in changes},
        outcomes=outcomes if outcomes and outcomes.flights else None,
        shown_frame=shown_frame,
        changed=np.array([c.frames[shown_frame].cpu().numpy() for c in changes]),
        patch_effects=effects.mean(0).reshape(trial.grid.rows, trial.grid.columns),
    )


OTHER_TARGETS = Appearance(
    colors={SemanticClass.TARGET: (0.9, 0.85, 0.2), SemanticClass.OBSTACLE: (0.9, 0.85, 0.2)}
)
MOVED_METRES = 2.0
FLIGHTS_AN_EPISODE = 2  # frames of an episode from which rollouts start, evenly spaced
PATIENCE = 80  # steps after which a target that is neither reached nor passed counts as missed


@dataclasses.dataclass
class Intervention:
    """One change to many scenes and its effect on the policy."""

    name: str
    area: Tensor  # (T, H, W) bool; changed pixels
    effect: NDArray  # (T,), distance of the probabilities; NaN where there was nothing to change
    frames: Tensor  # (T, H, W, 3) uint8; frames after the change


def intervene(
    scenes: Scenes,
    network: ImageNetwork,
    state: State,
    regions: Tensor,
    seed: int = 0,
    rest: Tensor | None = None,
) -> list[Intervention]:
    """Remove, move and recolor the next target; as a control, change a patch of ground.

    `regions` has the `Region` of each pixel (T, H, W). For `rest`, which stays as it is, see
    `hooks`. In images without colors, nothing is recolored.
    """
    before = scenes.frames(state)
    base = probabilities(network, scenes.observe(state), rest)
    visible = regions == Region.NEXT_TARGET
    away, aside = scenes.task.edits.without_next(state), to_the_middle(scenes, state)
    moved = scenes.frames(aside)
    changes: dict[str, tuple[Tensor, Tensor, Callable[[Tensor], Tensor]]] = {
        "target taken away": (scenes.frames(away), visible, lambda _: scenes.observe(away)),
        "target moved": (moved, (moved != before).any(-1), lambda _: scenes.observe(aside)),
    }
    if scenes.shows_colors:
        ground = _patches(regions == Region.GROUND, visible.sum((1, 2)), seed)
        recolored = scenes.frames(state, OTHER_TARGETS)
        repainted = scenes.frames(state, DARK_GROUND)
        recolored = torch.where(visible[..., None], recolored, before)
        repainted = torch.where(ground[..., None], repainted, before)
        changes["target recolored"] = (recolored, visible, scenes.transform)
        changes["ground patch changed"] = (repainted, ground, scenes.transform)
    interventions = []
    for name, (frames, area, seen) in changes.items():
        after = probabilities(network, seen(frames), rest)
        effect = scenes.actions.distance(after, base)
        effect = torch.where(area.flatten(1).any(1), effect, torch.nan).double().cpu().numpy()
        interventions.append(Intervention(name, area, effect, frames))
    return interventions


def clear_frame(change: Intervention) -> int:
    """Return a frame on which a change has an effect and covers about a twentieth of the pixels.

    Where the target fills the frame, a reader sees no more than one color.
    """
    effect = np.nan_to_num(change.effect)
    covered = change.area.flatten(1).double().mean(1).cpu().numpy()
    is_clear = (effect >= 0.5 * effect.max()) & (covered > 0)
    return int(np.where(is_clear, np.abs(covered - 0.05), np.inf).argmin())


def to_the_middle(scenes: Scenes, state: State) -> State:
    """Move the next target sideways by up to `MOVED_METRES` towards the middle of the frame."""
    lateral = scenes.task.edits.next_offset(state)[:, 1].nan_to_num()
    return scenes.task.edits.next_moved(state, -lateral.clamp(-MOVED_METRES, MOVED_METRES))


def _patches(ground: Tensor, size: Tensor, seed: int) -> Tensor:
    """Return a square of ground in each frame, of about `size` pixels. Shape: (T, H, W)."""
    rng = np.random.default_rng(seed)
    patches = torch.zeros_like(ground)
    for t, free in enumerate(ground):
        places = free.nonzero()
        if len(places) and size[t]:
            row, column = places[int(rng.integers(len(places)))].tolist()
            half = max(1, round(float(size[t]) ** 0.5)) // 2
            rows = slice(max(0, row - half), row + half + 1)
            columns = slice(max(0, column - half), column + half + 1)
            patches[t, rows, columns] = free[rows, columns]
    return patches


@dataclasses.dataclass(frozen=True)
class TargetRollouts:
    """N rollouts, each until one target was reached or passed."""

    collected: NDArray  # whether the target was reached. Shape: (N,), bool.
    decided: NDArray  # steps until then, or until the episode ended. Shape: (N,).
    lateral: NDArray
    """How far to the left of the world's origin, as each drone was headed at first, it was after
    each step, metres; constant once decided. Shape: (N, steps + 1)."""


def measure_outcomes(
    scenes: Scenes,
    network: ImageNetwork,
    state: State,
    episode: NDArray,
    memory: Tensor | None = None,
) -> Outcomes:
    """Compare greedy rollouts with the next target moved, and with another ground.

    That an action's probability changes does not show that the outcome changes. The rollouts start
    from T states of the data set; `episode` has shape (T,). For `memory` see `hooks`.
    """
    task = scenes.task
    ahead = (~task.edits.next_offset(state)[:, 0].isnan()).nonzero()[:, 0].cpu().numpy()
    rows = ahead[spread_frames(episode[ahead], FLIGHTS_AN_EPISODE)]
    start, group = state[torch.from_numpy(rows)].to(scenes.worlds.device), episode[rows]
    target = task.edits.next_target(start)
    memory = None if memory is None else memory[torch.from_numpy(rows)]
    variants = {
        "as it was": start,
        "moved left": task.edits.next_moved(start, MOVED_METRES),
        "moved right": task.edits.next_moved(start, -MOVED_METRES),
    }
    run = functools.partial(run_to_target, scenes, network, target=target, memory=memory)
    runs = {name: run(changed) for name, changed in variants.items()}
    has_ground = bool((scenes.frames(start) != scenes.frames(start, DARK_GROUND)).any())
    ground_changed = None
    if has_ground:
        is_other = runs["as it was"].collected != run(start, appearance=DARK_GROUND).collected
        ground_changed = mean_interval(is_other, group)
    return Outcomes(
        flights=len(rows),
        collected={name: mean_interval(run.collected, group) for name, run in runs.items()},
        follows=mean_interval(followed(runs["moved left"], runs["moved right"]), group, -1.0),
        ground_changed=ground_changed,
    )


def run_to_target(
    scenes: Scenes,
    network: ImageNetwork,
    state: State,
    target: Tensor,
    appearance: Appearance | None = None,
    memory: Tensor | None = None,
) -> TargetRollouts:
    """Step until one target (N,) of each environment is reached or passed; see `run_from`."""
    task = scenes.task
    decided = torch.zeros_like(target)
    heading = heading_of(state.body.attitude)
    lateral = [turned(state.body.position, -heading)[:, 1]]

    def goes_on(step: Step) -> Tensor:
        after, goal = step.after, target[step.rows]
        decided[step.rows] += 1
        lateral.append(lateral[-1].clone())
        lateral[-1][step.rows] = turned(after.body.position, -heading[step.rows])[:, 1]
        is_over = task.edits.is_behind(after, goal) | task.edits.is_reached(after, goal)
        return ~is_over & (after.end_reason == 0) & (len(lateral) <= PATIENCE)

    end = run_from(scenes, network, state, goes_on, appearance, memory)
    return TargetRollouts(
        task.edits.is_reached(end, target).cpu().numpy(),
        decided.cpu().numpy(),
        torch.stack(lateral, 1).cpu().numpy(),
    )


def followed(left: TargetRollouts, right: TargetRollouts) -> NDArray:
    """Return how far the drone moved with a target, per metre that it was moved; in [-1, 1].

    Both are compared where the first of them ends: a longer rollout does not count as following.
    """
    when = np.minimum(left.decided, right.decided)
    ends = [r.lateral[np.arange(len(when)), when] for r in (left, right)]
    return ((ends[0] - ends[1]) / (2 * MOVED_METRES)).clip(-1.0, 1.0)
