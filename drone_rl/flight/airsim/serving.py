"""Servers from settings, in a thread of this process."""

import asyncio
import contextlib
import logging
import threading
from pathlib import Path
from typing import Any, Self

from drone_rl.config.commands import ServeSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.flight.airsim.server import AirsimServer
from drone_rl.flight.airsim.settings_file import AirsimSettings, parse_settings, read_settings
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.files import as_path

_log = logging.getLogger(__name__)


class RunningServer:
    """A server in a thread of this process; a context manager that stops it."""

    def __init__(self, simulation: Simulation, address: str, port: int, patience_s: float) -> None:
        """Start it; see `AirsimServer.start` for errors."""
        self.simulation = simulation
        """The simulation, which only the server's thread may touch while it runs."""
        self.address = ("", 0)
        """Address and port at which it listens."""
        self.loop: asyncio.AbstractEventLoop
        """The event loop of its thread."""
        self._task: asyncio.Task[None] | None = None
        self._error: Exception | None = None
        self._ready, self._ended = threading.Event(), threading.Event()
        # Ctrl-C during `Thread.join` would mark the thread as ended, hence the events
        self._thread = threading.Thread(
            target=self._main, args=(address, port, patience_s), daemon=True
        )
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            self._thread.join()
            simulation.close()
            raise self._error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def wait(self) -> None:
        """Wait until the server ends; raise the error that ended it, if one did."""
        self._ended.wait()
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Stop it; calls that wait are answered with an error."""
        if self._task is not None and not self._ended.is_set():
            self.loop.call_soon_threadsafe(self._task.cancel)
            self._ended.wait()
        self.simulation.close()

    def _main(self, address: str, port: int, patience_s: float) -> None:
        try:
            with contextlib.suppress(asyncio.CancelledError):
                asyncio.run(self._serve(address, port, patience_s))
        except Exception as error:  # raised again in the thread that started this one
            self._error = error
            if self._ready.is_set():
                _log.error("the server failed: %s", error)
        finally:
            self._ended.set()
            self._ready.set()

    async def _serve(self, address: str, port: int, patience_s: float) -> None:
        self.loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        server = AirsimServer(self.simulation, patience_s)
        await server.start(address, port)
        self.address = server.address
        self._ready.set()
        await server.serve()


def serve(
    settings: str | Path | AirsimSettings | None = None,
    *,
    recordings: str | Path | None = None,
    **changes: Any,
) -> RunningServer:
    """Start a server for AirSim's clients in a thread of this process.

    >>> with drone_rl.serve(scene="blocks", clock="lockstep") as server:
    ...     client = airsim.MultirotorClient(port=server.address[1])

    Args:
        settings: Path of a settings.json, or parsed settings; by default one multirotor.
        recordings: Folder for recordings; None refuses `startRecording`.
        changes: Fields of `ServeSettings`, such as port=0.

    Raises:
        InputError: A setting is wrong, the port is in use, or the address is not this machine's.
    """
    chosen = from_arguments(ServeSettings, None, changes, serve)
    if settings is None:
        settings = parse_settings("{}")
    elif not isinstance(settings, AirsimSettings):
        settings = read_settings(as_path(settings, "settings"))
    address = settings.address if chosen.address is None else chosen.address
    port = settings.port if chosen.port is None else chosen.port
    if address not in ("127.0.0.1", "localhost", "::1"):
        _log.warning(
            "the server listens at %s: everybody in that network can control the vehicles", address
        )
    folder = None if recordings is None else as_path(recordings, "recordings")
    simulation = Simulation(settings, chosen, folder)
    vehicles = ", ".join(name or "(unnamed)" for name in simulation.vehicles)
    _log.info("scene %s, clock %s, vehicles: %s", chosen.scene, chosen.clock, vehicles)
    return RunningServer(simulation, address, port, chosen.patience_s)
