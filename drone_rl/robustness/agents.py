"""Who flies: a policy that sees pictures, or who acts without looking."""

import dataclasses
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

import torch
from torch import Tensor
from torchrl.envs import Transform

from drone_rl.envs import GrayPixels
from drone_rl.envs.pipeline import memory_of, see_film
from drone_rl.policies import PictureNetwork
from drone_rl.policies.rounding import decider
from drone_rl.sim.actions import Actions
from drone_rl.sim.rendering import Appearance, Poses
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State, Task
from drone_rl.sim.worlds import Worlds


class StepContext(NamedTuple):
    """What there is to see at one step of the worlds that still fly, n of num_worlds."""

    worlds: Worlds
    state: State
    flying: Tensor
    """Which of all worlds these are. Shape: (n,)."""
    poses: Poses
    """Where the camera has everything."""
    appearance: Appearance | None
    spoil: Callable[..., Tensor]
    """What becomes of pictures, see `faults.FaultPipeline`."""
    pending: list[Tensor]
    """Actions decided but not yet taken, oldest first. Shapes: (n, *)."""

    def draw(self, modality: Modality) -> Tensor:
        """What the policy's camera takes. Shape: (n, H, W, *)."""
        view = self.worlds.view(modality=modality)
        return self.worlds.renderer.render(view, self.poses, self.appearance)[modality][:, 0]


class Agent(Protocol):
    """Who acts, from the start of a flight on."""

    @property
    def knows_truth(self) -> bool:
        """Whether only faults that hide things matter to it."""
        ...

    def act(self, sight: StepContext) -> tuple[Tensor, Tensor | None]:
        """What to do.

        Returns:
            An action for each world, shape (n, *), and what was seen, if anything was, from 0 to 1
            as the camera gave it or in any other units, shape (n, *).
        """
        ...


class PolicyAgent:
    """A policy that takes the most probable action."""

    knows_truth = False

    def __init__(
        self,
        network: PictureNetwork,
        transforms: Iterable[Transform],
        num_worlds: int,
        *,
        examines_rounding: bool = False,
    ) -> None:
        """Has seen nothing yet.

        Args:
            network: The policy's.
            transforms: What becomes of pictures before it sees them.
            num_worlds: That fly.
            examines_rounding: Whether to find out where rounding can change the action.
        """
        self.is_fragile = torch.zeros(num_worlds, dtype=torch.bool)
        """Episodes with a frame on which rounding can change the action, if that is examined.
        Shape: (num_worlds,)."""
        self._decide = decider(network)[0] if examines_rounding else None
        looking = [t for t in transforms if "pixels" in (t.in_keys or [])]
        self._network, self._first, self._rest = network, looking[0], looking[1:]
        self._memory, self._num_worlds = memory_of(self._rest), num_worlds
        self._film: list[Tensor] = []

    def act(self, sight: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        if type(self._first) is GrayPixels:
            pictures = sight.draw("gray")[:, None]
        else:
            pictures = self._first._apply_transform(sight.draw("rgb"))
        pictures = sight.spoil(pictures, sight.flying)
        film = [*(earlier[sight.flying] for earlier in self._film), pictures]
        seen = see_film(self._rest, film)
        self._keep(pictures, sight.flying)
        if self._decide is not None:
            self.is_fragile[sight.flying.cpu()] |= self._decide(seen).is_fragile.cpu()
        return sight.worlds.dynamics.actions.greedy(self._network(seen)), pictures

    def _keep(self, pictures: Tensor, flying: Tensor) -> None:
        if self._memory:
            newest = pictures.new_zeros(self._num_worlds, *pictures.shape[1:])
            newest[flying] = pictures
            self._film = [*self._film, newest][-self._memory :]


class BaselineAgent:
    """One action always, or any action alike."""

    knows_truth = True

    def __init__(self, name: str, actions: Actions, generator: torch.Generator) -> None:
        """Takes what to do.

        Args:
            name: Of what is done always, or "random".
            actions: What can be done.
            generator: Of random ones.
        """
        self._actions, self._generator = actions, generator
        self._action = None if name == "random" else actions.always(name)

    def act(self, sight: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        if self._action is not None:
            same = self._action.expand(len(sight.flying), *self._action.shape)
            return same.to(sight.flying.device), None
        drawn = self._actions.draw(tuple(sight.flying.shape), self._generator)
        return drawn.to(sight.flying.device), None


_NOTHING = -1.0


class OracleAgent:
    """Does what the task's oracle does about the first cube that it sees."""

    knows_truth = True

    def __init__(self, *, looks: bool = True) -> None:
        """Sets what it knows.

        Args:
            looks: Whether it knows what its camera shows, or everything.
        """
        self._looks = looks

    def act(self, sight: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        worlds, rule = sight.worlds, sight.worlds.task.oracle
        assert rule is not None
        body = sight.state.body
        for action in sight.pending:
            body = worlds.dynamics.step(body, action)
        info = worlds.info(dataclasses.replace(sight.state, body=body))  # pyright: ignore[reportArgumentType] (a dataclass)
        if self._looks:
            info["next_cube"] = self._first_seen(sight, info["next_cube"])
        return rule.decide([info[name] for name in rule.reads], worlds.dynamics.actions), None

    def _first_seen(self, sight: StepContext, next_cube: Tensor) -> Tensor:
        """The nearest standing cube that shows; their number if none does. Shape: (n, 1)."""
        props = torch.tensor([*sight.worlds.scene.props, -1], device=next_cube.device)
        shown = props[sight.draw("segmentation").long()].float()[:, None]
        shown = sight.spoil(shown, sight.flying, _NOTHING).flatten(1)
        count = sight.worlds.task.places(sight.state).shape[1]  # what follows are distractors
        stands = (shown >= next_cube) & (shown < count)
        there = torch.where(stands, shown, torch.full_like(shown, count))
        return there.amin(-1, keepdim=True).long()


def has_oracle(task: Task) -> bool:
    """Whether a task has one of whom the next cube can be hidden."""
    return task.oracle is not None and "next_cube" in task.oracle.reads
