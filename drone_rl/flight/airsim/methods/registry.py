"""The registry of RPC methods: their names, arguments and functions."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from drone_rl.flight.airsim.messages import text
from drone_rl.flight.airsim.methods.support import UNSUPPORTED
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.flight.commands.command import FlightFuture
from drone_rl.utils.errors import InputError, did_you_mean

_REQUIRED = object()


class Argument(NamedTuple):
    """How an argument of a method is read."""

    read: Callable[[Simulation, Any], Any]
    """Returns what a function takes of a simulation and what the client sent."""
    default: Any = _REQUIRED
    """What counts as sent where a client sends fewer arguments."""


def given(read: Callable[..., Any], name: str, *limits: Any, default: Any = _REQUIRED) -> Argument:
    """Return an argument that a reader of `messages` reads, such as `number` or `read_pose`."""
    return Argument(lambda simulation, value: read(value, name, *limits), default)


VEHICLE = Argument(
    lambda simulation, value: simulation.find(text(value, "vehicle_name")), default=""
)
"""A vehicle by its name, the first one by default."""


class Method(NamedTuple):
    """How a method is called and computed."""

    compute: Callable[..., Any]
    """Takes the simulation and the arguments."""
    arguments: Sequence[Argument]
    """Surplus ones are ignored."""


class UnknownMethodError(Exception):
    """There is no such method."""


METHODS: dict[str, Method] = {}
"""All methods, by their names."""
_Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def method(names: str, *arguments: Argument) -> _Decorator:
    """Register a function of a simulation and arguments under names, which spaces separate."""

    def register(compute: Callable[..., Any]) -> Callable[..., Any]:
        METHODS.update(dict.fromkeys(names.split(), Method(compute, arguments)))
        return compute

    return register


def vehicle_method(names: str, *arguments: Argument) -> _Decorator:
    """Register a function of a vehicle and arguments; clients send the vehicle's name last."""

    def register(compute: Callable[..., Any]) -> Callable[..., Any]:
        method(names, *arguments, VEHICLE)(lambda _, *values: compute(values[-1], *values[:-1]))
        return compute

    return register


def call(simulation: Simulation, name: str, args: Sequence[Any]) -> Any:
    """Return the result of a call, or a `Wait` if it takes simulated time.

    Raises:
        UnknownMethodError: There is no such method.
        InputError: An argument is wrong, or the vehicle's state does not allow it.
    """
    entry = METHODS.get(name)
    if entry is None:
        if name in UNSUPPORTED:
            raise InputError(f"{name} is not supported: this server has no {UNSUPPORTED[name]}")
        raise UnknownMethodError(name)
    sent = [*args, *(argument.default for argument in entry.arguments[len(args) :])]
    if _REQUIRED in sent:
        least = sum(argument.default is _REQUIRED for argument in entry.arguments)
        raise InputError(f"{name} was called with {len(args)} arguments; give {least} or more")
    values = [a.read(simulation, v) for a, v in zip(entry.arguments, sent, strict=False)]
    result = entry.compute(simulation, *values)
    simulation.settle()  # it may have ended other calls, as cancelLastTask and simPause do
    if isinstance(result, FlightFuture):
        return Wait(lambda: result.done, result.result)
    return result


def suggestion(name: str) -> str:
    """Return a hint at methods with a similar name."""
    return did_you_mean(name, METHODS)
