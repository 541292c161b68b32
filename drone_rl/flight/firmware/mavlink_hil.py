"""Hardware in the loop: a bridge to an autopilot that speaks MAVLink.

Out go HIL_SENSOR for each step, HIL_GPS and a heartbeat; in comes HIL_ACTUATOR_CONTROLS. It was
never tried with a real controller: neither PX4, nor ArduPilot, nor any hardware.
"""

import contextlib
import time
from types import TracebackType
from typing import Any, Self

import numpy as np

from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.hil_messages import ARMED, gps_fields, rotors_of, sensor_fields
from drone_rl.flight.firmware.senses import Senses, Vector
from drone_rl.flight.firmware.sticks import Sticks
from drone_rl.flight.firmware.wires import TcpWire, Wire
from drone_rl.utils.errors import extra

_DIALECT = "pymavlink.dialects.v20.common"
HEARTBEAT_EVERY = 1.0
"""Seconds on the clock on the wall."""


class MavlinkBridge:
    """One autopilot on a wire; a controller of a `LoopedDrone`, whose sticks it ignores."""

    def __init__(
        self,
        wire: Wire,
        *,
        lockstep: bool = True,
        gps_every: float = 0.1,
        patience: float = 5.0,
        answer_within: float = 1.0,
        connect_within: float = 30.0,
    ) -> None:
        """Takes a wire, which it closes in the end.

        Args:
            wire: To the autopilot.
            lockstep: Whether each step waits for controls of its own time, or of a later one; else
                for none, and the newest that have come count, as hardware by its own clock needs.
            gps_every: Seconds of simulated time from one HIL_GPS to the next.
            patience: Seconds without any word from the autopilot after which it counts as gone.
            answer_within: Seconds to wait for controls in lockstep, once there were any: an
                autopilot that is still starting has none. Then the step goes on with the old ones.
            connect_within: Seconds to wait for the first heartbeat.

        Raises:
            InputError: pymavlink isn't installed.
        """
        self._dialect = extra(_DIALECT, "hil", "hardware in the loop")
        self._codec: Any = self._dialect.MAVLink(None, srcSystem=1, srcComponent=200)
        self._codec.robust_parsing = True  # what is no message is skipped
        self.wire = wire
        self.lockstep = lockstep
        self.gps_every = gps_every
        self.patience = patience
        self.answer_within = answer_within
        self.connect_within = connect_within
        self.steps = 0
        """Times that it was told what is sensed."""
        self.missed = 0
        """Those for which none came in time, in lockstep and after the first controls."""
        self.is_armed = False
        """Whether the newest controls said so."""
        self._rotors = np.zeros(4)
        self._controls_time = -1
        self._began = False
        self._heard = self._beaten = -np.inf
        self._next_gps = -np.inf

    def __enter__(self) -> Self:
        """Waits for the autopilot and its first heartbeat.

        Raises:
            LoopError: There was none in time.
        """
        with contextlib.ExitStack() as stack:
            stack.callback(self.wire.close)
            if isinstance(self.wire, TcpWire):
                self.wire.accept(self.connect_within)
            self._wait_for_heartbeat()
            stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Closes the wire."""
        self.wire.close()

    def step(self, senses: Senses, sticks: Sticks | None = None) -> Vector:
        """What the rotors must do, after the autopilot was told what is sensed.

        Args:
            senses: Of the drone now.
            sticks: Ignored: who flies an autopilot does so by a link of its own.

        Returns:
            Front right, rear left, front left, rear right, 0 to 1. Shape: (4,).

        Raises:
            LoopError: The autopilot is gone, or has been silent for too long.
        """
        del sticks
        self._beat()
        self._send("hil_sensor", sensor_fields(senses))
        if senses.time >= self._next_gps:
            self._next_gps = senses.time + self.gps_every
            self._send("hil_gps", gps_fields(senses))
        self.steps += 1
        self._hear(0.0)
        if self.lockstep:
            self._wait_for_controls(round(senses.time * 1e6))
        if time.monotonic() - self._heard > self.patience:
            raise LoopError(f"the autopilot has been silent for {self.patience:g} s")
        return self._rotors

    def _wait_for_controls(self, since: int) -> None:
        """Waits for controls of a time, microseconds, or later ones."""
        end = time.monotonic() + (self.answer_within if self._began else 0.0)
        while self._controls_time < since:
            left = end - time.monotonic()
            if left <= 0.0:
                self.missed += self._began
                return
            self._hear(min(left, 0.05))

    def _wait_for_heartbeat(self) -> None:
        end = time.monotonic() + self.connect_within
        while self._heard < 0.0:
            if time.monotonic() > end:
                raise LoopError(f"no heartbeat of an autopilot in {self.connect_within:g} s")
            self._beat()
            self._hear(0.05)

    def _beat(self) -> None:
        now = time.monotonic()
        if now - self._beaten < HEARTBEAT_EVERY:
            return
        self._beaten = now
        kinds = self._dialect
        self._send(
            "heartbeat",
            {
                "type": kinds.MAV_TYPE_GENERIC,
                "autopilot": kinds.MAV_AUTOPILOT_INVALID,
                "base_mode": 0,
                "custom_mode": 0,
                "system_status": kinds.MAV_STATE_ACTIVE,
            },
        )

    def _send(self, name: str, fields: dict[str, Any]) -> None:
        message = getattr(self._codec, f"{name}_encode")(**fields)
        self.wire.write(message.pack(self._codec))

    def _hear(self, within: float) -> None:
        data = self.wire.read(within)
        for message in (self._codec.parse_buffer(data) or ()) if data else ():
            kind = message.get_type()
            if kind in ("BAD_DATA", "UNKNOWN"):
                continue
            self._heard = time.monotonic()
            if kind == "HIL_ACTUATOR_CONTROLS" and message.time_usec >= self._controls_time:
                self._began = True
                self._controls_time = message.time_usec
                self.is_armed = bool(message.mode & ARMED)
                self._rotors = rotors_of(message.controls, message.mode)
