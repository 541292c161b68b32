"""One connection of a client: msgpack-rpc in both directions."""

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any, Protocol

import msgpack

from drone_rl.flight.airsim import methods
from drone_rl.flight.airsim.methods import UnknownMethodError
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

_log = logging.getLogger(__name__)

REQUEST, RESPONSE, NOTIFICATION = 0, 1, 2
MAX_MESSAGE = 2**22
"""Bytes of a request: no method needs more."""
MAX_PENDING = 1000
"""Calls of one client that wait at a time."""
MAX_CLIENTS = 1000
MAX_UNSENT = 2**25
"""Bytes of replies that a client may leave unread before its requests wait."""
_MAX_ITEMS = 100_000


class Host(Protocol):
    """What a connection needs of its server."""

    simulation: Simulation
    last_request: float

    def admit(self, client: "Connection") -> bool:
        """Take note of a client; return whether there is room for it."""
        ...

    def dismiss(self, client: "Connection") -> None:
        """Forget a client."""
        ...

    def wait_for(self, wait: Wait, reply: Callable[[Any], None]) -> None:
        """Answer a call when simulated time has come."""
        ...


class Connection(asyncio.Protocol):
    """One connection."""

    def __init__(self, server: Host) -> None:
        self._server = server
        self._unpacker = _unpacker()
        self._transport: Any = None
        self._name = "client"
        self._pending = 0
        self._is_full = False
        self._backlog: list[Any] = []
        self._replies: set[Callable[[Any], None]] = set()
        self.is_open = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See `asyncio.Protocol`."""
        self._transport = transport
        peer = transport.get_extra_info("peername")
        self._name = f"{peer[0]}:{peer[1]}" if peer else "client"
        self.is_open = True
        if not self._server.admit(self):
            _log.warning("%s is refused: there are %d clients", self._name, MAX_CLIENTS)
            self._transport.abort()
            return
        self._transport.set_write_buffer_limits(high=MAX_UNSENT)
        _log.info("%s connects", self._name)

    def connection_lost(self, exc: Exception | None) -> None:
        """See `asyncio.Protocol`: calls that wait are answered no more."""
        self.is_open = False
        for reply in self._replies:
            self._server.simulation.forget(reply)
        self._replies.clear()
        self._server.dismiss(self)
        _log.info("%s has gone", self._name)

    def pause_writing(self) -> None:
        """See `asyncio.Protocol`: the client doesn't read its replies."""
        self._is_full = True
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        """See `asyncio.Protocol`."""
        self._is_full = False
        self._transport.resume_reading()
        self._work()

    def data_received(self, data: bytes) -> None:
        """See `asyncio.Protocol`."""
        self._server.last_request = time.monotonic()
        try:
            self._unpacker.feed(data)
            self._backlog.extend(self._unpacker)
        except Exception as error:
            self._break(f"its bytes are no msgpack ({type(error).__name__})")
            return
        self._work()

    def _work(self) -> None:
        while self._backlog and not self._is_full and self.is_open:
            self._handle(self._backlog.pop(0))

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
        elif message[0] == REQUEST and len(message) == 4 and isinstance(message[1], int):
            self._call(message[1], message[2], message[3])
        elif message[0] != RESPONSE:
            self._break(f"{shown(message)} is no request")

    def _call(self, number: int | None, name: Any, args: Any) -> None:
        label = name.decode("utf-8", "replace") if isinstance(name, bytes) else name
        if not isinstance(label, str) or not isinstance(args, list | tuple):
            self._break("a request has no name or no list of arguments")
            return
        try:
            if self._pending >= MAX_PENDING:
                raise InputError(f"{MAX_PENDING} calls of this client wait; join some first")
            result = methods.call(self._server.simulation, label, args)
        except UnknownMethodError:
            hint = methods.suggestion(label)
            self._fail(
                number,
                f"rpclib: server could not find function '{label[:200]}' with argument count "
                f"{len(args)}.{hint}",
            )
            return
        except InputError as error:
            self._fail(
                number,
                f"rpclib: function '{label}' (called with {len(args)} arg(s)) threw an exception. "
                f"The exception contained this information: {error}.",
            )
            return
        except Exception as error:
            _log.exception("%s: %s failed", self._name, label[:200])
            self._fail(number, f"rpclib: function '{label}' failed: {type(error).__name__}.")
            return
        if isinstance(result, Wait):
            self._wait(number, result)
        else:
            self._answer(number, None, result)

    def _wait(self, number: int | None, wait: Wait) -> None:
        self._pending += 1

        def reply(result: Any) -> None:
            self._pending -= 1
            self._replies.discard(reply)
            self._answer(number, None, result)

        self._replies.add(reply)
        self._server.wait_for(wait, reply)

    def _fail(self, number: int | None, message: str) -> None:
        _log.warning("%s: %s", self._name, message)
        self._answer(number, message, None)

    def _answer(self, number: int | None, error: str | None, result: Any) -> None:
        if number is not None and self.is_open:
            self._transport.write(_packed([RESPONSE, number, error, result]))

    def close(self) -> None:
        """Answer the calls that wait by an error, and close."""
        for reply in [*self._replies]:
            self._server.simulation.forget(reply)
        self._transport.close()


def _unpacker() -> Any:
    return msgpack.Unpacker(
        raw=False,
        unicode_errors="surrogateescape",
        strict_map_key=False,
        use_list=True,
        max_buffer_size=MAX_MESSAGE,
        max_array_len=_MAX_ITEMS,
        max_map_len=_MAX_ITEMS,
        max_ext_len=0,
    )


def _packed(message: list[Any]) -> bytes:
    """Pack a reply: bytes as bin, and the numbers of images as 32 bits."""
    result = message[3]
    is_image = isinstance(result, list) and bool(result) and isinstance(result[0], dict)
    packed: Any = msgpack.packb(message, use_bin_type=True, use_single_float=is_image)
    return packed
