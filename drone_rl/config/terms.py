"""Terms of tasks: named functions of a `Step`, for rewards, ends and success, or of a `Mover`.

A user's file registers a term with a decorator, and any task can then name it:

    @reward("near_wall", weight=-0.1)
    def near_wall(step: Step, distance: float = 0.5) -> float:
        return wp.where(step.clearance < distance, 1.0, 0.0)

Warp compiles the functions into the kernels of single steps and of whole episodes. Their numbers,
weights included, are arrays there, so that other numbers compile nothing. A function of `Steps` is
in torch: it is called between two kernels of a step, and whole episodes are not fused.
"""

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator

from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.plugins import check_name, place_of, require_own
from drone_rl.utils.schema import Real, shown
from drone_rl.utils.settings import Settings, about, prefixed_errors

MOST_PARAMETERS = 4
"""Largest number of parameters of a term."""
F = TypeVar("F", bound=Callable[..., Any])
Number = Annotated[float, Real(-1e6, 1e6)]


class TermSettings(Settings):
    """The numbers of a term: its parameters, and the weight of a reward."""


class RewardSettings(TermSettings):
    """The numbers of a reward term; `drone-rl terms` lists all terms."""

    weight: Number = 1.0
    """Factor of the term's values."""


@dataclasses.dataclass(frozen=True)
class Term:
    """A registered term."""

    name: str
    function: Callable[..., Any] | None
    """Maps a `Step` and the parameters to a number, or to whether an episode ends.

    None until the module of a shipped term is imported, so that settings need no simulator.
    """
    settings: type[TermSettings]
    parameters: tuple[str, ...]
    """Names of the parameters, in order."""
    is_exact: bool
    """Whether the parameters are `wp.float64` and not `float`."""
    is_torch: bool = False
    """Whether the function maps the `Steps` of N environments to a tensor, (N,)."""

    @classmethod
    def of(
        cls, name: str, function: Callable[..., Any], first: str = "step: Step", **own: float
    ) -> "Term":
        """Return a function with a `first` parameter as a term; see `Terms.register`."""
        place, every = place_of(function), [*inspect.signature(function).parameters.values()]
        if not 1 <= len(every) <= 1 + MOST_PARAMETERS:
            raise InputError(
                f"{place} has {len(every)} parameters; give {first} and at most "
                f"{MOST_PARAMETERS} numbers"
            )
        kind, *kinds = (getattr(p.annotation, "__name__", str(p.annotation)) for p in every)
        rest, types = every[1:], {*kinds}
        is_torch = kind.split(".")[-1] == "Steps"
        if is_torch and "Step" not in first:
            raise InputError(f"{place} is in torch, which moves no objects; give {first}")
        is_exact = bool(types) and all("float64" in of for of in types)
        for p in rest:
            is_number = isinstance(p.default, int | float) and not isinstance(p.default, bool)
            if not is_number or not (is_exact or types == {"float"}):
                raise InputError(
                    f"{place}: the parameter {p.name} is no number; write {p.name}: float = 1.0"
                )
            if p.name in own or hasattr(TermSettings, p.name):
                raise InputError(
                    f"{place}: settings of terms have {p.name} already; rename the parameter"
                )
        settings = _settings_class(name, {**own, **{p.name: p.default for p in rest}})
        with prefixed_errors(name):
            settings()  # its defaults are checked
        return cls(name, function, settings, tuple(p.name for p in rest), is_exact, is_torch)

    @property
    def module(self) -> str:
        """Name of the module that defines it."""
        return __name__ if self.function is None else self.function.__module__

    @property
    def meaning(self) -> str:
        """First paragraph of the function's docstring."""
        return about(self.function)  # pyright: ignore[reportArgumentType] (of any object)


def _settings_class(name: str, numbers: Mapping[str, float]) -> type[TermSettings]:
    hints = dict.fromkeys(numbers, Number)
    members = {"__annotations__": hints, "__module__": __name__, **numbers}
    base = RewardSettings if "weight" in numbers else TermSettings
    kind: Any = type(f"{name}_settings", (base,), members)
    return kind


