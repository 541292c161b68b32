"""What comes of a scene: the policy flies on from it, greedily, by the rules of the task."""

import torch
from torch import Tensor

from drone_rl.explanations.hooks import outputs
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies import PictureNetwork
from drone_rl.sim.tasks import State

_SAME = 1e-9
"""Metres, and parts of a quaternion: those of a move there and back differ by rounding."""


@torch.no_grad()
def fly_on(scenes: Scenes, network: PictureNetwork, state: State) -> State:
    """Flies until it is settled which targets are reached.

    That is when the flight ends, when no target is left, or when a policy that remembers nothing
    is back where it was two steps before: it would go back and forth, or stay, to the step limit.

    Args:
        scenes: Where the flights are drawn.
        network: The policy's.
        state: Where they start; a policy that sees several frames has seen this one only.

    Returns:
        How they ended; `end_reason` is 0 where no target was left. Shape: that of `state`.
    """
    task, actions, device = scenes.task, scenes.actions, state.body.position.device
    flying = torch.arange(len(state), device=device)
    done, now, earlier = state[flying], state, []
    before: Tensor | None = None
    is_new = torch.ones_like(flying, dtype=torch.bool)
    while len(flying):
        frames = scenes.frames(now)
        action = actions.greedy(outputs(network, scenes.transform(frames, earlier))).to(device)
        here = _pose(now)
        now, reward = scenes.worlds.advance(now, action)
        if before is not None and not scenes.memory:
            is_back = ((_pose(now) - before).abs() < _SAME).all(-1)
            now.end_reason[is_back & ~is_new] = task.truncation
        done[flying] = now
        on = (now.end_reason == 0) & ~task.next_offset(now)[:, 0].isnan()
        earlier = [*earlier, frames][-scenes.memory :] if scenes.memory else []
        earlier = [pictures[on] for pictures in earlier]
        is_new = (reward != 0)[on]  # a target less is another scene
        now, flying, before = now[on], flying[on], here[on]
    return done


def _pose(state: State) -> Tensor:
    """Where drones are and how they are turned. Shape: (n, 7)."""
    return torch.cat([state.body.position, state.body.attitude], -1)
