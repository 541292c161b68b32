"""A firmware's process, and the ends of its wires: see `drone_rl.flight.firmware.keeper`."""

import contextlib
import json
import logging
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from drone_rl.flight.firmware.betaflight import CLI_PORT, RC_PORT, ROTOR_PORT, STATE_PORT
from drone_rl.flight.firmware.errors import LoopError
from drone_rl.utils.errors import InputError

_KEEPER = Path(__file__).with_name("keeper.py")
_log = logging.getLogger(__name__)


class Keeping:
    """Keeps at most one firmware, which ends with this, on whatever way this ends."""

    def __init__(self, *, isolated: bool = True, patience: float = 10.0) -> None:
        """Starts the keeper.

        Args:
            isolated: Whether to give the firmware a network of its own, where the system lets us;
                else it stands on this machine's, and a warning says so.
            patience: Seconds to wait for any of the keeper's answers.

        Raises:
            InputError: On this machine's network, a port that the firmware needs is taken.
        """
        ours, theirs = socket.socketpair()
        self._link = ours
        with theirs:
            number = theirs.fileno()
            command = [sys.executable, "-I", str(_KEEPER), str(number)]
            command.append("own" if isolated else "shared")
            self._process = subprocess.Popen(command, pass_fds=[number])
        try:
            ours.settimeout(patience)
            self.shared = str(self._reply()[0]["shared"])
            """Why the firmware has no network of its own; empty if it has."""
            if self.shared:
                check_ports()
                _log.warning(
                    "the firmware listens on this machine's network (UDP %d and %d, TCP from %d), "
                    "not on one of its own: %s",
                    *(STATE_PORT, RC_PORT, CLI_PORT, self.shared),
                )
        except BaseException:
            self.close()
            raise

    def start(self, program: Sequence[str], folder: Path, log: Path) -> int:
        """Starts the firmware; one that ran before is ended.

        Args:
            program: With its arguments.
            folder: To run in.
            log: File that its words are added to.

        Returns:
            Its process.

        Raises:
            LoopError: It can't be started.
        """
        told = {"program": list(program), "folder": str(folder), "log": str(log)}
        return self._ask("start", **told)[0]["pid"]

    def status(self) -> int | None:
        """The firmware's exit status; None while it runs."""
        return self._ask("poll")[0]["status"]

    def stop(self) -> None:
        """Ends the firmware."""
        self._ask("stop")

    def wire(self, kind: str, port: int) -> socket.socket:
        """A socket in the firmware's network, see `drone_rl.flight.firmware.keeper.make_socket`.

        Raises:
            LoopError: It can't be made.
        """
        _, descriptors = self._ask("socket", kind=kind, port=port)
        sock = socket.socket(fileno=descriptors[0])
        sock.setblocking(True)
        return sock

    def wait_for_wire(self, kind: str, port: int, patience: float) -> socket.socket:
        """The same of a firmware that has only begun.

        Args:
            kind: What kind.
            port: Which port.
            patience: Seconds.

        Raises:
            LoopError: Not in that time, or the firmware has ended.
        """
        end = time.monotonic() + patience
        while True:
            try:
                return self.wire(kind, port)
            except LoopError:
                status = self.status()
                if status is not None:
                    raise LoopError(f"the firmware ended with status {status}") from None
                if time.monotonic() > end:
                    raise
            time.sleep(0.02)

    def close(self) -> None:
        """Ends the firmware and the keeper."""
        self._link.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()  # the firmware is killed with it
            self._process.wait()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """See `close`."""
        self.close()

    def _ask(self, request: str, **values: Any) -> tuple[dict[str, Any], list[int]]:
        text = json.dumps({"request": request, **values}).encode() + b"\n"
        try:
            self._link.sendall(text)
        except OSError as error:
            raise LoopError(f"the firmware's keeper is gone: {error}") from error
        reply, descriptors = self._reply()
        if "error" in reply:
            raise LoopError(f"the firmware's keeper can't {request}: {reply['error']}")
        return reply, descriptors

    def _reply(self) -> tuple[dict[str, Any], list[int]]:
        text, descriptors = b"", []
        while not text.endswith(b"\n"):
            try:
                part, more, _, _ = socket.recv_fds(self._link, 4096, 1)
            except OSError as error:
                raise LoopError(f"the firmware's keeper is silent: {error}") from error
            if not part:
                raise LoopError("the firmware's keeper is gone")
            text, descriptors = text + part, descriptors + more
        return json.loads(text), descriptors


def check_ports() -> None:
    """Makes sure that no other program has the ports that a firmware needs.

    Raises:
        InputError: One has.
    """
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
