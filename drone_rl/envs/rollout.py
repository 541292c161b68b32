"""Agents, and the one loop that lets them act: step environments until their episodes end."""

import functools
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor

from drone_rl.envs.observer import Observer, with_rows
from drone_rl.sim.actions import Actions
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


class StepContext:
    """What an agent may use at one step of k running environments; computed when it is read."""

    def __init__(self, observer: Observer, state: State, rows: Tensor, starts: Tensor) -> None:
        self.observer, self.state = observer, state
        self.rows = rows
        """Indices of the environments, in order. Shape: (k,)."""
        self.starts = starts
        """Whether their episodes start. Shape: (k,), bool."""
        self.pending: list[Tensor] = []
        """Actions that were decided but not yet taken, oldest first. Shapes: (k, *)."""

    @property
    def worlds(self) -> Worlds:
        """The environments."""
        return self.observer.worlds

    @property
    def actions(self) -> Actions:
        """The action space."""
        return self.worlds.dynamics.actions

    @functools.cached_property
    def inputs(self) -> dict[str, Tensor]:
        """The inputs of policies, by name."""
        return self.observer.observe(self.state, self.rows, self.starts, self.appearance)

    @functools.cached_property
    def readings(self) -> dict[str, Tensor]:
        """What sensors and, without errors, cameras give; see `drone_rl.envs.readings`."""
        sources, look = self.observer.sources, self.appearance
        return {name: s.read(self.state, self.inputs[name], look) for name, s in sources.items()}

    def part(
        self, which: Tensor | slice, inputs: Mapping[str, Tensor] | None = None
    ) -> "StepContext":
        """Return the context of some of these environments, by their position, (j,).

        `inputs`, shapes (j, *), replace what their policies observe.
        """
        part = StepContext(self.observer, self.state[which], self.rows[which], self.starts[which])
        part.pending = [action[which] for action in self.pending]
        if inputs is None:
            inputs = {name: values[which] for name, values in self.inputs.items()}
        part.inputs = dict(inputs)
        return part

    def observe(self, name: str = "pixels") -> Tensor:
        """Return an input of policies. Shape: (k, *)."""
        if name not in self.inputs:
            raise InputError(f"the policy reads {name!r}; these drones give {[*self.inputs]}")
        return self.inputs[name]

    @functools.cached_property
    def appearance(self) -> Appearance | None:
        """The appearance of the environments."""
        return self.observer.appearance(self.rows)

    @functools.cached_property
    def info(self) -> dict[str, Tensor]:
        """The ground truth; see `Worlds.entries`. Shapes: (k, *)."""
        return self.worlds.info(self.state)

    def render(self, modality: Modality = "rgb") -> Tensor:
        """Render the policy's camera, without faults. Shape: (k, H, W, *)."""
        return self.worlds.render(self.state, self.worlds.view(modality=modality), self.appearance)


class Act(NamedTuple):
    """What an agent decides for k environments."""

    action: Tensor  # (k, *)
    distribution: Tensor | None = None
    """Outputs of the network, from which the action was chosen. Shape: (k, num_outputs)."""
    entries: Mapping[Any, Tensor] = {}
    """What else it read and wrote, by TorchRL's keys. Shapes: (k, *)."""


class Agent(Protocol):
    """Acts in environments: a policy, a baseline, an oracle, a person.

    It may remember something of each environment: `context.rows` says of which, `context.starts`
    where to forget it.
    """

    def act(self, context: StepContext) -> Act:
        """Return actions for the running environments."""
        ...


class Step(NamedTuple):
    """A step of k environments."""

    context: StepContext
    act: Act
    after: State
    """States after the step, before new episodes start."""
    reward: Tensor  # (k,), float64
    following: StepContext
    """What can be observed in these states; only if `looks_ahead`."""
    next_state: State
    """States of the environments that the next step is taken in."""

    @property
    def rows(self) -> Tensor:
        """Indices of the environments. Shape: (k,)."""
        return self.context.rows


def _goes_on(step: Step) -> Tensor:
    return step.after.end_reason == 0


