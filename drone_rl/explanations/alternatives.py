"""What the simulator would draw otherwise: pictures from the same place with other things in them.

They are what a patch of a picture is replaced by, to find out whether the policy minds: a grey box
is something that no policy ever met, these are pictures like its own.
"""

import torch
from torch import Tensor

from drone_rl.explanations.scenes import Scenes
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import State

DARK_GROUND = Appearance(colors={SemanticClass.GROUND: (0.25, 0.25, 0.22)})
DARK = Appearance(colors={**DARK_GROUND.colors, SemanticClass.SKY: (0.3, 0.36, 0.45)})
BRIGHT = Appearance(
    colors={SemanticClass.GROUND: (0.75, 0.78, 0.7), SemanticClass.SKY: (0.9, 0.93, 0.97)}
)
PLACEMENTS = 3
"""Random placements of all the cubes."""


def alternatives(scenes: Scenes, state: State, seed: int = 0) -> dict[str, Tensor]:
    """Other pictures from where each drone is.

    Args:
        scenes: Where they are drawn.
        state: The scenes as they were.
        seed: Of the cubes' random places.

    Returns:
        By name, pictures as the policy gets them, shape (T, C, h, w): no cubes; targets elsewhere,
        `PLACEMENTS` times; ground and sky darker, and brighter.
    """
    generator = torch.Generator().manual_seed(seed)
    found = {"no targets": scenes.observe(scenes.task.without_targets(state))}
    for i in range(PLACEMENTS):
        other = scenes.task.elsewhere(state, scenes.worlds.camera, generator)
        found[f"targets elsewhere {i}"] = scenes.observe(other)
    for name, appearance in (("darker", DARK), ("brighter", BRIGHT)):
        found[name] = scenes.transform(scenes.frames(state, appearance))
    return found
