"""AirSim's RPC server: msgpack-rpc over TCP, by asyncio, around one `Simulation`."""

import asyncio
import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import msgpack

from drone_rl.flight.airsim import methods
from drone_rl.flight.airsim.methods import UnknownMethodError
from drone_rl.flight.airsim.settings_file import AirsimSettings, parse_settings, read_settings
from drone_rl.flight.airsim.simulation import CLOCKS, Simulation, Wait
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import OneOf, Whole, shown

_log = logging.getLogger(__name__)

REQUEST, RESPONSE, NOTIFICATION = 0, 1, 2
MAX_MESSAGE = 2**22
"""Bytes of a request: no method needs more."""
MAX_PENDING = 1000
"""Calls of one client that wait at a time."""
MAX_CLIENTS = 1000
MAX_UNSENT = 2**25
"""Bytes of replies that a client may leave unread before its requests wait."""
SLICE = 0.005
"""Seconds of simulation between two looks at the sockets."""
PATIENCE = 0.005
"""Seconds without a request after which lockstep time goes on: what a client asks right after it
starts a movement is answered at the same simulated time every run."""
MOST_PATIENCE = 0.02
_POLL = 0.05
_MAX_ITEMS = 100_000


class _Client(asyncio.Protocol):
    """One connection."""

    def __init__(self, server: "AirsimServer") -> None:
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


class AirsimServer:
    """Serves one simulation to any number of clients, and advances its time."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.last_request = -math.inf
        """Time of day of the last request."""
        self._asked = -math.inf
        self._clients: set[_Client] = set()
        self._wake = asyncio.Event()
        self._server: asyncio.Server | None = None

    @property
    def address(self) -> tuple[str, int]:
        """Address and port at which it listens."""
        assert self._server is not None
        host, port = self._server.sockets[0].getsockname()[:2]
        return host, port

    def admit(self, client: _Client) -> bool:
        """Take note of a client; return whether there is room for it."""
        if len(self._clients) >= MAX_CLIENTS:
            return False
        self._clients.add(client)
        return True

    def dismiss(self, client: _Client) -> None:
        """Forget a client."""
        self._clients.discard(client)

    def wait_for(self, wait: Wait, reply: Callable[[Any], None]) -> None:
        """Answer a call when simulated time has come."""
        self._asked = time.monotonic()
        self.simulation.wait_for(wait, reply)
        self._wake.set()

    async def start(self, host: str, port: int) -> None:
        """Listen.

        Raises:
            InputError: The port is in use, or the address is not this machine's.
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(lambda: _Client(self), host, port)
        except OSError as error:
            raise InputError(
                f"port {port} of {host} can't be opened ({error.strerror}); stop the other server, "
                "or give another port"
            ) from error

    async def serve(self) -> None:
        """Advance simulated time until cancelled."""
        simulation = self.simulation
        try:
            while True:
                if simulation.clock == "lockstep":
                    await self._wait_until_asked()
                left = simulation.run(SLICE)
                if left <= 0.0 or simulation.clock == "lockstep":
                    await asyncio.sleep(0)
                    continue
                await self._sleep(min(left, _POLL))
        finally:
            self.close()

    async def _wait_until_asked(self) -> None:
        """Wait for a call that needs time, and until its client asks nothing more.

        Another client that asks without pause delays a call by `MOST_PATIENCE` only.
        """
        while not self.simulation.is_waited_for or self.simulation.is_paused:
            await self._sleep(_POLL)
        while True:
            quiet = min(self.last_request + PATIENCE, self._asked + MOST_PATIENCE)
            if (left := quiet - time.monotonic()) <= 0.0:
                return
            await asyncio.sleep(left)

    async def _sleep(self, seconds: float) -> None:
        """Sleep until a call waits, at most so long."""
        self._wake.clear()
        # not asyncio.wait_for, which can lose a cancellation
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._wake.wait()

    def close(self) -> None:
        """Stop listening and close all connections."""
        if self._server is not None:
            self._server.close()
        for client in [*self._clients]:
            client.close()


