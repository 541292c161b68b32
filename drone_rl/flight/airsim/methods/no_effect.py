"""Methods that are accepted without effect."""

from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.methods.registry import method
from drone_rl.flight.airsim.methods.support import GAINS, NOT_SHOWN

method(NOT_SHOWN)(lambda simulation: remark("there is no window"))
method(GAINS)(lambda simulation: remark("gains are settings of the dynamics"))


@method("simRunConsoleCommand simSetLightIntensity")
def _refuse(simulation: object) -> bool:
    """Return false, as AirSim does for a command or a light that it does not know."""
    remark("there are no such commands and lights")
    return False
