"""A hand-written policy that reads the true positions: the best that can be hoped for."""

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase

from drone_rl.sim.actions import Move
from drone_rl.sim.settings import TaskSettings


class Oracle(TensorDictModuleBase):
    """Lines up with the next cube sideways, then flies forward. Sees no picture."""

    def __init__(self, settings: TaskSettings) -> None:
        """Learns how near is near enough.

        Args:
            settings: The task's.
        """
        super().__init__()
        self.in_keys = [("info", "drone"), ("info", "cube_positions"), ("info", "next_cube")]
        self.out_keys = ["action"]
        self.tolerance = max(0.5 * settings.step_length, 0.5 * settings.touch_distance)

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        drone, cubes, index = (tensordict.get(key) for key in self.in_keys)
        left = index >= cubes.shape[-2]  # no cube stands any more
        nearest = index.clamp(max=cubes.shape[-2] - 1)
        rows = nearest[..., None].expand(*index.shape[:-1], 1, 3)
        offset = cubes.gather(-2, rows)[..., 0, 1] - drone[..., 1]
        action = torch.full_like(index[..., 0], Move.FORWARD)
        action[offset > self.tolerance] = Move.LEFT
        action[offset < -self.tolerance] = Move.RIGHT
        action[left[..., 0]] = Move.FORWARD
        return tensordict.set("action", action)


class RandomPolicy(TensorDictModuleBase):
    """Draws every action with the same probability."""

    def __init__(self, num_actions: int, generator: torch.Generator) -> None:
        """Sets the source of its actions.

        Args:
            num_actions: How many there are.
            generator: Where they are drawn from.
        """
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.num_actions = num_actions
        self.generator = generator

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        shape, device = tensordict.batch_size, self.generator.device
        action = torch.randint(self.num_actions, shape, generator=self.generator, device=device)
        return tensordict.set("action", action)


class ConstantPolicy(TensorDictModuleBase):
    """Takes the same action whatever happens."""

    def __init__(self, action: Move) -> None:
        """Sets the action.

        Args:
            action: Taken at every step.
        """
        super().__init__()
        self.in_keys = ["done"]
        self.out_keys = ["action"]
        self.action = action

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        action = tensordict["done"][..., 0].long() * 0 + int(self.action)
        return tensordict.set("action", action)
