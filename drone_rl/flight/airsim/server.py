"""AirSim's RPC server: msgpack-rpc over TCP, by asyncio, around one `Simulation`."""

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any

from drone_rl.flight.airsim.connection import MAX_CLIENTS, Connection
from drone_rl.flight.airsim.lockstep import PATIENCE, SLICE, Lockstep
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

_POLL = 0.05
"""Longest sleep, seconds."""


class AirsimServer:
    """Serves one simulation to up to `MAX_CLIENTS` clients, and advances its time."""

    def __init__(self, simulation: Simulation, patience: float = PATIENCE) -> None:
        """Create a server that does not listen yet; for `patience` see `lockstep`."""
        self.simulation = simulation
        self._lockstep = Lockstep(simulation, patience)
        self._clients: set[Connection] = set()
        self._wake = asyncio.Event()
        self._server: asyncio.Server | None = None

    @property
    def address(self) -> tuple[str, int]:
        """Address and port at which it listens."""
        assert self._server is not None
        host, port = self._server.sockets[0].getsockname()[:2]
        return host, port

    def admit(self, client: Connection) -> bool:
        """Take note of a client; return whether there is room for it."""
        if len(self._clients) >= MAX_CLIENTS:
            return False
        self._clients.add(client)
        return True

    def dismiss(self, client: Connection) -> None:
        """Forget a client."""
        self._clients.discard(client)

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
        for client in [*self._clients]:
            client.close()


async def run(
    simulation: Simulation, host: str, port: int, ready: Callable[[str], Any], patience: float
) -> None:
    """Serve a simulation until cancelled; `ready` is called with the address once it listens.

    Raises:
        InputError: See `AirsimServer.start`.
    """
    server = AirsimServer(simulation, patience)
    await server.start(host, port)
    address, number = server.address
    ready(f"{address}:{number}")
    await server.serve()