class Terms:
    """The registered terms of a kind, by name."""

    def __init__(self, kind: str, first: str = "step: Step") -> None:
        """Begin without terms; `kind` names the decorator, `first` the functions' parameter."""
        self.kind, self._first, self.by_name = kind, first, dict[str, Term]()

    @property
    def words(self) -> str:
        """The allowed values of a setting in words."""
        return f"{self.kind} terms by name"

    @property
    def registry(self) -> dict[str, type[TermSettings]]:
        """Settings of each term by its name."""
        return {name: term.settings for name, term in self.by_name.items()}

    def register(self, name: str, **own: float) -> Callable[[F], F]:
        """Return a decorator that registers a function; `own` are numbers that are not arguments.

        Raises:
            InputError: The name is invalid or taken, or a parameter is no number.
        """
        check_name(name, self.kind)

        def decorate(function: F) -> F:
            if name in self.by_name:
                owner = self.by_name[name].module
                require_own(f"{self.kind} {name}", owner, function.__module__)
            self.by_name[name] = Term.of(name, function, self._first, **own)
            return function

        return decorate

    def declare(self, name: str, weight: float | None = None, **parameters: float) -> None:
        """Register a shipped term whose function `implement` adds; only rewards have a weight."""
        own = {} if weight is None else {"weight": weight}
        settings = _settings_class(name, {**own, **parameters})
        self.by_name[name] = Term(name, None, settings, tuple(parameters), is_exact=False)

    def implement(self, name: str) -> Callable[[F], F]:
        """Return a decorator that adds the function of a declared term."""

        def decorate(function: F) -> F:
            self.by_name[name] = dataclasses.replace(self.by_name[name], function=function)
            return function

        return decorate

    def read(self, given: Any) -> Any:
        """Return settings by name from a mapping or a list of names; None leaves a term out.

        A number is the weight of a term with its default parameters. Raises an `InputError` for
        unknown names.
        """
        if isinstance(given, list | tuple):
            given = {name: {} for name in given}
        if not isinstance(given, Mapping):
            return given
        return {name: self._settings(name, of) for name, of in given.items() if of is not None}

    def _settings(self, name: Any, given: Any) -> TermSettings:
        if name not in self.by_name:
            raise InputError(
                f"{name} is unknown; choose from {', '.join(self.by_name)}, or register a "
                f"function with @drone_rl.{self.kind}({shown(name)})"
                f"{did_you_mean(name, self.by_name)}"
            )
        of = self.by_name[name].settings
        if isinstance(given, of):
            return given
        return of.read({"weight": given} if isinstance(given, int | float) else given, name)


REWARDS, ENDS, SUCCESSES = Terms("reward"), Terms("end"), Terms("success")
EVENTS = Terms("event", "mover: Mover")
ALL_TERMS = {
    "task.reward": REWARDS,
    "task.end": ENDS,
    "task.success": SUCCESSES,
    "task.objects.NAME.event": EVENTS,
}
"""Every kind of terms by its setting."""
for _name, _weight in {
    "progress": 1.0,
    "reached": 1.0,
    "contact": -1.0,
    "time": -0.01,
    "control": -0.01,
    "smoothness": -0.01,
    "facing": 0.01,
}.items():
    REWARDS.declare(_name, _weight)
REWARDS.declare("altitude", -0.01, height=2.5)
ENDS.declare("contact")
ENDS.declare("out_of_bounds")
SUCCESSES.declare("all_goals")
EVENTS.declare("orbit", radius=2.0, period=10.0)
EVENTS.declare("shuttle", distance=2.0, period=10.0, heading=90.0)
_Read = dict[str, TermSettings]
Rewards = Annotated[_Read, REWARDS, BeforeValidator(REWARDS.read)]
"""Terms of a reward by name, each with a weight and parameters of its own."""
Ends = Annotated[_Read, ENDS, BeforeValidator(ENDS.read)]
"""Reasons to end an episode, by name."""
Success = Annotated[_Read, SUCCESSES, BeforeValidator(SUCCESSES.read)]
"""A meaning of success, by name."""
Events = Annotated[_Read, EVENTS, BeforeValidator(EVENTS.read)]
"""What moves objects, by name."""


def reward(name: str, weight: float = 1.0) -> Callable[[F], F]:
    """Register a reward term, a function of a `Step` and of numbers with defaults.

    Args:
        name: What settings call it: `task.reward.NAME.weight`.
        weight: Default factor of its values.
    """
    return REWARDS.register(name, weight=weight)


def end(name: str) -> Callable[[F], F]:
    """Register a reason to end an episode: a function that returns whether it ends.

    Args:
        name: What settings and results call it: `task.end.NAME`.
    """
    return ENDS.register(name)


def success(name: str) -> Callable[[F], F]:
    """Register a meaning of success: a function that returns whether the task is done.

    Args:
        name: What settings call it: `task.success.NAME`.
    """
    return SUCCESSES.register(name)


def event(name: str) -> Callable[[F], F]:
    """Register what moves an object: a function of a `Mover` that returns a velocity, `wp.vec3`.

    Args:
        name: What settings call it: `task.objects.OBJECT.event.NAME`.
    """
    return EVENTS.register(name)
