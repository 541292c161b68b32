"""Methods that are accepted without effect."""

from collections.abc import Sequence
from typing import Any

from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.methods.registry import method
from drone_rl.flight.airsim.methods.support import GAINS, NOT_SHOWN
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.errors import InputError


@method(*NOT_SHOWN)
def _accept(simulation: Simulation, args: Sequence[Any]) -> None:
    """Do nothing: what the call changes is only seen in Unreal's window."""
    remark("there is no window")


@method("simRunConsoleCommand", "simSetLightIntensity")
def _refuse(simulation: Simulation, args: Sequence[Any]) -> bool:
    """Return false, as AirSim does for a command or a light that it does not know."""
    remark("there are no such commands and lights")
    return False


@method(*GAINS, least=3)
def _gains(simulation: Simulation, args: Sequence[Any]) -> None:
    """Accept the gains of AirSim's controller, which are fixed here."""
    for value, name in zip(args, ("kp", "ki", "kd"), strict=False):
        if not isinstance(value, list | tuple) or len(value) > 4:
            raise InputError(f"{name} is not a list of gains; give three or four numbers")
    remark("gains are settings of the dynamics")
