"""Methods of the handshake, of control, of the clock and of recordings."""

from collections.abc import Sequence
from typing import Any

from drone_rl.flight.airsim.messages import flag, number, whole
from drone_rl.flight.airsim.methods.registry import method, vehicle_at
from drone_rl.flight.airsim.simulation import Simulation, Wait

SERVER_VERSION, MIN_CLIENT_VERSION = 4, 1
"""Versions that clients 1.2 to 1.8 and Cosys 3.5 accept without a warning."""


@method("ping")
def _ping(simulation: Simulation, args: Sequence[Any]) -> bool:
    return True


@method("getServerVersion")
def _server_version(simulation: Simulation, args: Sequence[Any]) -> int:
    return SERVER_VERSION


@method("getMinRequiredClientVersion")
def _client_version(simulation: Simulation, args: Sequence[Any]) -> int:
    return MIN_CLIENT_VERSION


@method("listVehicles")
def _list_vehicles(simulation: Simulation, args: Sequence[Any]) -> list[str]:
    return [*simulation.vehicles]


@method("getSettingsString")
def _settings_string(simulation: Simulation, args: Sequence[Any]) -> str:
    return simulation.settings.text


@method("isSimulationMode")
def _is_simulation(simulation: Simulation, args: Sequence[Any]) -> bool:
    return True


@method("getServerDebugInfo", "getDebugInfo")
def _debug_info(simulation: Simulation, args: Sequence[Any]) -> str:
    return ""


@method("timestampNow")
def _timestamp(simulation: Simulation, args: Sequence[Any]) -> int:
    return simulation.stamp


@method("enableApiControl", least=1)
def _enable(simulation: Simulation, args: Sequence[Any]) -> None:
    vehicle_at(simulation, args, 1).allow(flag(args[0], "is_enabled"))


@method("isApiControlEnabled")
def _is_enabled(simulation: Simulation, args: Sequence[Any]) -> bool:
    return vehicle_at(simulation, args, 0).has_api_control


@method("armDisarm", least=1)
def _arm(simulation: Simulation, args: Sequence[Any]) -> bool:
    return vehicle_at(simulation, args, 1).set_armed(flag(args[0], "arm"))


@method("cancelLastTask")
def _cancel(simulation: Simulation, args: Sequence[Any]) -> None:
    vehicle_at(simulation, args, 0).cancel()


@method("reset")
def _reset(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.reset()


@method("simPause", least=1)
def _pause(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.pause(flag(args[0], "is_paused"))


@method("simIsPause", "simIsPaused")
def _is_paused(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.is_paused


@method("simContinueForTime", least=1)
def _continue(simulation: Simulation, args: Sequence[Any]) -> Wait:
    return simulation.continue_for(number(args[0], "seconds", 0.0, 1e6))


@method("simContinueForFrames", least=1)
def _continue_frames(simulation: Simulation, args: Sequence[Any]) -> Wait:
    return simulation.continue_for(whole(args[0], "frames", 0, 10**6) * simulation.period_s)


@method("startRecording")
def _start_recording(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.start_recording()


@method("stopRecording")
def _stop_recording(simulation: Simulation, args: Sequence[Any]) -> None:
    simulation.stop_recording()


@method("isRecording")
def _is_recording(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.recording is not None
