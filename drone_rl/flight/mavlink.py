"""Hardware in the loop: a bridge to a MAVLink autopilot, over a serial port or TCP.

It sends HIL_SENSOR for each step, HIL_GPS and a heartbeat, and receives HIL_ACTUATOR_CONTROLS. It
has not been tested with a real controller: neither PX4, nor ArduPilot, nor any hardware.
"""

import contextlib
import math
import os
import select
import socket
import termios
import time
import tty
from typing import Any, Self

import numpy as np

from drone_rl.flight.in_the_loop.control import RcSticks
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings, Vector, rotation
from drone_rl.flight.server_thread import listening
from drone_rl.sim.coordinates import frd_from_body, ned_from_world, world_from_ned
from drone_rl.utils.errors import InputError, extra

TCP_PORT = 4560
"""Port at which PX4 expects a simulator."""
HEARTBEAT_EVERY = 1.0
"""Wall-clock seconds between heartbeats."""
GPS_EVERY = 0.1
"""Simulated seconds between HIL_GPS messages."""
ROTORS = 4
ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
ALL_SENSORS = 0x1FFF
"""HIL_SENSOR fields_updated: all thirteen fields are new."""
FIELD = (0.1795, 0.0490, 0.4903)
"""Earth's magnetic field at AirSim's home, north, east, down, gauss."""
TEMPERATURE = 15.0
"""Air temperature, degrees Celsius."""
_DIALECT = "pymavlink.dialects.v20.common"
_READ_BYTES = 65536
_FIX_3D, _SATELLITES, _UNKNOWN = 3, 12, 65535


