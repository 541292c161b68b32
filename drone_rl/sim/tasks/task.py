"""The base class of tasks, and the tasks that settings and files name.

A task holds no environment. Its methods are functions of batches of states: the first dimension of
every tensor counts environments. World frame in metres: x forward, y left, z up.
"""

import abc
import dataclasses
import enum
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import TASKS, BaseTaskSettings, TaskSettings
from drone_rl.sim.actions import Actions, Entry
from drone_rl.sim.dynamics import BodyState, ComputerVision, Dynamics, Obstacles
from drone_rl.sim.quiet_dm_control import mjcf
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.utils.batch import Batch
from drone_rl.utils.errors import InputError
from drone_rl.utils.gymnasium_names import register_environment
from drone_rl.utils.plugins import check_name
from drone_rl.utils.schema import shown
from drone_rl.utils.settings import prefixed_errors


@dataclasses.dataclass
class State(Batch):
    """State of N environments; tasks add fields of their own."""

    body: BodyState
    steps: Tensor  # (N,) int64
    """Steps taken in this episode."""
    end_reason: Tensor  # (N,) int64
    """Why the episode ended, one of `Task.ends`."""

    @property
    def drone(self) -> Tensor:
        """Position of the drone, metres. Shape: (N, 3)."""
        return self.body.position


@dataclasses.dataclass
class SampledState(State):
    """The state of a task without a state class of its own."""

    sampled: Tensor  # (N, *)
    """What `Task.sample` returned for each environment."""


S = TypeVar("S", bound=State)


class EndReason(enum.IntEnum):
    """Why an episode ended, for tasks without reasons of their own."""

    RUNNING = 0
    SUCCESS = 1
    FAILURE = 2
    STEP_LIMIT = 3


class Prop(Protocol):
    """A dm_control entity that a task adds to the scene."""

    semantic_class: SemanticClass

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """Its model."""
        ...


@dataclasses.dataclass
class Goals(Batch):
    """Goals of n finished episodes, C each, in the order in which they come up."""

    reached: Tensor  # (n, C) bool
    """Which goals were reached."""
    stratum: Tensor  # (n, C) int64
    """Where each stood when it came up, an index into `Task.strata`; -1 if it never did."""
    world: Tensor  # (n, k)
    """Initial conditions of the episode; equal values mean the same episode."""


class Oracle(Protocol):
    """Knows the best action given the true state."""

    @property
    def reads(self) -> tuple[str, ...]:
        """Entries of the information that it reads."""
        ...

    @property
    def actions(self) -> Actions:
        """Actions that it can fly."""
        ...

    def can_fly(self, actions: Actions) -> bool:
        """Return whether it can act by these actions."""
        ...

    def choose(self, worlds: Any, state: Any) -> Tensor:
        """Return actions in states of `Worlds`. Shape: (N,) and then the entry's."""
        ...


class OracleRule(NamedTuple):
    """The best action given the true state."""

    reads: tuple[str, ...]
    """Entries of the information that it reads."""
    act: Callable[..., Tensor]
    """Maps them, each of shape (N, *), to actions of shape (N,) and then the entry's."""
    actions: Actions

    def can_fly(self, actions: Actions) -> bool:
        """Return whether an action set has all parts that the oracle uses, by name."""
        return set(self.actions.names) <= set(actions.names)

    def decide(self, values: Sequence[Tensor], actions: Actions) -> Tensor:
        """Return full-speed actions, (N,) and then the entry's, of a set that `can_fly` accepts.

        `values` are the entries that it reads, each of shape (N, *).
        """
        action = self.act(*values)
        if actions == self.actions:
            return action
        same = torch.stack([actions.always(name) for name in self.actions.names])
        return same.to(action.device)[self.actions.part(action)]

    def choose(self, worlds: Any, state: Any) -> Tensor:
        """See `Oracle`."""
        info = worlds.info(state)
        return self.decide([info[name] for name in self.reads], worlds.dynamics.actions)


