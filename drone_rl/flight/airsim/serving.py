"""Servers from settings, in a thread of this process."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drone_rl.config.configuration import from_arguments
from drone_rl.flight.airsim.server import AirsimServer
from drone_rl.flight.airsim.settings_file import AirsimSettings, parse_settings, read_settings
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.server_thread import ServerThread
from drone_rl.flight.settings import ServeSettings
from drone_rl.utils.files import as_path

_log = logging.getLogger(__name__)


class RunningServer(ServerThread):
    """A server in a thread of this process; a context manager that stops it."""

    def __init__(self, simulation: Simulation, address: str, port: int, patience_s: float) -> None:
        """Start it; see `AirsimServer.start` for errors."""
        self.simulation = simulation
        """The simulation, which only the server's thread may touch while it runs."""
        self.address = ("", 0)
        """Address and port at which it listens."""

        async def serve(ready: Callable[[], None]) -> None:
            server = AirsimServer(simulation, patience_s)
            await server.start(address, port)
            self.address = server.address
            ready()
            await server.serve()

        try:
            super().__init__(serve)
        except BaseException:
            simulation.close()
            raise

    def close(self) -> None:
        """Stop it; calls that wait are answered with an error."""
        super().close()
        self.simulation.close()


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
