"""What comes of a scene: the policy flies on from it, greedily, by the rules of the task."""

import torch
from torch import Tensor

from drone_rl.explain.hooks import probabilities
from drone_rl.explain.scenes import Scenes
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes.rules import EndReason, WorldState


@torch.no_grad()
def fly_on(scenes: Scenes, network: PolicyNetwork, state: WorldState) -> WorldState:
    """Flies until it is settled which cubes are collected.

    That is when the flight ends, when no cube stands any more, or when a policy that remembers
    nothing turns back to where it came from: it would go back and forth until the step limit.

    Args:
        scenes: Where the flights are drawn.
        network: The policy's.
        state: Where they start; a policy that sees several frames has seen this one only.

    Returns:
        How they ended; `end_reason` is RUNNING where no cube was left. Shape: that of `state`.
    """
    done = state[torch.arange(len(state.drone), device=state.drone.device)]
    flying = torch.arange(len(state.drone), device=state.drone.device)
    now, last, earlier = state, torch.full_like(flying, Move.FORWARD), []
    while len(flying):
        frames = scenes.frames(now)
        action = probabilities(network, scenes.transform(frames, earlier)).argmax(-1)
        now, reward = scenes.worlds.advance(now, action.to(now.drone.device))
        if not scenes.memory:
            now.end_reason[_turned_back(last, action)] = EndReason.STEP_LIMIT
        done[flying] = now
        last = action.where(reward == 0, Move.FORWARD)  # a cube less is another scene
        on = (now.end_reason == EndReason.RUNNING) & now.present.any(-1)
        earlier = [*earlier, frames][-scenes.memory :] if scenes.memory else []
        now, flying, last = now[on], flying[on], last[on]
        earlier = [pictures[on] for pictures in earlier]
    return done


def _turned_back(last: Tensor, action: Tensor) -> Tensor:
    """Whether an action undoes the one before. Shape: (T,), bool."""
    return (last != Move.FORWARD) & (action != Move.FORWARD) & (last != action)