@torch.no_grad()
def steps(
    agent: Agent,
    observer: Observer,
    state: State,
    rows: Tensor | None = None,
    *,
    starts: bool | None = True,
    num_steps: int | None = None,
    goes_on: Callable[[Step], Tensor] = _goes_on,
    restart: Callable[[Tensor], State] | None = None,
    looks_ahead: bool = False,
) -> Iterator[Step]:
    """Step environments and yield each step.

    Args:
        agent: Acts in them.
        observer: Their worlds, and what is seen of them.
        state: Their states.
        rows: Their indices in the worlds, (k,); the first k by default.
        starts: Whether episodes start with these states; None if they were observed before.
        num_steps: Stop after so many; by default when no environment is left.
        goes_on: Returns which environments go on after a step, (k,) bool; by default those whose
            episode has not ended. It may change the states after the step.
        restart: Returns the states of new episodes in environments, (j,), that do not go on.
            Without it, they are left out of further steps.
        looks_ahead: Whether to observe the states after each step, also the last ones of episodes.
    """
    rows = torch.arange(len(state), device=state.end_reason.device) if rows is None else rows
    is_start = torch.full_like(rows, bool(starts), dtype=torch.bool)
    context = StepContext(observer, state, rows, is_start)
    if starts is None:
        context.inputs = observer.observe(state, rows, None, context.appearance)
    for number in itertools.count():
        if number == num_steps or not len(rows):
            return
        act = agent.act(context)
        after, reward = observer.worlds.advance(state, act.action)
        goes = torch.zeros_like(rows, dtype=torch.bool)
        following = StepContext(observer, after, rows, goes)
        if looks_ahead:
            _ = following.inputs
        step = Step(context, act, after, reward, following, after)
        going = goes_on(step)
        state, context = after, following
        if not bool(going.all()):
            kept, ended = going.nonzero()[:, 0], (~going).nonzero()[:, 0]
            if restart is None:
                state, rows = after[kept], rows[kept]
                context = StepContext(observer, state, rows, goes[kept])
            else:
                state = after[torch.arange(len(rows), device=rows.device)]
                state[ended] = restart(rows[ended])
                context = StepContext(observer, state, rows, ~going)
                if looks_ahead:  # the others have been observed
                    look = observer.appearance(rows[ended])
                    fresh = observer.observe(state[ended], rows[ended], True, look)
                    seen = following.inputs.items()
                    context.inputs = {n: v.index_copy(0, ended, fresh[n]) for n, v in seen}
        yield step._replace(next_state=state)


class ActorAgent:
    """A TorchRL actor, which reads entries of a `DroneEnv` and writes "action".

    The entries are inputs such as "pixels", "done", ("info", NAME), and for recurrent actors
    "is_init" and their state, which is that of `network.start` when an episode starts.
    """

    def __init__(self, actor: TensorDictModuleBase) -> None:
        self._actor: Any = actor
        written = set(self._actor.out_keys)
        self._carried = [key for key in actor.in_keys if ("next", key) in written]
        self.memory: Mapping[NestedKey, Tensor] = {}
        """State of a recurrent network by key, of each environment; it is replaced, not changed."""

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        rows = context.rows
        if self._carried and bool(context.starts.any()):
            self._start(context)
        read = TensorDict({}, [len(rows)], device=rows.device)
        for key in self._actor.in_keys:
            state = self.memory.get(key)
            read.set(key, _entry(context, key) if state is None else state[rows])
        acted = self._actor(read)
        after = {key: acted.get(("next", key)) for key in self._carried}
        self.memory = {k: with_rows(self.memory[k], rows, value) for k, value in after.items()}
        written = {key: acted.get(key) for key in acted.keys(True, True)}
        return Act(written["action"], written.get("logits"), written)

    def _start(self, context: StepContext) -> None:
        """Forget the episodes before those that start."""
        starting = context.rows[context.starts]
        fresh = zip(self._carried, self._actor.network.start(len(starting)), strict=True)
        self.memory = {k: with_rows(self.memory.get(k), starting, value) for k, value in fresh}


def as_agent(policy: TensorDictModuleBase | Agent) -> Agent:
    """Return an actor of TorchRL as an agent; agents are returned."""
    return ActorAgent(policy) if isinstance(policy, TensorDictModuleBase) else policy


def _entry(context: StepContext, key: NestedKey) -> Tensor:
    """Return an entry of a `DroneEnv` by TorchRL's key. Shape: (k, *)."""
    if isinstance(key, tuple):
        return context.info[str(key[-1])]
    if key in ("is_init", "done"):
        return (context.starts if key == "is_init" else torch.zeros_like(context.starts))[:, None]
    return context.observe(key)


class DelayedAgent:
    """An agent whose actions are taken some steps after they were decided."""

    def __init__(self, agent: Agent, delay: int = 0) -> None:
        self._agent, self.delay = agent, delay
        self._decided: list[Tensor] = []

    def act(self, context: StepContext) -> Act:
        """See `Agent`; `context.pending` are the actions that come before the new one."""
        rows, now, decided = context.rows, len(self._decided), self._decided
        due = range(now, now + self.delay) if decided else ()
        context.pending = [decided[max(step - self.delay, 0)][rows] for step in due]
        act = self._agent.act(context)
        decided.append(with_rows(None, rows, act.action))
        return act._replace(action=decided[max(now - self.delay, 0)][rows])


class Recording:
    """An agent whose acts have the inputs and ground truth among their entries, too."""

    def __init__(
        self,
        agent: Agent,
        info: Iterable[str] = (),
        *,
        states: bool = False,
        readings: bool = False,
    ) -> None:
        """Take the agent and the names of the ground truth; see `Worlds.entries`.

        With `readings`, what cameras and sensors give is recorded instead of the inputs.

        With `states`, the fields of the environments' states are recorded, too, such as
        ("state", "body/position").
        """
        self._agent, self._info, self._states = agent, tuple(info), states
        self._seen = "readings" if readings else "inputs"

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        act = self._agent.act(context)
        entries = {**act.entries, **getattr(context, self._seen)}
        entries |= {("info", name): context.info[name] for name in self._info}
        if self._states:
            state = TensorDict(context.state.tensors(), [len(context.rows)]).flatten_keys("/")
            entries |= {("state", name): value for name, value in state.items()}
        return act._replace(entries=entries)
