"""What comes of a scene: the policy flies on from it, greedily, by the rules of the task."""

import torch

from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies import PictureNetwork
from drone_rl.sim.tasks import State


@torch.no_grad()
def fly_on(scenes: Scenes, network: PictureNetwork, state: State) -> State:
    """Flies until it is settled which targets are reached.

    That is when the flight ends, when no target is left, or when a policy that remembers nothing
    turns back to where it came from: it would go back and forth until the step limit.

    Args:
        scenes: Where the flights are drawn.
        network: The policy's.
        state: Where they start; a policy that sees several frames has seen this one only.

    Returns:
        How they ended; `end_reason` is 0 where no target was left. Shape: that of `state`.
    """
    task, actions, device = scenes.task, scenes.actions, state.body.position.device
    flying = torch.arange(len(state), device=device)
    done, now, last, earlier = state[flying], state, None, []
    is_new = torch.ones_like(flying, dtype=torch.bool)
    while len(flying):
        frames = scenes.frames(now)
        wish = probabilities(network, scenes.transform(frames, earlier))
        action = actions.chosen(wish).to(device)
        now, reward = scenes.worlds.advance(now, action)
        if last is not None and not scenes.memory:
            now.end_reason[actions.undoes(action, last) & ~is_new] = task.truncation
        done[flying] = now
        on = (now.end_reason == 0) & ~task.next_offset(now)[:, 0].isnan()
        earlier = [*earlier, frames][-scenes.memory :] if scenes.memory else []
        earlier = [pictures[on] for pictures in earlier]
        is_new = (reward != 0)[on]  # a target less is another scene
        now, flying, last = now[on], flying[on], action[on]
    return done
