"""Software in the loop: Betaflight's firmware in lockstep with the simulation.

`python -m drone_rl.flight.betaflight.sitl` flies a trial flight. The firmware is a process in its
own folder and, if the system allows it, its own network namespace; it ends with the `Betaflight`
that started it.

The firmware makes one step of its controllers, of 1 ms, for each state that it receives. It
measures everything else, such as stick speeds, by the wall clock: if its clock followed simulated
time, firmware and simulation would wait for each other, slower and slower.
"""

import contextlib
import dataclasses
import json
import socket
import struct
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Self

import numpy as np
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.flight.betaflight.build import find_firmware
from drone_rl.flight.betaflight.process import FirmwareProcess
from drone_rl.flight.in_the_loop.control import FULL_ANGLE, FULL_YAW_RATE, LOWEST, RcSticks
from drone_rl.flight.in_the_loop.drone import TICK, DroneInTheLoop, FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings, Vector
from drone_rl.flight.in_the_loop.trial_flight import fly_course
from drone_rl.sim.coordinates import enu_from_world, frd_from_body, ned_attitude_from_world
from drone_rl.sim.dynamics import FlightState, Quadrotor
from drone_rl.sim.dynamics.state import LEVEL
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import make_folder

MEMORY = "eeprom.bin"
"""The file in which the firmware stores its settings."""
STICKS_EVERY = 0.01
"""Simulated seconds between RC packets."""
STARTS = 3
"""Greatest number of attempts to start the firmware."""
_AWAKE = 10
"""Consecutive answers after which a firmware counts as running."""
_WAKES_WITHIN = 0.05
_STANDING = Readings(
    time=0.0,
    position=np.zeros(3),
    velocity=np.zeros(3),
    attitude=np.array(LEVEL),
    rates=np.zeros(3),
    force=np.array([0.0, 0.0, GRAVITY]),
)
_PROMPT = b"\n# "
_CHANNELS = 16
_STATE = struct.Struct("<d3d3d4d3d3dd")
_RC = struct.Struct(f"<d{_CHANNELS}H")
_ROTORS = struct.Struct("<4f")
"""Packets are little-endian, without padding, over UDP. Each field has its own frame."""
SETUP = (
    "aux 0 0 0 1700 2100 0 0",  # fifth channel: armed
    "aux 1 1 1 1700 2100 0 0",  # sixth channel: ANGLE
    "set pid_process_denom = 8",  # of 8 kHz: its controllers assume a step of 1 ms
    "set small_angle = 180",
    "set angle_limit = {angle}",
    *(f"set {axis}_expo = 0" for axis in ("roll", "pitch", "yaw")),
    # Equal values make an axis linear; ANGLE mode uses the same curve.
    *(f"set {axis}_{rate} = 60" for axis in ("roll", "pitch") for rate in ("rc_rate", "srate")),
    *(f"set yaw_{rate} = {{yaw}}" for rate in ("rc_rate", "srate")),
    # Gains for a large frame; the defaults suit small ones, which turn ten times as readily.
    "set p_yaw = 250",
    "set i_yaw = 20",
    # The firmware measures stick speeds by the wall clock, which simulation does not follow: with
    # feedforward the same sticks tilt the drone by 30 degrees in one flight and by 80 in another.
    "set angle_feedforward = 0",
    "set f_yaw = 0",
)
"""Command lines that set up a new firmware, without `save`: {angle} is the roll or pitch at full
stick, degrees, {yaw} the yaw rate, tens of degrees per second."""


