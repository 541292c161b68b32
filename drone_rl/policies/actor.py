"""Actors: from the outputs of a network to actions, and the distributions of actions."""

import math
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from contextvars import ContextVar
from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from tensordict.nn import InteractionType, TensorDictModule, dispatch
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torch.distributions import Categorical, Distribution
from torch.distributions.constraints import Constraint
from torch.nn import functional
from torchrl.data import TensorSpec
from torchrl.envs.utils import ExplorationType, exploration_type
from torchrl.modules import ProbabilisticActor

from drone_rl.envs.drone_env import make_action_spec
from drone_rl.envs.rollout import Act, ActorAgent, Agent, StepContext
from drone_rl.policies.networks import ImageNetwork
from drone_rl.policies.recurrent import WHOLE_EPISODES
from drone_rl.sim.continuous_actions import normal_of
from drone_rl.utils.threads import set_in_thread


class RandomSource:
    """A torch generator that copies of a module share, so that no sample is drawn twice."""

    def __init__(self, generator: torch.Generator) -> None:
        self.generator = generator

    def __deepcopy__(self, memo: dict) -> "RandomSource":
        """Return itself."""
        return self


_EXPLORATION: ContextVar[ExplorationType | None] = ContextVar("exploration", default=None)


def exploring(*, greedy: bool) -> AbstractContextManager[None]:
    """Make actors take the most probable action, or sample, in the calling thread only.

    TorchRL's `set_exploration_type`, which this overrides, changes all threads of the process.
    """
    return set_in_thread(_EXPLORATION, ExplorationType("deterministic" if greedy else "random"))


def current_exploration() -> ExplorationType | None:
    """Return how actors choose actions: by `exploring`, else by `set_exploration_type`."""
    return _EXPLORATION.get() or exploration_type()


class Exploring:
    """An agent that takes the most probable action, or samples, whatever its caller does."""

    def __init__(self, agent: Agent, *, greedy: bool) -> None:
        self._agent, self._greedy = agent, greedy

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        with exploring(greedy=self._greedy):
            return self._agent.act(context)


MAX_ACTION = 1 - 1e-6
"""Largest magnitude of an action; tanh in float32 can return 1, where atanh is infinite."""
_NODES = 32


class SquashedNormal(Distribution):
    """tanh of independent normal numbers, sampled from its own generator, not the global one."""

    has_rsample = False

    def __init__(self, logits: Tensor, source: RandomSource | None = None) -> None:
        """Set n means and n deviations from outputs of a network (*batch, 2 n), see `normal_of`."""
        self.loc, self.scale = normal_of(logits)
        self._source = source
        shape = self.loc.shape
        super().__init__(shape[:-1], shape[-1:], validate_args=False)

    @property
    def arg_constraints(self) -> dict[str, Constraint]:
        """Return none: outputs may be any numbers."""
        return {}

    @property
    def deterministic_sample(self) -> Tensor:
        """The normal's mean, squashed, which is also the median. Shape: (*batch, n)."""
        return self.loc.tanh()

    @property
    def mode(self) -> Tensor:
        """The median, under the name that TorchRL asks for; not the mode of the density."""
        return self.deterministic_sample

    @torch.no_grad()
    def sample(self, sample_shape: Sequence[int] = ()) -> Tensor:
        """Sample. Shape: (*sample_shape, *batch, n)."""
        generator = None if self._source is None else self._source.generator
        shape = (*sample_shape, *self.loc.shape)
        draw = torch.randn(shape, generator=generator, device=self.loc.device)
        return (self.loc + self.scale * draw).tanh().clamp(-MAX_ACTION, MAX_ACTION)

    def log_prob(self, value: Tensor) -> Tensor:
        """Return the log-density of actions (*, n), which are clamped to `MAX_ACTION`."""
        number = torch.atanh(value.clamp(-MAX_ACTION, MAX_ACTION))
        square = ((number - self.loc) / self.scale) ** 2
        normal = -0.5 * square - self.scale.log() - 0.5 * math.log(2 * math.pi)
        return (normal - _log_slope(number)).sum(-1)

    def entropy(self) -> Tensor:
        """Return the entropy of the squashed numbers: at most n log 2, where these are uniform.

        That of the normal numbers, whose bonus would increase deviations for ever, plus the mean
        of log(1 - tanh^2), by Gauss-Hermite quadrature, without sampling. Shape: batch.
        """
        nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
        places, weights = map(self.loc.new_tensor, (nodes, weights / weights.sum()))
        numbers = self.loc[..., None] + self.scale[..., None] * places
        bend = (_log_slope(numbers) * weights).sum(-1)
        return (0.5 + 0.5 * math.log(2 * math.pi) + self.scale.log() + bend).sum(-1)


def _log_slope(number: Tensor) -> Tensor:
    """Return log(1 - tanh^2), without cancellation."""
    return 2 * (math.log(2) - number - functional.softplus(-2 * number))


class SeededCategorical(Categorical):
    """A categorical distribution that samples from its own generator, not the global one."""

    def __init__(self, logits: Tensor, source: RandomSource | None = None) -> None:
        super().__init__(logits=logits, validate_args=False)
        self._source = source

    @torch.no_grad()
    def sample(self, sample_shape: Sequence[int] = ()) -> Tensor:
        """Sample by inverting the cumulative distribution. Shape: (*sample_shape, *batch)."""
        generator = None if self._source is None else self._source.generator
        shape = (*sample_shape, *self.logits.shape[:-1], 1)
        draw = torch.rand(shape, generator=generator, device=self.logits.device)
        return (draw > self.probs.cumsum(-1)[..., :-1]).sum(-1)

    @property
    def deterministic_sample(self) -> Tensor:
        """The most probable class. Shape: batch."""
        return self.logits.argmax(-1)


