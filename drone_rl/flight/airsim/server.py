"""AirSim's RPC server: msgpack-rpc over TCP, by asyncio, around one `Simulation`."""

import asyncio
import contextlib
import math
import time
from collections.abc import Callable
from typing import Any

from drone_rl.flight.airsim.connection import MAX_CLIENTS, Connection
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.utils.errors import InputError

SLICE = 0.005
"""Seconds of simulation between two looks at the sockets."""
PATIENCE = 0.005
"""Seconds without a request after which lockstep time goes on: what a client asks right after it
starts a movement is answered at the same simulated time every run."""
MOST_PATIENCE = 0.02
_POLL = 0.05


class AirsimServer:
    """Serves one simulation to any number of clients, and advances its time."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.last_request = -math.inf
        """Time of day of the last request."""
        self._asked = -math.inf
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
            self._server = await loop.create_server(lambda: Connection(self), host, port)
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
