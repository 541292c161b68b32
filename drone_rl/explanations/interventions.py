"""What only a simulator allows: change one thing, draw the scene again, and ask the policy."""

import dataclasses

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations.alternatives import DARK_GROUND
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.scenes import Region, Scenes
from drone_rl.policies import PictureNetwork
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import State

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