class KeepsModes:
    """Mixin of a sequence that ends in its only distribution."""

    def get_dist_params(self, *args: Any, **kwargs: Any) -> TensorDictBase:
        """Evaluate the networks, without an exploration type that TorchRL sets for all threads."""
        sequence: Any = self
        return sequence.det_part(*args, **kwargs)


class DirectActor(KeepsModes, ProbabilisticActor):
    """A `ProbabilisticActor` that calls network and distribution directly.

    TensorDict's modules, which `get_dist` and everything else use, take longer than a small network
    takes for one frame. The results are the same.
    """

    @property
    def network(self) -> nn.Module:
        """The network."""
        return self._parts[0].module

    @property
    def exploration(self) -> ExplorationType | None:
        """How actions are chosen now: as in `current_exploration`, else by default."""
        return current_exploration() or self._parts[1].default_interaction_type

    @property
    def generator(self) -> torch.Generator | None:
        """Source of sampled actions; None for torch's global one."""
        source = self._parts[1].distribution_kwargs["source"]
        return None if source is None else source.generator

    @property
    def _parts(self) -> Any:
        return self.module  # torch's modules are annotated to hold anything

    @dispatch(auto_batch_size=False)
    def forward(  # pyright: ignore[reportIncompatibleVariableOverride] (dispatch is untyped)
        self,
        tensordict: TensorDictBase,
        tensordict_out: TensorDictBase | None = None,
        **kwargs: object,
    ) -> TensorDictBase:
        """Write the network's outputs, of which "logits" are the first, and actions."""
        network, head = self._parts
        how = self.exploration
        is_known = how in (ExplorationType.RANDOM, ExplorationType.DETERMINISTIC)
        if tensordict_out is not None or kwargs or not is_known:
            return super().forward(tensordict, tensordict_out, **kwargs)
        outputs = network.module(*(tensordict.get(key) for key in network.in_keys))
        outputs = outputs if isinstance(outputs, tuple) else (outputs,)
        logits = outputs[0]
        distribution = head.distribution_class(logits=logits, **head.distribution_kwargs)
        random = how == ExplorationType.RANDOM
        action = distribution.sample() if random else distribution.deterministic_sample
        for key, value in zip(network.out_keys, outputs, strict=True):
            tensordict.set(key, value)
        return tensordict.set(head.out_keys[0], action)


class CategoricalActor(DirectActor):
    """A `DirectActor` with discrete actions; the fused kernel requires exactly this type."""


class SquashedActor(DirectActor):
    """A `DirectActor` with continuous actions; the same is true."""


class RecurrentActor(DirectActor):
    """A `DirectActor` whose network remembers; it acts in one step of each environment."""

    def forward(self, *args: Any, **kwargs: Any) -> TensorDictBase:
        """See `DirectActor.forward`."""
        with set_in_thread(WHOLE_EPISODES, False):
            return super().forward(*args, **kwargs)


def distribution_of(dtype: torch.dtype) -> type[SeededCategorical | SquashedNormal]:
    """Return the distribution of actions of a type: integers are discrete actions."""
    return SquashedNormal if dtype.is_floating_point else SeededCategorical


def make_actor(
    network: nn.Module, action_spec: TensorSpec, generator: torch.Generator | None = None
) -> ProbabilisticActor:
    """Return a stochastic policy: "pixels" to "logits" to "action" (chapter, Eq. 9).

    It samples by default. Within `exploring(greedy=True)`, or TorchRL's
    `set_exploration_type(ExplorationType.DETERMINISTIC)`, it takes the most probable action, or the
    median of continuous ones.

    Args:
        network: Frames (*, C, H, W) to outputs (*, num_outputs): logits of discrete actions. A
            recurrent one also reads and writes its state.
        action_spec: The environment's; its type decides the distribution.
        generator: Source of the sampled actions; torch's global one by default.
    """
    kind = distribution_of(action_spec.dtype)
    make: type[ProbabilisticActor]
    make = CategoricalActor if kind is SeededCategorical else SquashedActor
    image_network = network if isinstance(network, ImageNetwork) else ImageNetwork
    if image_network.is_recurrent:
        make = RecurrentActor
    return make(
        TensorDictModule(
            network, in_keys=list(image_network.in_keys), out_keys=list(image_network.out_keys)
        ),
        in_keys=["logits"],
        spec=action_spec,
        default_interaction_type=InteractionType.RANDOM,
        distribution_class=kind,
        distribution_kwargs={"source": None if generator is None else RandomSource(generator)},
    )


def greedy_agent(network: ImageNetwork, memory: Mapping[NestedKey, Tensor] | None = None) -> Agent:
    """Return an agent that takes the most probable actions of a network.

    A recurrent one goes on with a `memory` where episodes do not start, see `ActorAgent`.
    """
    agent = ActorAgent(make_actor(network, make_action_spec(network.actions.entry)))
    agent.memory = memory or {}
    return Exploring(agent, greedy=True)
