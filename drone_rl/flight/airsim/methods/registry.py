"""The registry of RPC methods, and the arguments that many have."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

from drone_rl.flight.airsim.messages import text
from drone_rl.flight.airsim.methods.support import UNSUPPORTED
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.utils.errors import InputError, did_you_mean


@dataclasses.dataclass(frozen=True)
class Method:
    """How a method is called and computed."""

    compute: Callable[..., Any]
    least: int
    """Fewest arguments; surplus ones are ignored."""


class UnknownMethodError(Exception):
    """There is no such method."""


METHODS: dict[str, Method] = {}
"""All methods, by their names."""


def method(*names: str, least: int = 0) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function of (simulation, arguments) under names of RPC methods."""

    def register(compute: Callable[..., Any]) -> Callable[..., Any]:
        METHODS.update(dict.fromkeys(names, Method(compute, least)))
        return compute

    return register


def call(simulation: Simulation, name: str, args: Sequence[Any]) -> Any:
    """Return the result of a call, or a `Wait` if it takes simulated time.

    Raises:
        UnknownMethodError: There is no such method.
        InputError: An argument is wrong, or the vehicle's state does not allow it.
    """
    found = METHODS.get(name)
    if found is None:
        if name in UNSUPPORTED:
            raise InputError(f"{name} is not supported: this server has no {UNSUPPORTED[name]}")
        raise UnknownMethodError(name)
    if len(args) < found.least:
        raise InputError(
            f"{name} was called with {len(args)} arguments; give {found.least} or more"
        )
    result = found.compute(simulation, args)
    simulation.settle()  # it may have ended other calls, as cancelLastTask and simPause do
    return result


def suggestion(name: str) -> str:
    """Return a hint at methods with a similar name."""
    return did_you_mean(name, METHODS)


def argument(args: Sequence[Any], index: int, default: Any = None) -> Any:
    """Return an argument, or the default where fewer are given."""
    return args[index] if len(args) > index else default


def name_at(args: Sequence[Any], index: int) -> str:
    """Return the name of a vehicle; "" where none is given."""
    return text(argument(args, index, ""), "vehicle_name")


def vehicle_at(simulation: Simulation, args: Sequence[Any], index: int) -> Vehicle:
    """Return the vehicle that an argument names; errors name its API, as in AirSim."""
    return simulation.find(name_at(args, index))


def sim_vehicle_at(simulation: Simulation, args: Sequence[Any], index: int) -> Vehicle:
    """Return the vehicle that an argument names; errors name its Sim-API, as in AirSim."""
    return simulation.find(name_at(args, index), is_sim_api=True)
