"""Software in the loop: Betaflight's own firmware, a step at a time.

The firmware is a process in a folder and, where the system allows it, a network of its own; it
ends with the `Betaflight` that started it, however that ends.

The firmware does one step of its controllers for each state that it is told, and takes it that
1 ms has gone by since the last. Its clock, by which it measures everything else, such as how often
sticks move, is that on the wall: were it made to follow simulated time, then each of the two would
wait for the other, slower and slower.
"""

import contextlib
import socket
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from drone_rl.config.dynamics import GRAVITY
from drone_rl.flight.firmware.betaflight import (
    CLI_PORT,
    RC_PORT,
    ROTOR_PORT,
    STATE_PORT,
    pack_state,
    pack_sticks,
    setup_lines,
    unpack_rotors,
)
from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.keeping import Keeping
from drone_rl.flight.firmware.senses import Senses, Vector
from drone_rl.flight.firmware.sticks import FULL_ANGLE, FULL_YAW_RATE, Sticks
from drone_rl.sim.dynamics.state import LEVEL

MEMORY = "eeprom.bin"
"""The file in its folder in which the firmware keeps how it was set up."""
STICKS_EVERY = 0.01
"""Seconds of simulated time from one packet of sticks to the next."""
STARTS = 3
"""How often it is started at most, until it steps."""
_AWAKE = 10
_WAKES_WITHIN = 0.05
_STANDING = Senses(
    time=0.0,
    position=np.zeros(3),
    velocity=np.zeros(3),
    attitude=np.array(LEVEL),
    rates=np.zeros(3),
    force=np.array([0.0, 0.0, GRAVITY]),
)
_PROMPT = b"\n# "