async def run(simulation: Simulation, host: str, port: int, ready: Callable[[str], None]) -> None:
    """Serve a simulation until cancelled; `ready` is called with the address once it listens.

    Raises:
        InputError: The port is in use.
    """
    server = AirsimServer(simulation)
    await server.start(host, port)
    address, number = server.address
    ready(f"{address}:{number}")
    await server.serve()


class RunningServer:
    """A server in a thread of this process; a context manager that stops it."""

    def __init__(self, simulation: Simulation, host: str, port: int) -> None:
        """Start it; see `AirsimServer.start` for errors."""
        self.simulation = simulation
        """The simulation, which only the server's thread may touch while it runs."""
        self.address = ("", 0)
        """Address and port at which it listens."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None
        self._error: Exception | None = None
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._main, args=(host, port), daemon=True)
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            raise self._error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop it: calls that wait are not answered."""
        loop, task = self._loop, self._task
        if loop is not None and task is not None and self._thread.is_alive():
            loop.call_soon_threadsafe(task.cancel)
            self._thread.join()
            self.simulation.close()

    def _main(self, host: str, port: int) -> None:
        with contextlib.suppress(asyncio.CancelledError):
            asyncio.run(self._serve(host, port))

    async def _serve(self, host: str, port: int) -> None:
        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        server = AirsimServer(self.simulation)
        try:
            await server.start(host, port)
            self.address = server.address
        except InputError as error:
            self._error = error
            return
        finally:
            self._ready.set()
        await server.serve()


def serve(
    settings: str | Path | AirsimSettings | None = None,
    *,
    scene: str = "cubes",
    clock: str = "wall",
    address: str | None = None,
    port: int | None = None,
    seed: int = 0,
    renderer: str | None = None,
    recordings: str | Path | None = None,
) -> RunningServer:
    """Start a server for AirSim's clients in a thread of this process.

    >>> with drone_rl.serve(scene="blocks", clock="lockstep") as server:
    ...     client = airsim.MultirotorClient(port=server.address[1])

    Args:
        settings: Path of a settings.json, or its content; by default one multirotor.
        scene: cubes, blocks, pillars, empty, or the path of an MJCF file.
        clock: "wall", or "lockstep", in which time passes only while a call waits for it.
        address: Address to listen at; that of the settings by default.
        port: Port; that of the settings by default, and 0 for a free one.
        seed: Of placements, gusts and sensor noise.
        renderer: raytrace or mujoco_warp; by default the one that fits the scene.
        recordings: Folder for recordings; None refuses `startRecording`.

    Raises:
        InputError: A setting is wrong, or the port is in use.
    """
    simulation, host, number = make_simulation(
        settings,
        scene=scene,
        clock=clock,
        address=address,
        port=port,
        seed=seed,
        renderer=renderer,
        recordings=recordings,
    )
    return RunningServer(simulation, host, number)


def make_simulation(
    settings: str | Path | AirsimSettings | None,
    *,
    scene: str,
    clock: str,
    address: str | None,
    port: int | None,
    seed: int,
    renderer: str | None,
    recordings: str | Path | None,
) -> tuple[Simulation, str, int]:
    """Return a simulation, and the address and port to serve it at; see `serve`."""
    if settings is None:
        settings = parse_settings("{}")
    elif not isinstance(settings, AirsimSettings):
        settings = read_settings(Path(settings))
    clock = OneOf(CLOCKS).read(clock, "clock")
    seed = Whole(0, 2**31 - 1).read(seed, "seed")
    host = settings.address if address is None else address
    number = settings.port if port is None else Whole(0, 65535).read(port, "port")
    if host not in ("127.0.0.1", "localhost", "::1"):
        _log.warning(
            "the server listens at %s: everybody in that network can control the vehicles", host
        )
    folder = None if recordings is None else Path(recordings)
    simulation = Simulation(
        settings, scene, clock=clock, seed=seed, renderer=renderer, recordings=folder
    )
    return simulation, host, number
