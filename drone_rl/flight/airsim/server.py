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
from drone_rl.flight.server_thread import listening
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

_log = logging.getLogger(__name__)

RESPONSE = 1
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


class _ProtocolError(Exception):
    """What a client has sent is no msgpack-rpc."""


class Connection:
    """One connection."""

    def __init__(
        self, server: "AirsimServer", reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        """Take the server and the streams."""
        self._server, self._reader, self._writer = server, reader, writer
        self._writer.transport.set_write_buffer_limits(high=MAX_UNSENT)
        peer = writer.get_extra_info("peername")
        self._name = f"{peer[0]}:{peer[1]}" if peer else "client"
        self._calls = Calls()
        self._unpacker = _unpacker()
        self._backlog: deque[Any] = deque()
        self._replies: dict[Callable[[Any], None], int | None] = {}
        """Calls that wait, and the numbers of their requests; None for notifications."""
        self.is_pilot = False
        """Whether one of its calls has ever waited for simulated time."""

    async def serve(self) -> None:
        """Answer requests until the client goes."""
        _log.info("%s connects", self._name)
        try:
            while data := await self._reader.read(MAX_REQUEST):
                self._acknowledge()
                self._unpack(data)
                await self._work()
        except _ProtocolError as error:
            _log.warning("%s is disconnected: %s", self._name, error)
            self._writer.transport.abort()
        except (ConnectionError, asyncio.CancelledError):  # the client or the server ends
            pass
        finally:
            for reply in self._replies:
                self._server.simulation.forget(reply)
            self._writer.close()
            _log.info("%s has gone after %s", self._name, self._calls)

    def _acknowledge(self) -> None:
        """Acknowledge at once what has come.

        After a request that is not answered yet, a client's system sends the next one only then,
        and by default this system would take up to 40 ms.
        """
        if _QUICK_ACK is not None:
            self._writer.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, _QUICK_ACK, 1)

    def _unpack(self, data: bytes) -> None:
        try:
            self._unpacker.feed(data)
            self._backlog.extend(self._unpacker)
        except Exception as error:  # of many kinds
            name = type(error).__name__
            raise _ProtocolError(f"no msgpack of up to {MAX_REQUEST} bytes ({name})") from error

    async def _work(self) -> None:
        """Handle the requests that have come; others have their turn after `TURN` seconds."""
        end = time.monotonic() + TURN
        while self._backlog:
            await self._server.may_ask()
            self._handle(self._backlog.popleft())
            self._server.note(self)
            await self._writer.drain()  # until the client has read enough of its replies
            if time.monotonic() > end:
                await asyncio.sleep(0)
                end = time.monotonic() + TURN

    def _handle(self, message: Any) -> None:
        match message:
            case [0, int(number), name, args]:
                self._call(number, name, args)
            case [2, name, args]:  # a notification
                self._call(None, name, args)
            case [1, *_]:  # a response
                pass
            case _:
                raise _ProtocolError(f"{shown(message)} is no request")

    def _call(self, number: int | None, name: Any, args: Any) -> None:
        label = name.decode("utf-8", "replace") if isinstance(name, bytes) else name
        if not isinstance(label, str) or not isinstance(args, list | tuple):
            raise _ProtocolError("a request has no name or no list of arguments")
        label = label[:_MOST_SHOWN]  # all names of methods are shorter
        with self._calls.call(self._name, label):
            try:
                result = methods.call(self._server.simulation, label, args)
                if isinstance(result, Wait):
                    self._wait(number, result)
                else:
                    self._answer(number, None, result)
            except Exception as error:
                self._answer(number, self._explain(error, label, len(args)), None)

    def _explain(self, error: Exception, label: str, count: int) -> str:
        """Return AirSim's words for an error of a call, and note it."""
        if isinstance(error, UnknownMethodError):
            hint = methods.suggestion(label)
            remark(f"unknown{hint}")
            return (
                f"rpclib: server could not find function '{label}' with argument count {count}."
                f"{hint}"
            )
        if isinstance(error, InputError):
            remark(str(error))
            return (
                f"rpclib: function '{label}' (called with {count} arg(s)) threw an exception. The "
                f"exception contained this information: {error}."
            )
        _log.error("%s: %s failed", self._name, label, exc_info=error)
        return f"rpclib: function '{label}' failed: {type(error).__name__}."

    def _wait(self, number: int | None, wait: Wait) -> None:
        def reply(result: Any) -> None:
            del self._replies[reply]
            self._answer(number, None, result)

        self._replies[reply] = number
        self.is_pilot = True
        self._server.simulation.wait_for(wait, reply)

    def _answer(self, number: int | None, error: str | None, result: Any) -> None:
        if number is not None and not self._writer.is_closing():
            self._writer.write(_packed([RESPONSE, number, error, result]))

    def close(self) -> None:
        """Answer all calls that wait with an error, and close.

        Clients do not notice a closed connection: without an answer they wait for an hour.
        """
        held = [message[1] for message in self._backlog if len(message) == 4]
        for number in [*self._replies.values(), *held]:
            self._answer(number, "the server has stopped; connect again", None)
        self._backlog.clear()
        self._writer.close()


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

    async def may_ask(self) -> None:
        """Wait until requests are answered."""
        await self._lockstep.stands()

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        client = Connection(self, reader, writer)
        self.clients.add(client)
        await client.serve()
        self.clients.discard(client)

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
        with listening(host, port):
            self._server = await asyncio.start_server(self._connect, host, port)

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