class Betaflight:
    """One firmware in flight. A context manager: the firmware starts with it and ends with it."""

    def __init__(
        self,
        program: Sequence[str],
        folder: Path,
        *,
        isolated: bool = True,
        patience: float = 10.0,
        answer_within: float = 0.02,
    ) -> None:
        """Says what will be started; nothing is, yet.

        Args:
            program: The firmware, with its arguments.
            folder: For its memory and its words; made if it isn't there. A memory that is there is
                used, else the firmware is set up anew.
            isolated: See `Keeping`.
            patience: Seconds of silence after which the firmware counts as gone; half of them
                while it starts.
            answer_within: Seconds to wait for its answer to one state; then the rotors go on as
                they did.
        """
        self.program = list(program)
        self.folder = folder
        self.isolated = isolated
        self.patience = patience
        self.answer_within = answer_within
        self.steps = 0
        """States that it was told."""
        self.missed = 0
        """Those that it did not answer in time."""
        self._rotors = np.zeros(4)
        self._next_sticks = -np.inf
        self._heard = 0.0
        self._open = contextlib.ExitStack()

    @property
    def log(self) -> Path:
        """What the firmware says."""
        return self.folder / "firmware.log"

    def __enter__(self) -> Self:
        """Starts the firmware, and sets it up first if it never was.

        Raises:
            InputError: See `Keeping`.
            LoopError: It can't be started, or not be set up.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with contextlib.ExitStack() as stack:
            self._keeping = stack.enter_context(Keeping(isolated=self.isolated))
            if not (self.folder / MEMORY).exists():
                self._set_up()
            self._hear = stack.enter_context(self._keeping.wire("bound", ROTOR_PORT))
            self._state = stack.enter_context(self._keeping.wire("udp", STATE_PORT))
            self._sticks = stack.enter_context(self._keeping.wire("udp", RC_PORT))
            self._start()
            self._open = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Ends the firmware."""
        self._open.close()

    def step(self, senses: Senses, sticks: Sticks) -> Vector:
        """What the rotors must do, after the firmware has seen a state.

        Args:
            senses: Of the drone now.
            sticks: Of the pilot.

        Returns:
            Front right, rear left, front left, rear right, 0 to 1. Shape: (4,).

        Raises:
            LoopError: The firmware has ended, or has been silent for too long.
        """
        if senses.time >= self._next_sticks:
            self._next_sticks = senses.time + STICKS_EVERY
            self._send(self._sticks, pack_sticks(senses.time, sticks.channels))
        self._drop_late_answers()
        self._send(self._state, pack_state(senses, 0.0))
        self.steps += 1
        try:
            self._rotors = unpack_rotors(self._hear.recv(64))
            self._heard = time.monotonic()
        except TimeoutError:
            self.missed += 1
            if time.monotonic() - self._heard > self.patience:
                raise LoopError(f"{self._silence()}; its words are in {self.log}") from None
        return self._rotors

    def _silence(self) -> str:
        status = self._keeping.status()
        if status is not None:
            return f"the firmware ended with status {status}"
        return f"the firmware has been silent for {self.patience:g} s"

    def _send(self, sock: socket.socket, packet: bytes) -> None:
        with contextlib.suppress(ConnectionRefusedError):  # not there yet, or no longer: see step
            sock.send(packet)

    def _drop_late_answers(self) -> None:
        self._hear.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self._hear.recv(64)
        self._hear.settimeout(self.answer_within)

    def _start(self) -> None:
        """Starts the firmware, and goes on when it steps.

        Its threads share a clock without a lock, so that now and then it stops for ever while it
        starts; then it is started again.
        """
        for _ in range(STARTS):
            self._keeping.start(self.program, self.folder, self.log)
            end = time.monotonic() + self.patience / 2
            while time.monotonic() < end:
                if self._answers(_STANDING):
                    self._heard = time.monotonic()
                    return
        raise LoopError(f"{self._silence()}; its words are in {self.log}")

    def _answers(self, senses: Senses) -> bool:
        """Whether it answers several states, one after the other."""
        for _ in range(_AWAKE):
            self._drop_late_answers()
            self._send(self._state, pack_state(senses, 0.0))
            self._hear.settimeout(_WAKES_WITHIN)  # before it listens, what is sent is lost
            try:
                self._hear.recv(64)
            except TimeoutError:
                return False
        return True

    def _set_up(self) -> None:
        """Tells a new firmware by its command line what the switches and sticks mean."""
        self._keeping.start(self.program, self.folder, self.log)
        angle = round(float(np.degrees(FULL_ANGLE)))
        yaw = round(float(np.degrees(FULL_YAW_RATE)) / 10.0)
        try:
            with self._keeping.wait_for_wire("tcp", CLI_PORT, self.patience) as cli:
                cli.settimeout(self.patience)
                _converse(cli, b"#")
                for line in setup_lines(angle, yaw):
                    _converse(cli, line.encode() + b"\n")
                cli.sendall(b"save\n")
                self._wait_for_end()
        except (OSError, LoopError) as error:
            (self.folder / MEMORY).unlink(missing_ok=True)  # half of it would be taken for all
            raise LoopError(f"the firmware can't be set up: {error}") from error

    def _wait_for_end(self) -> None:
        """It ends by itself when it has saved."""
        end = time.monotonic() + self.patience
        while self._keeping.status() is None:
            if time.monotonic() > end:
                raise LoopError("it doesn't end after it was told to save")
            time.sleep(0.02)


def _converse(cli: socket.socket, line: bytes) -> bytes:
    """Says a line to a command line and hears its answer, to the next prompt.

    Raises:
        LoopError: It doesn't understand.
    """
    cli.sendall(line)
    answer = b""
    while not answer.endswith(_PROMPT):
        part = cli.recv(4096)
        if not part:
            raise LoopError(f"its command line closed after {line.decode().strip()!r}")
        answer += part
    if b"ERROR" in answer or b"INVALID" in answer.upper():
        words = answer.decode(errors="replace").strip("# \r\n").replace("\r\n", " ")
        raise LoopError(f"its command line refuses {line.decode().strip()!r}: {words}")
    return answer