class Betaflight:
    """One running firmware, as a context manager."""

    def __init__(
        self,
        program: Sequence[str],
        folder: Path,
        *,
        isolated: bool = True,
        patience: float = 10.0,
        answer_within: float = 0.02,
    ) -> None:
        """Take the firmware with its arguments; it starts in `__enter__`.

        The folder of its settings and log is created if missing; a firmware without settings is set
        up. After `patience` seconds of silence it counts as dead; while it starts it is started
        again after half of that, `STARTS` starts in all. After `answer_within` seconds without an
        answer to one state the rotors keep their commands. See `FirmwareProcess` for `isolated`.
        """
        self.program = list(program)
        self.folder = folder
        self.log = folder / "firmware.log"
        """The firmware's output."""
        self.isolated = isolated
        self.patience = patience
        self.answer_within = answer_within
        self.missed = 0
        """States that were not answered in time."""
        self._silence = 0.0
        """Seconds of waiting since the last answer."""
        self._open = contextlib.ExitStack()

    def __enter__(self) -> Self:
        """Start the firmware; set it up first if the folder has no settings."""
        self._rotors, self._next_sticks = np.zeros(4), -np.inf
        make_folder(self.folder)
        with contextlib.ExitStack() as stack:
            self._process = stack.enter_context(FirmwareProcess(isolated=self.isolated))
            if not (self.folder / MEMORY).exists():
                self._set_up()
            self._start()
            self._open = stack.pop_all()
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop the firmware."""
        self._open.close()

    def step(self, readings: Readings, sticks: RcSticks) -> Vector:
        """Send a state and sticks; return the rotor commands as `unpack_rotors` does.

        Raises:
            FlightControllerError: The firmware has ended, has been silent for too long, or sent an
                invalid packet.
        """
        if readings.time >= self._next_sticks:
            self._next_sticks = readings.time + STICKS_EVERY
            self._send(self._process.sticks, pack_sticks(readings.time, sticks.channels))
        self._drop_late_answers()
        self._send(self._process.state, pack_state(readings))
        begin = time.monotonic()
        try:
            self._rotors = unpack_rotors(self._process.rotors.recv(64))
            self._silence = 0.0
        except TimeoutError:
            self.missed += 1
            self._silence += time.monotonic() - begin
            if self._silence > self.patience:
                raise self._failure(f"has been silent for {self.patience:g} s") from None
        except ValueError as error:
            raise self._failure(f"sent an invalid packet ({error})") from error
        return self._rotors

    def _failure(self, what: str) -> FlightControllerError:
        status = self._process.status()
        what = what if status is None else f"ended with status {status}"
        return FlightControllerError(f"the firmware {what}; see its log {self.log}")

    def _send(self, sock: socket.socket, packet: bytes) -> None:
        with contextlib.suppress(ConnectionRefusedError):  # not running yet, or dead: see step
            sock.send(packet)

    def _drop_late_answers(self) -> None:
        self._process.rotors.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self._process.rotors.recv(64)
        self._process.rotors.settimeout(self.answer_within)

    def _start(self) -> None:
        """Start the firmware and wait until it steps.

        Its threads share a clock without a lock: sometimes it hangs and is started again.
        """
        for _ in range(STARTS):
            self._process.start(self.program, self.folder, self.log)
            end = time.monotonic() + self.patience / 2
            while time.monotonic() < end:
                if self._answers():
                    self._silence = 0.0
                    return
        raise self._failure(f"did not answer in {STARTS} starts of {self.patience / 2:g} s each")

    def _answers(self) -> bool:
        for _ in range(_AWAKE):
            self._drop_late_answers()
            self._send(self._process.state, pack_state(_STANDING))
            self._process.rotors.settimeout(_WAKES_WITHIN)  # packets before it listens are lost
            try:
                self._process.rotors.recv(64)
            except TimeoutError:
                return False
        return True

    def _set_up(self) -> None:
        self._process.start(self.program, self.folder, self.log)
        angle = round(float(np.degrees(FULL_ANGLE)))
        yaw = round(float(np.degrees(FULL_YAW_RATE)) / 10.0)
        try:
            cli = self._process.connect(self.patience)
            cli.settimeout(self.patience)
            _command(cli, b"#")
            for line in SETUP:
                _command(cli, line.format(angle=angle, yaw=yaw).encode() + b"\n")
            cli.sendall(b"save\n")
            self._wait_for_end()
        except (OSError, FlightControllerError) as error:
            (self.folder / MEMORY).unlink(missing_ok=True)  # partial settings must not be reused
            raise FlightControllerError(f"the firmware can't be set up: {error}") from error
        except BaseException:
            (self.folder / MEMORY).unlink(missing_ok=True)
            raise

    def _wait_for_end(self) -> None:
        end = time.monotonic() + self.patience
        while self._process.status() is None:
            if time.monotonic() > end:
                raise FlightControllerError("it doesn't exit after `save`")
            time.sleep(0.02)


def pack_state(readings: Readings) -> bytes:
    """Pack `fdm_packet`: time, gyroscope, accelerometer, attitude, velocity, place, pressure.

    The gyroscope is in forward-right-down, the attitude relates that frame to north-east-down, the
    accelerometer is our body frame with all signs inverted, the velocity is east-north-up, and the
    place is longitude, latitude, altitude, as the firmware's virtual GPS expects.

    The time is constant, so that the firmware's clock is the wall clock.
    """
    latitude, longitude, altitude = readings.place
    return _STATE.pack(
        0.0,
        *frd_from_body(readings.rates),
        *-readings.force,
        *ned_attitude_from_world(readings.attitude),
        *enu_from_world(readings.velocity),
        *(longitude, latitude, altitude),
        readings.pressure,
    )


def pack_sticks(time: float, channels: Sequence[int]) -> bytes:
    """Pack `rc_packet`: seconds, and `RcSticks.channels`; further channels are low."""
    return _RC.pack(time, *channels, *[LOWEST] * (_CHANNELS - len(channels)))


def unpack_rotors(packet: bytes) -> Vector:
    """Unpack `servo_packet`: front right, rear left, front left, rear right, 0 to 1. Shape: (4,).

    Raises:
        ValueError: The packet is invalid.
    """
    if len(packet) != _ROTORS.size:
        raise ValueError(f"a rotor packet must have {_ROTORS.size} bytes, got {len(packet)}")
    rotors = np.array(_ROTORS.unpack(packet), dtype=np.float64)
    if not np.isfinite(rotors).all():
        raise ValueError(f"rotors={rotors.tolist()} are not finite")
    return rotors.clip(0.0, 1.0)


def _command(cli: socket.socket, line: bytes) -> bytes:
    """Send a command line and return the answer up to the next prompt."""
    cli.sendall(line)
    answer = b""
    while not answer.endswith(_PROMPT):
        part = cli.recv(4096)
        if not part:
            raise FlightControllerError(f"its command line closed after {line.decode().strip()!r}")
        answer += part
    if b"ERROR" in answer or b"INVALID" in answer.upper():
        words = answer.decode(errors="replace").strip("# \r\n").replace("\r\n", " ")
        raise FlightControllerError(f"its command line refuses {line.decode().strip()!r}: {words}")
    return answer


@contextlib.contextmanager
def betaflight_drone(
    settings: DynamicsSettings | None = None,
    *,
    firmware: str | Path | None = None,
    folder: str | Path | None = None,
    isolated: bool = True,
) -> Iterator[DroneInTheLoop]:
    """Yield a disarmed drone at the world's origin; the firmware ends with the block.

    Args:
        settings: Vehicle, wind, and gains of the outer loops; AirSim's by default. The firmware's
            tick replaces theirs.
        firmware: See `find_firmware`.
        folder: Folder of the firmware's settings; a temporary one by default.
        isolated: See `FirmwareProcess`.

    Raises:
        InputError: No firmware was built, the folder can't be created, or a port is in use.
        FlightControllerError: The firmware can't be started.
    """
    program = find_firmware(firmware)
    chosen = (settings or DynamicsSettings()).replace(mode="simple_flight", tick=TICK)
    physics = Quadrotor(chosen)
    place = torch.tensor([[0.0, 0.0, chosen.radius]], dtype=torch.float64)
    body = FlightState.at_rest(place)
    physics.push(body, torch.zeros(1, 4, dtype=torch.float64), 1)  # load its kernels now
    with contextlib.ExitStack() as stack:
        if folder is None:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="betaflight-"))
        controller = Betaflight([str(program)], Path(folder), isolated=isolated)
        yield DroneInTheLoop(physics, body, stack.enter_context(controller), chosen)


def main() -> None:
    """Fly a trial flight and print its results as JSON."""
    try:
        with betaflight_drone() as drone:
            report = fly_course(drone)
    except (InputError, FlightControllerError) as error:
        sys.exit(f"error: {error}")
    sys.stdout.write(json.dumps(dataclasses.asdict(report), indent=1) + "\n")


if __name__ == "__main__":
    main()