class Task(abc.ABC, Generic[S]):
    """Something to do. A subclass defines `name`, `sample` and `step`; all else has a default.

    With the defaults a task has one goal, which is reached where the episode ends by `success_end`.
    """

    name: str
    """What files and people call it."""
    ends: type[enum.IntEnum] = EndReason
    """Why an episode ends; 0 while it goes on."""
    truncation: int = EndReason.STEP_LIMIT
    """The member of `ends` that truncates an episode; all others terminate it."""
    success_end: int = EndReason.SUCCESS
    """The member of `ends` of success, for which all goals must be reached."""
    expected_end: int = EndReason.FAILURE
    """How an episode ends in which a goal was missed and nothing else went wrong."""
    observed: tuple[str, ...] = ("end_reason",)
    """Entries of the information that dm_control's observations hold."""
    largest_reward: float | None = 1.0
    """The return of a perfect episode; None if it is unknown."""
    drone_size: float = 0.5
    """Edge in metres of the box around the drone."""
    origin: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Where the drone starts, metres."""
    vocabulary: TaskVocabulary = TaskVocabulary()
    """What reports call its goals and targets."""
    strata: tuple[str, ...] = ("anywhere",)
    """Where a goal can stand, from left to right: verdicts count each stratum separately."""
    blind_baselines: tuple[str, ...] = ("random", "forward", "left", "right")
    """Baselines that see nothing: "random", and actions that are always taken, by name."""
    scored: tuple[str, ...] = ("sampled", "end_reason")
    """Entries of an episode's last information that `score` reads."""
    oracle: Oracle | None = None
    """The best action given the true state; None if it is unknown."""
    curriculum: Any = None
    """Widens ranges of its episodes in a training, `Curriculum`; None if they stay."""
    reward_terms: tuple[str, ...] = ()
    """Names of the reward's terms; empty if it is computed as a whole."""
    needed_actions: Mapping[str, str] = {}
    """Names of actions without which no policy can do the task, and what to say then."""
    edits: Any = None
    """How explanations change its scenes, `SceneEdits`; None if they can't."""

    @property
    def entries(self) -> Mapping[str, Entry]:
        """Shapes and types of what `info` returns, for one environment."""
        sampled = self.sample(np.random.RandomState(0))
        return {
            "sampled": Entry(tuple(sampled.shape), torch.float32),
            "end_reason": Entry((1,), torch.int64, 0, len(self.ends) - 1),
        }

    def make_dynamics(self) -> Dynamics:
        """Return the default dynamics of the drone: moves of a metre."""
        return ComputerVision()

    def check_dynamics(self, dynamics: Dynamics) -> None:
        """Raise an `InputError` if no policy could do the task by these actions."""
        for name, problem in self.needed_actions.items():
            if name not in dynamics.actions.names:
                raise InputError(problem)

    def make_props(self) -> Sequence[Prop]:
        """Return new entities besides field and drone, positioned by `places`."""
        return ()

    @abc.abstractmethod
    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample what is random about an episode, always of one shape."""

    def start(self, sampled: Tensor, body: BodyState) -> S:
        """Return states at the start of episodes.

        `sampled` is from `sample`, stacked, shape (N, *); `body` are the drones at `origin`.
        """
        zero = torch.zeros(len(sampled), dtype=torch.int64, device=sampled.device)
        state: Any = SampledState(body, zero, zero.clone(), sampled)
        return state

    @abc.abstractmethod
    def step(self, state: S, body: BodyState) -> tuple[S, Tensor]:
        """Return the state after a step, and the reward: float64, shape (N,).

        `state` is that before the step and stays as it is; `body` are the drones after it.
        """

    def places(self, state: S) -> Tensor:
        """Return where the props are, metres; below the ground if absent. Shape: (N, P, 3)."""
        return state.body.position.new_zeros(len(state), 0, 3)

    def obstacles(self, state: S) -> Obstacles | None:
        """Return what the drones can collide with, for dynamics with contacts; None if nothing."""

    def info(self, state: S) -> dict[str, Tensor]:
        """Return the true state of each environment, as `entries` describes. Shapes: (N, *)."""
        sampled: Tensor = getattr(state, "sampled")  # noqa: B009 (of `SampledState`)
        return {"sampled": sampled.float(), "end_reason": state.end_reason[:, None]}

    def score(self, info: Mapping[str, Tensor]) -> Goals:
        """Return the goals from the entries `scored` at the ends of episodes. Shapes: (n, *)."""
        is_reached = info["end_reason"] == self.success_end
        world = info["sampled"][:, None].flatten(1).double()  # (n, k), also of a single number
        return Goals(is_reached, is_reached.long() * 0, world)

    def classes(self, goals: Any) -> Iterator[tuple[str, str, Tensor]]:
        """Yield the classes of goals, from `score`, that failure tables count: by stratum.

        Each is the name of a property, its value, and which goals have it: bool, shape (n, C).
        """
        for number, stratum in enumerate(self.strata):
            yield "side", stratum, goals.stratum == number


MAKERS: dict[type[BaseTaskSettings], Callable[[Any], Task[Any]]] = {}
"""What makes a task, by the class of its settings."""


class NoSettings(BaseTaskSettings):
    """Settings of a task that is registered as an object: none."""


def register_task(
    settings: type[BaseTaskSettings] | Task[Any], make: Callable[[Any], Task[Any]] | None = None
) -> None:
    """Register a task by name, for settings, policy files and Gymnasium.

    Args:
        settings: Class of the task's settings, or a task without settings.
        make: Makes the task from its settings; not for a task without settings.

    Raises:
        InputError: The name is invalid, or another task has it, unless both are without settings
            or a notebook's cell ran again, or an argument is of the wrong kind.
    """
    if isinstance(settings, Task):
        as_settings(settings)
        return
    is_class = isinstance(settings, type) and issubclass(settings, BaseTaskSettings)
    if not is_class or not callable(make):
        raise InputError(
            f"{shown(settings)} and {shown(make)} make no task; give a task, or the class of its "
            "settings and what makes it: register_task(MySettings, MyTask)"
        )
    _require_name(settings)
    check_name(settings.name, "define_task")
    other = TASKS.get(settings.name, settings)
    if (other.__module__, other.__name__) != (settings.__module__, settings.__name__):
        raise InputError(f"there is a task called {settings.name}; give another name")
    with prefixed_errors(settings.__name__):
        settings()  # its defaults are checked
    TASKS[settings.name], MAKERS[settings] = settings, make
    register_environment(settings.name)


def _require_name(of: type) -> None:
    if not hasattr(of, "name"):
        raise InputError(f'{of.__name__} has no name; add name = "my_task" to the class')


def as_settings(task: Any) -> Any:
    """Return settings that make a task; a task without registered settings is registered.

    Anything else is returned. A task without settings replaces an earlier one of its name; raises
    an `InputError` if a task with settings has its name.
    """
    if not isinstance(task, Task):
        return task
    _require_name(type(task))
    settings: Any = getattr(task, "settings", None)
    if type(settings) in MAKERS and type(as_task(settings)) is type(task):
        return settings
    kind = TASKS.get(task.name)
    if kind is None or not issubclass(kind, NoSettings):  # else a notebook's cell ran again
        names = {"name": task.name, "__module__": type(task).__module__}
        kind = type("NoSettings", (NoSettings,), names)
    register_task(kind, lambda _: task)
    return kind()


def as_task(task: BaseTaskSettings | Task[Any] | str | None) -> Task[Any]:
    """Return a task by settings or name, cube collection by default; raises `InputError`."""
    task = TaskSettings() if task is None else task
    if isinstance(task, str):
        task = BaseTaskSettings.read(task, "task")
    if isinstance(task, Task):
        return task
    if not isinstance(task, BaseTaskSettings):
        raise InputError(
            f"task={shown(task)} is no task; give one of {', '.join(TASKS)}, settings such as "
            "drone_rl.TaskSettings(num_cubes=2), or a task of your own"
        )
    if type(task) not in MAKERS:
        raise InputError(
            f"{type(task).__name__} is the settings of no task; call drone_rl.sim.tasks."
            "register_task with what makes it"
        )
    return MAKERS[type(task)](task)
