"""Fly a quadrotor under Betaflight: `python -m drone_rl.flight.firmware.trial`."""

import contextlib
import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.firmware.course import fly_course
from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.firmware import find_firmware
from drone_rl.flight.firmware.flight import TICK, LoopedDrone
from drone_rl.flight.firmware.sitl import Betaflight
from drone_rl.sim.dynamics import FlightState, Quadrotor
from drone_rl.utils.errors import InputError


@contextlib.contextmanager
def betaflight_drone(
    settings: DynamicsSettings | None = None,
    *,
    firmware: str | Path | None = None,
    folder: str | Path | None = None,
    isolated: bool = True,
) -> Iterator[LoopedDrone[FlightState]]:
    """A drone that stands at the world's origin, not yet armed; the firmware ends with the block.

    Args:
        settings: Of its body, of the air, and of the loops that move its sticks; AirSim's by
            default. Their tick is replaced by the firmware's.
        firmware: See `find_firmware`.
        folder: Where the firmware keeps how it was set up; by default one that is deleted.
        isolated: See `drone_rl.flight.firmware.keeping.Keeping`.

    Raises:
        InputError: No firmware was built, or a port is taken.
        LoopError: The firmware can't be started.
    """
    program = find_firmware(firmware)
    chosen = (settings or DynamicsSettings()).replace(mode="simple_flight", tick=TICK)
    physics = Quadrotor(chosen)
    place = torch.tensor([[0.0, 0.0, chosen.radius]], dtype=torch.float64)
    body = FlightState.at_rest(place)
    physics.push(body, torch.zeros(1, 4, dtype=torch.float64), 1)  # its kernels are loaded now
    with contextlib.ExitStack() as stack:
        if folder is None:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="betaflight-"))
        controller = Betaflight([str(program)], Path(folder), isolated=isolated)
        yield LoopedDrone(physics, body, stack.enter_context(controller), chosen)


def main() -> None:
    """Arms, takes off, hovers, flies a square, lands, and prints how well."""
    try:
        with betaflight_drone() as drone:
            report = fly_course(drone)
    except (InputError, LoopError) as error:
        sys.exit(f"error: {error}")
    sys.stdout.write(json.dumps(report.values(), indent=1) + "\n")


if __name__ == "__main__":
    main()
