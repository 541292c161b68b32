"""A firmware's process and its sockets; see `drone_rl.flight.betaflight.launcher`."""

import contextlib
import logging
import os
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from drone_rl.flight.betaflight import launcher
from drone_rl.flight.betaflight.launcher import CLI_PORT, RC_PORT, ROTOR_PORT, STATE_PORT
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)


class FirmwareProcess:
    """Runs at most one firmware, which ends with this object or with the thread that started it."""

    rotors: socket.socket
    """Receives the rotor commands of the last firmware."""
    state: socket.socket
    """Sends states to it."""
    sticks: socket.socket
    """Sends RC channels to it."""
    cli: socket.socket
    """For its command line; see `connect`."""

    def __init__(self, *, isolated: bool = True, patience: float = 10.0) -> None:
        """Take whether each firmware has its own network namespace, if the system allows it.

        Else it uses this machine's network, with a warning. A firmware must start within `patience`
        seconds.
        """
        self._network, self._patience = "own" if isolated else "shared", patience
        self._process: subprocess.Popen[bytes] | None = None
        self._sockets = contextlib.ExitStack()
        self.shared = ""
        """Reason why the last firmware has no own network; empty if it has."""

    def start(self, program: Sequence[str], folder: Path, log: Path) -> None:
        """Start the firmware, after stopping the previous one; its output is appended to a log.

        Raises:
            InputError: Without a namespace, a port that the firmware needs is in use.
            FlightControllerError: It can't be started.
        """
        self.close()
        ours, theirs = socket.socketpair()
        with ours, log.open("ab") as file:
            with theirs:
                descriptor = theirs.fileno()
                launch = [sys.executable, "-I", launcher.__file__, str(descriptor), self._network]
                self._process = subprocess.Popen(
                    [*launch, *program],
                    cwd=folder,
                    stdin=subprocess.DEVNULL,
                    stdout=file,
                    stderr=subprocess.STDOUT,
                    pass_fds=[descriptor],
                )
            ours.settimeout(self._patience)
            try:
                self._note(ours.recv(4096).decode())
                ours.sendall(b"\n")
                _, descriptors, _, _ = socket.recv_fds(ours, 1, 4)
                sockets = [socket.socket(fileno=descriptor) for descriptor in descriptors]
            except BaseException:
                self.close()
                raise
            if len(sockets) < 4:
                raise FlightControllerError(f"the firmware can't be started; see its log {log}")
            for sock in sockets:
                self._sockets.enter_context(sock)
            self.rotors, self.state, self.sticks, self.cli = sockets

    def _note(self, reason: str) -> None:
        reason = reason.strip()
        if reason and reason != self.shared:
            check_ports()
            _log.warning(
                "the firmware listens on this machine's network (UDP %d and %d, TCP from %d), "
                "not in a namespace: %s",
                *(STATE_PORT, RC_PORT, CLI_PORT, reason),
            )
        self.shared = reason

    def status(self) -> int | None:
        """Return the firmware's exit status; None while it runs, 0 before the first start."""
        return self._process.poll() if self._process else 0

    def connect(self, patience: float) -> socket.socket:
        """Connect to the command line of a firmware that is starting.

        Raises:
            FlightControllerError: Not in so many seconds, or the firmware has ended.
        """
        end = time.monotonic() + patience
        while error := self.cli.connect_ex(("127.0.0.1", CLI_PORT)):
            status = self.status()
            if status is not None:
                raise FlightControllerError(f"the firmware ended with status {status}")
            if time.monotonic() > end:
                raise FlightControllerError(f"can't connect: {os.strerror(error)}")
            time.sleep(0.02)
        return self.cli

    def close(self) -> None:
        """Stop the firmware."""
        self._sockets.close()
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(1.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """See `close`."""
        self.close()


def check_ports() -> None:
    """Raise an `InputError` if a port that the firmware needs is in use."""
    wanted = [(socket.SOCK_DGRAM, port) for port in (ROTOR_PORT, STATE_PORT, RC_PORT)]
    for kind, port in [*wanted, (socket.SOCK_STREAM, CLI_PORT)]:
        with contextlib.closing(socket.socket(type=kind)) as sock:
            if kind == socket.SOCK_STREAM:
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                sock.bind(("0.0.0.0", port))
            except OSError as error:
                raise InputError(
                    f"port {port} is taken by another program and Betaflight's can't be changed; "
                    f"end that program, or run where network namespaces are allowed ({error})"
                ) from error
