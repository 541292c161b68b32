"""A firmware's process and its sockets, through `drone_rl.flight.betaflight.supervisor`."""

import contextlib
import json
import logging
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.utils.errors import InputError

STATE_PORT, RC_PORT, ROTOR_PORT, CLI_PORT = 9003, 9004, 9002, 5761
"""UDP into the firmware: state, RC channels; UDP out of it: rotors; TCP: its command line."""
_SUPERVISOR = Path(__file__).with_name("supervisor.py")
_log = logging.getLogger(__name__)


class FirmwareProcess:
    """Runs at most one firmware, which ends with this object however this ends."""

    def __init__(self, *, isolated: bool = True, patience: float = 10.0) -> None:
        """Start the supervisor, each of whose answers must come within `patience` seconds.

        With `isolated` the firmware has its own network namespace if the system allows it; else it
        uses this machine's network, with a warning.

        Raises:
            InputError: Without a namespace, a port that the firmware needs is in use.
            FlightControllerError: The supervisor doesn't answer.
        """
        ours, theirs = socket.socketpair()
        self._link = ours
        with theirs:
            number = theirs.fileno()
            command = [sys.executable, "-I", str(_SUPERVISOR), str(number)]
            command.append("own" if isolated else "shared")
            self._process = subprocess.Popen(command, pass_fds=[number])
        try:
            ours.settimeout(patience)
            self.shared = str(self._reply()[0]["shared"])
            """Reason why the firmware has no own network; empty if it has."""
            if self.shared:
                check_ports()
                _log.warning(
                    "the firmware listens on this machine's network (UDP %d and %d, TCP from %d), "
                    "not in a namespace: %s",
                    *(STATE_PORT, RC_PORT, CLI_PORT, self.shared),
                )
        except BaseException:
            self.close()
            raise

    def start(self, program: Sequence[str], folder: Path, log: Path) -> int:
        """Start the firmware, after stopping the previous one, and return its process id.

        Its output is appended to a log.

        Raises:
            FlightControllerError: It can't be started.
        """
        values = {"program": list(program), "folder": str(folder), "log": str(log)}
        return self._ask("start", **values)[0]["pid"]

    def status(self) -> int | None:
        """Return the firmware's exit status; None while it runs."""
        return self._ask("poll")[0]["status"]

    def connect(self, kind: str, port: int) -> socket.socket:
        """Open a socket in the firmware's network; see `supervisor.make_socket`."""
        _, descriptors = self._ask("connect", kind=kind, port=port)
        sock = socket.socket(fileno=descriptors[0])
        sock.setblocking(True)
        return sock

    def connect_within(self, kind: str, port: int, patience: float) -> socket.socket:
        """Open a socket, as `connect` does, to a firmware that is starting.

        Raises:
            FlightControllerError: Not in so many seconds, or the firmware has ended.
        """
        end = time.monotonic() + patience
        while True:
            try:
                return self.connect(kind, port)
            except FlightControllerError:
                status = self.status()
                if status is not None:
                    raise FlightControllerError(
                        f"the firmware ended with status {status}"
                    ) from None
                if time.monotonic() > end:
                    raise
            time.sleep(0.02)

    def close(self) -> None:
        """Stop the firmware and the supervisor."""
        self._link.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()  # the firmware is killed with it
            self._process.wait()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """See `close`."""
        self.close()

    def _ask(self, request: str, **values: Any) -> tuple[dict[str, Any], list[int]]:
        text = json.dumps({"request": request, **values}).encode() + b"\n"
        try:
            self._link.sendall(text)
        except OSError as error:
            raise FlightControllerError(f"the firmware's supervisor is gone: {error}") from error
        reply, descriptors = self._reply()
        if "error" in reply:
            raise FlightControllerError(
                f"the firmware's supervisor can't {request}: {reply['error']}"
            )
        return reply, descriptors

    def _reply(self) -> tuple[dict[str, Any], list[int]]:
        text, descriptors = b"", []
        while not text.endswith(b"\n"):
            try:
                part, more, _, _ = socket.recv_fds(self._link, 4096, 1)
            except OSError as error:
                self._link.close()  # a late answer must not be taken for that of another request
                raise FlightControllerError(
                    f"the firmware's supervisor doesn't answer: {error}"
                ) from error
            if not part:
                raise FlightControllerError("the firmware's supervisor is gone")
            text, descriptors = text + part, descriptors + more
        return json.loads(text), descriptors


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