class Link:
    """A bidirectional byte stream. Methods raise FlightControllerError once the peer is gone."""

    def __init__(self, name: str, patience: float, file: int | None = None) -> None:
        """Take the peer's name for messages, and a descriptor in non-blocking mode once connected.

        A peer that accepts no bytes for `patience` seconds counts as gone.
        """
        self.name, self.patience, self._file = name, patience, file

    def accept(self, within: float) -> None:
        """Wait up to so many seconds until the peer has connected."""

    def read(self, within: float) -> bytes:
        """Return received bytes; empty if there are none within so many seconds."""
        file = self._connected()
        if not select.select([file], [], [], within)[0]:
            return b""
        try:
            data = os.read(file, _READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise FlightControllerError(f"{self.name} is gone: {error.strerror}") from error
        if not data:
            raise FlightControllerError(f"{self.name} is gone")
        return data

    def write(self, data: bytes) -> None:
        """Send all bytes."""
        file, end = self._connected(), time.monotonic() + self.patience
        while data:
            try:
                data = data[os.write(file, data) :]
            except BlockingIOError:
                select.select([], [file], [], 0.05)
                if time.monotonic() > end:
                    raise FlightControllerError(f"{self.name} accepts no more bytes") from None
            except OSError as error:
                raise FlightControllerError(f"{self.name} is gone: {error.strerror}") from error

    def close(self) -> None:
        """Close the link."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _connected(self) -> int:
        if self._file is None:
            raise FlightControllerError(f"{self.name} isn't connected; call accept first")
        return self._file


class SerialLink(Link):
    """A serial port, such as that of a flight controller, or a pseudo-terminal."""

    def __init__(self, device: str, baud: int = 921_600, patience: float = 1.0) -> None:
        """Open a device such as /dev/ttyACM0 in raw mode, with so many bits per second.

        Raises:
            InputError: The device can't be opened, is no serial port, or the speed is invalid.
        """
        file, speed = None, getattr(termios, f"B{baud}", None)
        try:
            file = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            tty.setraw(file)
            settings = termios.tcgetattr(file)
            settings[4:6] = [speed or -1] * 2  # 0 would hang up
            termios.tcsetattr(file, termios.TCSANOW, settings)
        except (OSError, OverflowError, termios.error) as error:
            if file is not None:
                os.close(file)
            raise InputError(
                f"device={device} with baud={baud} can't be used ({error}); give a serial port "
                "such as /dev/ttyACM0 and its speed such as 921600"
            ) from error
        super().__init__(device, patience, file)


class TcpLink(Link):
    """A TCP port to which one autopilot connects, as PX4's simulation does."""

    def __init__(self, port: int = TCP_PORT, host: str = "127.0.0.1") -> None:
        """Listen at a port (0 for any free one); by default only this machine can connect.

        Raises:
            InputError: The port is in use, or the port or the host is invalid.
        """
        super().__init__("the autopilot", patience=1.0)
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with listening(host, port):
            self._listener.bind((host, port))
        self._listener.listen(1)
        self.port: int = self._listener.getsockname()[1]
        """The port."""

    def accept(self, within: float) -> None:
        """See `Link`."""
        self._listener.settimeout(within)
        try:
            link, _ = self._listener.accept()
        except (TimeoutError, BlockingIOError):  # the latter with a limit of 0
            raise FlightControllerError(
                f"no autopilot connected to port {self.port} in {within:g} s"
            ) from None
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.setblocking(False)
        self._file = link.detach()

    def close(self) -> None:
        """See `Link`."""
        self._listener.close()
        super().close()


class MavlinkBridge:
    """An autopilot as the controller of a `DroneInTheLoop`; it ignores the sticks."""

    def __init__(
        self,
        link: Link,
        *,
        lockstep: bool = True,
        patience: float = 5.0,
        answer_within: float = 1.0,
        connect_within: float = 30.0,
    ) -> None:
        """Create a bridge that owns and closes the link.

        With `lockstep` each step waits for controls with its time stamp or a later one, for
        `answer_within` seconds once there were any (a starting autopilot sends none), and then uses
        the old ones. Without it, as hardware with its own clock needs, it uses the newest controls.
        An autopilot counts as gone `patience` seconds after its last message, or if no message
        comes within the first `connect_within` seconds.

        Raises:
            InputError: pymavlink isn't installed.
        """
        self._dialect = extra(_DIALECT, "hil", "hardware in the loop")
        self._codec: Any = self._dialect.MAVLink(link, srcSystem=1, srcComponent=200)
        self._codec.robust_parsing = True  # skip invalid bytes
        self.link = link
        self.lockstep = lockstep
        self.patience = patience
        self.answer_within = answer_within
        self.connect_within = connect_within
        self.missed = 0
        """Steps in lockstep, after the first controls, for which no controls came in time."""
        self.is_armed = False
        """Whether the newest controls are armed."""
        self._rotors = np.zeros(4)
        self._controls_time = -1
        self._began = False
        self._heard = self._beaten = -np.inf
        self._next_gps = -np.inf

    def __enter__(self) -> Self:
        """Wait for the autopilot and its first message, which must come in time."""
        with contextlib.ExitStack() as stack:
            stack.callback(self.link.close)
            self.link.accept(self.connect_within)
            end = time.monotonic() + self.connect_within
            while self._heard < 0.0:
                if time.monotonic() > end:
                    raise FlightControllerError(f"no message in {self.connect_within:g} seconds")
                self._beat()
                self._receive(0.05)
            stack.pop_all()
        return self

    def __exit__(self, *exception: object) -> None:
        """Close the link."""
        self.link.close()

    def step(self, readings: Readings, sticks: RcSticks | None = None) -> Vector:
        """Send measurements and return the rotor commands as `rotor_outputs` does.

        The sticks are ignored: pilots of an autopilot have their own link to it.

        Raises:
            FlightControllerError: The autopilot is gone, or has been silent for too long.
        """
        del sticks
        self._beat()
        self._send("hil_sensor", sensor_fields(readings))
        if readings.time >= self._next_gps:
            self._next_gps = readings.time + GPS_EVERY
            self._send("hil_gps", gps_fields(readings))
        self._receive(0.0)
        if self.lockstep:
            self._wait_for_controls(round(readings.time * 1e6))
        if time.monotonic() - self._heard > self.patience:
            raise FlightControllerError(f"the autopilot has been silent for {self.patience:g} s")
        return self._rotors

    def _wait_for_controls(self, since: int) -> None:
        """Wait for controls with this time stamp (microseconds) or a later one."""
        end = time.monotonic() + (self.answer_within if self._began else 0.0)
        while self._controls_time < since:
            left = end - time.monotonic()
            if left <= 0.0:
                self.missed += self._began
                return
            self._receive(min(left, 0.05))

    def _beat(self) -> None:
        now = time.monotonic()
        if now - self._beaten < HEARTBEAT_EVERY:
            return
        self._beaten = now
        kinds = self._dialect
        sender = {"type": kinds.MAV_TYPE_GENERIC, "autopilot": kinds.MAV_AUTOPILOT_INVALID}
        status = {"base_mode": 0, "custom_mode": 0, "system_status": kinds.MAV_STATE_ACTIVE}
        self._send("heartbeat", {**sender, **status})

    def _send(self, name: str, fields: dict[str, Any]) -> None:
        self._codec.send(getattr(self._codec, f"{name}_encode")(**fields))

    def _receive(self, within: float) -> None:
        data = self.link.read(within)
        for message in (self._codec.parse_buffer(data) or ()) if data else ():
            kind = message.get_type()
            if kind == "BAD_DATA" or kind.startswith("UNKNOWN_"):  # without a check of the sum
                continue
            self._heard = time.monotonic()
            if kind == "HIL_ACTUATOR_CONTROLS":
                self._began = True
                self._controls_time = message.time_usec
                self.is_armed = bool(message.mode & ARMED)
                self._rotors = rotor_outputs(message.controls, message.mode)


def sensor_fields(readings: Readings) -> dict[str, Any]:
    """Return the fields of HIL_SENSOR: microseconds, m/s2, rad/s, gauss, hPa, metres, Celsius."""
    force, rates = frd_from_body(readings.force), frd_from_body(readings.rates)
    field = frd_from_body(
        rotation(readings.attitude).apply(world_from_ned(np.array(FIELD)), inverse=True)
    )
    return {
        "time_usec": round(readings.time * 1e6),
        **dict(zip(("xacc", "yacc", "zacc"), map(float, force), strict=True)),
        **dict(zip(("xgyro", "ygyro", "zgyro"), map(float, rates), strict=True)),
        **dict(zip(("xmag", "ymag", "zmag"), map(float, field), strict=True)),
        "abs_pressure": readings.pressure / 100.0,
        "diff_pressure": 0.0,
        "pressure_alt": readings.altitude,
        "temperature": TEMPERATURE,
        "fields_updated": ALL_SENSORS,
    }


def gps_fields(readings: Readings) -> dict[str, Any]:
    """Return the fields of HIL_GPS: microseconds, 1e-7 degrees, millimetres, cm/s."""
    latitude, longitude, altitude = readings.place
    north, east, down = ned_from_world(readings.velocity) * 100.0
    speed = math.hypot(north, east)
    course = math.degrees(math.atan2(east, north)) % 360.0
    return {
        "time_usec": round(readings.time * 1e6),
        "fix_type": _FIX_3D,
        "lat": round(latitude * 1e7),
        "lon": round(longitude * 1e7),
        "alt": round(altitude * 1e3),
        "eph": 100,
        "epv": 100,
        "vel": min(round(speed), _UNKNOWN - 1),
        "vn": _int16(north),
        "ve": _int16(east),
        "vd": _int16(down),
        "cog": round(course * 100.0) % 36000,
        "satellites_visible": _SATELLITES,
    }


def rotor_outputs(controls: list[float], mode: int) -> Vector:
    """Return the rotor commands in HIL_ACTUATOR_CONTROLS for an X frame.

    The first four of its sixteen outputs are rotors in PX4's order, which is ours: front right,
    rear left, front left, rear right, 0 to 1. All are 0 if the mode is disarmed, and an output that
    is not finite is 0. Shape: (4,).
    """
    if not mode & ARMED:
        return np.zeros(ROTORS)
    rotors = np.array(controls[:ROTORS], dtype=np.float64)
    return np.nan_to_num(rotors, nan=0.0, posinf=0.0, neginf=0.0).clip(0.0, 1.0)


def _int16(value: float) -> int:
    return max(-32768, min(32767, round(float(value))))
