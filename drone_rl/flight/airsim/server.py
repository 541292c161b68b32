"""AirSim's RPC server: msgpack-rpc over TCP, by asyncio, around one `Simulation`."""

import asyncio
import contextlib
import logging
import socket
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import msgpack

from drone_rl.flight.airsim import methods
from drone_rl.flight.airsim.calls import Calls, remark
from drone_rl.flight.airsim.lockstep import SLICE, Lockstep
from drone_rl.flight.airsim.methods import UnknownMethodError
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

_log = logging.getLogger(__name__)

REQUEST, RESPONSE, NOTIFICATION = 0, 1, 2
MAX_REQUEST = 2**22
"""Bytes of a request: no method needs more."""
TURN = 0.005
"""Seconds of work for one client before others have their turn."""
MAX_UNSENT = 2**25
"""Bytes of replies that a client may leave unread before its requests wait."""
_MAX_ITEMS = 100_000
_MOST_SHOWN = 200
"""Letters of a method's name in messages."""
_QUICK_ACK: int | None = getattr(socket, "TCP_QUICKACK", None)
"""An option of Linux."""
_POLL = 0.05
"""Longest sleep, seconds."""


class Connection(asyncio.Protocol):
    """One connection."""

    def __init__(self, server: "AirsimServer") -> None:
        """Create a connection of a server."""
        self._server = server
        self._unpacker = _unpacker()
        self._transport: Any = None
        self._name = "client"
        self._calls = Calls()
        self._is_full = False
        """Whether the client leaves too many replies unread."""
        self._is_held = False
        """Whether its requests wait for a call of `release`."""
        self._backlog: deque[Any] = deque()
        self._replies: dict[Callable[[Any], None], int | None] = {}
        """Calls that wait, and the numbers of their requests; None for notifications."""
        self.is_open = False
        self.is_pilot = False
        """Whether one of its calls has ever waited for simulated time."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See `asyncio.Protocol`."""
        self._transport = transport
        peer = transport.get_extra_info("peername")
        self._name = f"{peer[0]}:{peer[1]}" if peer else "client"
        self.is_open = True
        self._server.clients.add(self)
        self._transport.set_write_buffer_limits(high=MAX_UNSENT)
        _log.info("%s connects", self._name)

    def connection_lost(self, exc: Exception | None) -> None:
        """See `asyncio.Protocol`: calls that wait are answered no more."""
        self.is_open = False
        self._backlog.clear()
        for reply in self._replies:
            self._server.simulation.forget(reply)
        self._replies.clear()
        self._server.clients.discard(self)
        _log.info("%s has gone after %s", self._name, self._calls)

    def pause_writing(self) -> None:
        """See `asyncio.Protocol`: the client doesn't read its replies."""
        self._is_full = True
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        """See `asyncio.Protocol`."""
        self._is_full = False
        self._work()

    def data_received(self, data: bytes) -> None:
        """See `asyncio.Protocol`."""
        self._acknowledge()
        try:
            self._unpacker.feed(data)
            self._backlog.extend(self._unpacker)
        except msgpack.BufferFull:
            self._break(f"a request has more than {MAX_REQUEST} bytes")
            return
        except Exception as error:
            self._break(f"its bytes are no msgpack ({type(error).__name__})")
            return
        self._work()

    def _acknowledge(self) -> None:
        """Acknowledge at once what has come.

        After a request that is not answered yet, a client's system sends the next one only then,
        and by default this system would take up to 40 ms.
        """
        if _QUICK_ACK is not None:
            self._transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, _QUICK_ACK, 1)

    def release(self) -> None:
        """Go on with the requests that have come."""
        self._is_held = False
        self._work()

    def _work(self) -> None:
        """Handle the requests that have come, as long as others need not wait for them."""
        end = time.monotonic() + TURN
        while self._backlog and self.is_open and not self._is_full and not self._is_held:
            if self._server.must_wait(self):
                self._is_held = True
            elif time.monotonic() > end:
                self._is_held = True
                asyncio.get_running_loop().call_soon(self.release)
            else:
                self._handle(self._backlog.popleft())
                self._server.note(self)
        if self.is_open and not self._is_full:
            if self._is_held:
                self._transport.pause_reading()
            else:
                self._transport.resume_reading()

    def _break(self, reason: str) -> None:
        _log.warning("%s is disconnected: %s", self._name, reason)
        self._backlog.clear()
        self._transport.abort()

    def _handle(self, message: Any) -> None:
        if not isinstance(message, list | tuple) or not message:
            self._break(f"{shown(message)} is no request")
            return
        if message[0] == NOTIFICATION and len(message) == 3:
            self._call(None, message[1], message[2])
        elif _is_request(message):
            self._call(message[1], message[2], message[3])
        elif message[0] != RESPONSE:
            self._break(f"{shown(message)} is no request")

    def _call(self, number: int | None, name: Any, args: Any) -> None:
        label = name.decode("utf-8", "replace") if isinstance(name, bytes) else name
        if not isinstance(label, str) or not isinstance(args, list | tuple):
            self._break("a request has no name or no list of arguments")
            return
        label = label[:_MOST_SHOWN]  # all names of methods are shorter
        with self._calls.call(self._name, label):
            self._compute(number, label, args)

    def _compute(self, number: int | None, label: str, args: Any) -> None:
        try:
            result = methods.call(self._server.simulation, label, args)
            if isinstance(result, Wait):
                self._wait(number, result)
            else:
                self._answer(number, None, result)
        except UnknownMethodError:
            hint = methods.suggestion(label)
            remark(f"unknown{hint}")
            self._answer(
                number,
                f"rpclib: server could not find function '{label}' with argument count "
                f"{len(args)}.{hint}",
                None,
            )
        except InputError as error:
            remark(str(error))
            self._answer(
                number,
                f"rpclib: function '{label}' (called with {len(args)} arg(s)) threw an exception. "
                f"The exception contained this information: {error}.",
                None,
            )
        except Exception as error:
            _log.exception("%s: %s failed", self._name, label)
            reason = type(error).__name__
            self._answer(number, f"rpclib: function '{label}' failed: {reason}.", None)

    def _wait(self, number: int | None, wait: Wait) -> None:
        def reply(result: Any) -> None:
            del self._replies[reply]
            self._answer(number, None, result)

        self._replies[reply] = number
        self.is_pilot = True
        self._server.simulation.wait_for(wait, reply)

    def _answer(self, number: int | None, error: str | None, result: Any) -> None:
        if number is not None and self.is_open:
            self._transport.write(_packed([RESPONSE, number, error, result]))

    def close(self) -> None:
        """Answer all calls that wait with an error, and close.

        Clients do not notice a closed connection: without an answer they wait for an hour.
        """
        for reply in self._replies:
            self._server.simulation.forget(reply)
        held = [message[1] for message in self._backlog if _is_request(message)]
        for number in [*self._replies.values(), *held]:
            self._answer(number, "the server has stopped; connect again", None)
        self._replies.clear()
        self._backlog.clear()
        self._transport.close()


