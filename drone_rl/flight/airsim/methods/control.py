"""Methods of the handshake, of control, of the clock and of recordings; those without effect."""

from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.messages import flag, number, whole
from drone_rl.flight.airsim.methods.registry import given, method, vehicle_method
from drone_rl.flight.airsim.methods.support import GAINS, NOT_SHOWN
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle

SERVER_VERSION, MIN_CLIENT_VERSION = 4, 1
"""Versions that clients 1.2 to 1.8 and Cosys 3.5 accept without a warning."""

method("ping isSimulationMode")(lambda simulation: True)
method("getServerVersion")(lambda simulation: SERVER_VERSION)
method("getMinRequiredClientVersion")(lambda simulation: MIN_CLIENT_VERSION)
method("listVehicles")(lambda simulation: [*simulation.vehicles])
method("getSettingsString")(lambda simulation: simulation.settings.text)
method("getServerDebugInfo getDebugInfo")(lambda simulation: "")
method("timestampNow")(lambda simulation: simulation.stamp)
method("reset")(Simulation.reset)

vehicle_method("enableApiControl", given(flag, "is_enabled"))(Vehicle.enable_api_control)
vehicle_method("isApiControlEnabled")(lambda vehicle: vehicle.has_api_control)
vehicle_method("armDisarm", given(flag, "arm"))(Vehicle.set_armed)
vehicle_method("cancelLastTask")(Vehicle.cancel)

method("simPause", given(flag, "is_paused"))(Simulation.pause)
method("simIsPause simIsPaused")(lambda simulation: simulation.is_paused)
method("simContinueForTime", given(number, "seconds", 0.0, 1e6))(Simulation.continue_for)
method("simContinueForFrames", given(whole, "frames", 0, 10**6))(
    lambda simulation, frames: simulation.continue_for(frames * simulation.period_s)
)

method("startRecording")(Simulation.start_recording)
method("stopRecording")(Simulation.stop_recording)
method("isRecording")(lambda simulation: simulation.recording is not None)

method(NOT_SHOWN)(lambda simulation: remark("there is no window"))
method(GAINS)(lambda simulation: remark("gains are settings of the dynamics"))


@method("simRunConsoleCommand simSetLightIntensity")
def _refuse(simulation: object) -> bool:
    """Return false, as AirSim does for a command or a light that it does not know."""
    remark("there are no such commands and lights")
    return False
