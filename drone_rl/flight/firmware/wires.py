"""Wires to an autopilot: a serial port, or one that connects to us by TCP."""

import contextlib
import os
import select
import socket
import termios
import time
import tty
from pathlib import Path
from typing import Protocol

from drone_rl.flight.firmware.errors import LoopError
from drone_rl.utils.errors import InputError

TCP_PORT = 4560
"""Where a simulator listens for PX4."""
MOST = 65536
"""Bytes taken at once."""


class Wire(Protocol):
    """Carries bytes both ways."""

    def read(self, within: float) -> bytes:
        """What has come; empty if nothing came in so many seconds.

        Raises:
            LoopError: The other end is gone.
        """
        ...

    def write(self, data: bytes) -> None:
        """Sends all of it.

        Raises:
            LoopError: The other end is gone.
        """
        ...

    def close(self) -> None:
        """Ends it."""
        ...


class SerialWire:
    """A serial port, such as that of a flight controller, or a pseudo-terminal."""

    def __init__(self, device: str, baud: int = 921_600, patience: float = 1.0) -> None:
        """Opens it, raw.

        Args:
            device: Such as /dev/ttyACM0.
            baud: Bits a second.
            patience: Seconds after which a port that takes no more bytes counts as gone.

        Raises:
            InputError: It can't be opened, is no serial port, or knows no such speed.
        """
        speed = getattr(termios, f"B{baud}", None)
        if speed is None:
            raise InputError(f"baud={baud} is no speed of serial ports; give one such as 921600")
        if not Path(device).exists():
            raise InputError(f"device={device} isn't there; is the controller plugged in?")
        try:
            self._file = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise InputError(f"device={device} can't be opened: {error.strerror}") from error
        try:
            tty.setraw(self._file)
            settings = termios.tcgetattr(self._file)
            settings[4:6] = [speed, speed]
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
        except termios.error as error:
            os.close(self._file)
            raise InputError(f"device={device} is no serial port; give one") from error
        self.device = device
        self.patience = patience

    def read(self, within: float) -> bytes:
        """See `Wire`."""
        if not select.select([self._file], [], [], within)[0]:
            return b""
        try:
            data = os.read(self._file, MOST)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise LoopError(f"{self.device} is gone: {error.strerror}") from error
        if not data:
            raise LoopError(f"{self.device} is gone")
        return data

    def write(self, data: bytes) -> None:
        """See `Wire`."""
        end = time.monotonic() + self.patience
        while data:
            try:
                data = data[os.write(self._file, data) :]
            except BlockingIOError:
                select.select([], [self._file], [], 0.05)
                if time.monotonic() > end:
                    raise LoopError(f"{self.device} takes no more bytes") from None
            except OSError as error:
                raise LoopError(f"{self.device} is gone: {error.strerror}") from error

    def close(self) -> None:
        """See `Wire`."""
        os.close(self._file)


class TcpWire:
    """A port of ours to which one autopilot connects, as PX4's simulation does."""

    def __init__(self, port: int = TCP_PORT, host: str = "127.0.0.1") -> None:
        """Listens.

        Args:
            port: 0 for any that is free.
            host: On which address; by default this machine alone can connect.

        Raises:
            InputError: The port is taken.
        """
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind((host, port))
        except (OSError, OverflowError) as error:
            self._listener.close()
            raise InputError(f"port={port} can't be listened at: {error}; give another") from error
        self._listener.listen(1)
        self._link: socket.socket | None = None
        self.port: int = self._listener.getsockname()[1]
        """Where it listens."""

    def accept(self, within: float) -> None:
        """Waits for the autopilot.

        Raises:
            LoopError: None came in so many seconds.
        """
        self._listener.settimeout(within)
        try:
            self._link, _ = self._listener.accept()
        except TimeoutError:
            raise LoopError(f"no autopilot connected to port {self.port} in {within:g} s") from None
        self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, within: float) -> bytes:
        """See `Wire`."""
        link = self._connected
        if not select.select([link], [], [], within)[0]:
            return b""
        try:
            data = link.recv(MOST)
        except OSError as error:
            raise LoopError(f"the autopilot is gone: {error}") from error
        if not data:
            raise LoopError("the autopilot has closed its connection")
        return data

    def write(self, data: bytes) -> None:
        """See `Wire`."""
        try:
            self._connected.settimeout(1.0)
            self._connected.sendall(data)
        except OSError as error:
            raise LoopError(f"the autopilot is gone: {error}") from error

    def close(self) -> None:
        """See `Wire`."""
        with contextlib.ExitStack() as stack:
            stack.callback(self._listener.close)
            if self._link is not None:
                stack.callback(self._link.close)

    @property
    def _connected(self) -> socket.socket:
        if self._link is None:
            raise LoopError("no autopilot has connected yet; call accept first")
        return self._link