def _is_request(message: Any) -> bool:
    is_list = isinstance(message, list | tuple) and len(message) == 4
    return is_list and message[0] == REQUEST and isinstance(message[1], int)


def _unpacker() -> Any:
    return msgpack.Unpacker(
        raw=False,
        unicode_errors="replace",
        strict_map_key=False,
        use_list=True,
        max_buffer_size=MAX_REQUEST,
        max_array_len=_MAX_ITEMS,
        max_map_len=_MAX_ITEMS,
        max_ext_len=0,
    )


def _packed(message: list[Any]) -> bytes:
    """Pack a reply: bytes as bin, and the numbers of images as 32 bits."""
    result = message[3]
    first = result[0] if isinstance(result, list) and result else None
    is_image = isinstance(first, dict) and "image_data_float" in first
    packed: Any = msgpack.packb(message, use_bin_type=True, use_single_float=is_image)
    return packed


class AirsimServer:
    """Serves one simulation, and advances its time."""

    def __init__(self, simulation: Simulation, patience: float) -> None:
        """Create a server that does not listen yet; for `patience` see `lockstep`."""
        self.simulation = simulation
        self._lockstep = Lockstep(simulation, patience)
        self.clients: set[Connection] = set()
        self._wake = asyncio.Event()
        self._server: asyncio.Server | None = None

    @property
    def address(self) -> tuple[str, int]:
        """Address and port at which it listens."""
        assert self._server is not None
        host, port = self._server.sockets[0].getsockname()[:2]
        return host, port

    def must_wait(self, client: Connection) -> bool:
        """Return whether requests have to wait; the client is then released when they need not."""
        if self._lockstep.is_running:
            self._lockstep.hold(client.release)
        return self._lockstep.is_running

    def note(self, client: Connection) -> None:
        """Take note of a request that was answered, or that waits."""
        self._wake.set()
        if self.simulation.clock == "lockstep":
            self._lockstep.note(is_pilot=client.is_pilot)

    async def start(self, host: str, port: int) -> None:
        """Listen.

        Raises:
            InputError: The port is in use, or the address is not this machine's.
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(lambda: Connection(self), host, port)
        except OSError as error:
            raise InputError(
                f"port {port} of {host} can't be opened ({error.strerror}); give another port or "
                "address, or stop the server that has it"
            ) from error
        except UnicodeError as error:  # of a host that can't be a name in a network
            raise InputError(f"address={shown(host)} is no address; give 127.0.0.1") from error

    async def serve(self) -> None:
        """Advance simulated time until cancelled."""
        try:
            if self.simulation.clock == "lockstep":
                await self._lockstep.run()
            while True:
                await self._sleep(min(self.simulation.follow(SLICE), _POLL))
        finally:
            self.close()

    async def _sleep(self, seconds: float) -> None:
        """Sleep until a request comes, at most so long."""
        self._wake.clear()
        # not asyncio.wait_for, which can lose a cancellation
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._wake.wait()

    def close(self) -> None:
        """Stop listening and close all connections."""
        if self._server is not None:
            self._server.close()
        for client in [*self.clients]:
            client.close()
