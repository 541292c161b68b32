"""Agents of the robustness evaluation: the policy, random and constant baselines, the oracle."""

import dataclasses
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol, cast

import torch
from torch import Tensor
from torchrl.envs import Transform

from drone_rl.envs import GrayPixels, RgbPixels
from drone_rl.envs.transforms import PixelTransform, apply_to_frames, memory_of, pixel_transforms
from drone_rl.policies import ImageNetwork, RecurrentNetwork
from drone_rl.policies.recurrent import Memory
from drone_rl.policies.rounding import decider
from drone_rl.sim.actions import Actions
from drone_rl.sim.rendering import Appearance, Poses
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State, Task
from drone_rl.sim.worlds import Worlds

_NOTHING = -1.0


class StepContext(NamedTuple):
    """Data that an agent may use at one step, for n active environments of num_envs."""

    worlds: Worlds
    state: State
    active: Tensor
    """Indices of the active environments. Shape: (n,)."""
    poses: Poses
    appearance: Appearance | None
    apply_faults: Callable[..., Tensor]
    """See `perturbations.FaultPipeline`."""
    pending: list[Tensor]
    """Actions decided but not yet taken, oldest first. Shapes: (n, *)."""

    def render(self, modality: Modality) -> Tensor:
        """Render the policy's camera. Shape: (n, H, W, *)."""
        view = self.worlds.view(modality=modality)
        return self.worlds.renderer.render(view, self.poses, self.appearance)[modality][:, 0]


class Agent(Protocol):
    """An agent that acts in a batch of environments for one episode each."""

    @property
    def needs_only_hiding_faults(self) -> bool:
        """Whether other faults can be left out, because only those that hide objects affect it."""
        ...

    def act(self, context: StepContext) -> tuple[Tensor, Tensor | None]:
        """Return actions and the images that the agent used, if any. Shapes: (n, *)."""
        ...


class _RgbBytes(PixelTransform):
    """Floats (*, 3, H, W) from 0 to 1 back to the camera's bytes (*, H, W, 3)."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return (obs * 255).round().to(torch.uint8).movedim(-3, -1)


class PolicyAgent:
    """A policy that takes the most probable action."""

    needs_only_hiding_faults = False

    def __init__(
        self,
        network: ImageNetwork,
        transforms: Iterable[Transform],
        num_envs: int,
        *,
        examines_rounding: bool = False,
    ) -> None:
        """Take a policy's network and transforms; `examines_rounding` fills `is_fragile`."""
        self.is_fragile = torch.zeros(num_envs, dtype=torch.bool)
        """Episodes with a frame in which rounding can change the action. Shape: (num_envs,)."""
        self._decide = decider(network)[0] if examines_rounding else None
        self._network = network
        first, *rest = pixel_transforms(transforms)
        self._is_gray = type(first) is GrayPixels
        is_own = type(first) not in (GrayPixels, RgbPixels)  # faults need images from 0 to 1
        self._rest = [_RgbBytes(), first, *rest] if is_own else rest
        self._memory, self._num_envs = memory_of(self._rest), num_envs
        self._earlier_frames: list[Tensor] = []
        self._state = network.start(num_envs) if isinstance(network, RecurrentNetwork) else None

    def act(self, context: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        if self._is_gray:
            images = context.render("gray")[:, None]
        else:
            images = RgbPixels()._apply_transform(context.render("rgb"))
        images = context.apply_faults(images, context.active)
        frames = [*(earlier[context.active] for earlier in self._earlier_frames), images]
        observation = apply_to_frames(self._rest, frames)
        if self._memory:
            newest = images.new_zeros(self._num_envs, *images.shape[1:])
            newest[context.active] = images
            self._earlier_frames = [*self._earlier_frames, newest][-self._memory :]
        if self._decide is not None:
            is_fragile = self._decide(observation).is_fragile.cpu()
            self.is_fragile[context.active.cpu()] |= is_fragile
        outputs = self._outputs(observation, context.active)
        return context.worlds.dynamics.actions.greedy(outputs), images

    def _outputs(self, observation: Tensor, active: Tensor) -> Tensor:
        """Evaluate the network for the active environments, and keep their recurrent state."""
        if self._state is None:
            return self._network(observation)
        before = Memory(*(part[active] for part in self._state))
        outputs, after = cast(RecurrentNetwork, self._network).step(observation, before)
        for part, new in zip(self._state, after, strict=True):
            part[active] = new
        return outputs


class BaselineAgent:
    """A baseline that takes random actions, or always the same one."""

    needs_only_hiding_faults = True

    def __init__(self, name: str, actions: Actions, generator: torch.Generator) -> None:
        """Take "random" or an action's name, the action space, and a generator for "random"."""
        self._actions, self._generator = actions, generator
        self._action = None if name == "random" else actions.always(name)

    def act(self, context: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        active = context.active
        if self._action is not None:
            return self._action.expand(len(active), *self._action.shape).to(active.device), None
        sampled = self._actions.sample(tuple(active.shape), self._generator)
        return sampled.to(active.device), None


class OracleAgent:
    """The task's oracle, restricted to the cubes that the camera shows.

    It reads the segmentation image of the policy's camera, with the same faults. It uses the exact
    position of each cube that is visible in at least one pixel, and nothing about the others. It
    compensates for delayed actions. A strength at which it certainly fails too often counts as
    impossible, see `possible_share` of `ShiftSettings`.
    """

    needs_only_hiding_faults = True

    def __init__(self, *, only_visible: bool = True) -> None:
        """With `only_visible=False`, the oracle uses the positions of all cubes."""
        self._only_visible = only_visible

    def act(self, context: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        worlds, rule = context.worlds, context.worlds.task.oracle
        assert rule is not None
        body = context.state.body
        for action in context.pending:
            body = worlds.dynamics.step(body, action)
        info = worlds.info(dataclasses.replace(context.state, body=body))
        if self._only_visible:
            info["next_cube"] = self._first_visible(context, info["next_cube"])
        return rule.decide([info[name] for name in rule.reads], worlds.dynamics.actions), None

    def _first_visible(self, context: StepContext, next_cube: Tensor) -> Tensor:
        """Return the index of the nearest visible cube, or the number of cubes. Shape: (n, 1)."""
        props = torch.tensor([*context.worlds.scene.props, -1], device=next_cube.device)
        numbers = props[context.render("segmentation").long()].float()[:, None]
        numbers = context.apply_faults(numbers, context.active, _NOTHING).flatten(1)
        count = context.worlds.task.places(context.state).shape[1]  # distractors come after
        is_cube = (numbers >= next_cube) & (numbers < count)
        visible = torch.where(is_cube, numbers, torch.full_like(numbers, count))
        return visible.amin(-1, keepdim=True).long()


def has_oracle(task: Task) -> bool:
    """Return whether a task has an oracle that can be limited to visible cubes."""
    return task.oracle is not None and "next_cube" in task.oracle.reads
