"""When lockstep time stands and requests are answered, and when it runs and requests wait.

A client does not say when it begins to wait for a movement: `moveToPositionAsync(...).join()` and
`moveToPositionAsync(...)` alone are the same message. So time stands until the clients that move
vehicles have been quiet for a moment. It then runs to the end of a call that waits, and requests
that arrive meanwhile are answered there. So it matters whether a request comes within that moment,
and not when exactly.
"""

import asyncio
import contextlib
import time

from drone_rl.flight.airsim.simulation import Simulation

MOST_REQUESTS = 20
"""Requests at one simulated time while a call waits; then time runs for `STEP`, so that loops
which ask until something has happened go on."""
STEP = 0.1
"""Simulated seconds; see `MOST_REQUESTS`."""
STRIDE = 10.0
"""Simulated seconds after which time stands, if requests wait, even if no call has ended."""
SLICE = 0.005
"""Seconds of real time between two looks at the sockets."""


class Lockstep:
    """Alternates between answering requests and advancing time."""

    def __init__(self, simulation: Simulation, patience: float) -> None:
        """Start with time that stands; `patience` is in seconds, of real time."""
        self.is_running = False
        """Whether time runs, and requests have to wait."""
        self._simulation, self._patience = simulation, patience
        self._quiet_since = 0.0
        self._count = 0
        self._held: list[asyncio.Future[None]] = []
        self._wake = asyncio.Event()

    def note(self, *, is_pilot: bool) -> None:
        """Take note of a request that was handled.

        After one of a client that moves vehicles, time stands for another `patience` seconds.
        """
        self._wake.set()
        if self._simulation.is_blocked:
            self.is_running = True  # its client asks nothing before it is answered
        if not is_pilot:
            return
        self._quiet_since = time.monotonic()
        if self._simulation.is_due:
            self._count += 1
            if self._count >= MOST_REQUESTS:
                self.is_running = True

    async def stands(self) -> None:
        """Wait until time stands; requests go on in the order of these calls."""
        while self.is_running:
            held = asyncio.get_running_loop().create_future()
            self._held.append(held)
            await held

    async def run(self) -> None:
        """Alternate until cancelled."""
        while True:
            await self._stand()
            await self._advance()

    async def _stand(self) -> None:
        """Wait for a call that needs time, and until its client is quiet."""
        while not self.is_running:
            left = None
            if self._simulation.is_due:
                left = self._quiet_since + self._patience - time.monotonic()
            if left is not None and left <= 0.0:
                self.is_running = True
                return
            self._wake.clear()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(left):
                    await self._wake.wait()

    async def _advance(self) -> None:
        """Run to the end of a call, or shorter; see `MOST_REQUESTS` and `STRIDE`."""
        simulation = self._simulation
        is_asked = self._count >= MOST_REQUESTS
        until = simulation.time + (STEP if is_asked else STRIDE)
        while not simulation.advance(SLICE, until):
            if simulation.time >= until - 1e-9:
                if is_asked or self._held:
                    break
                until += STRIDE
            await asyncio.sleep(0)
        self.is_running, self._count = False, 0
        self._quiet_since = time.monotonic()
        held, self._held = self._held, []
        for request in held:
            if not request.done():  # its connection may be closed
                request.set_result(None)
        await asyncio.sleep(0)  # they are handled now
