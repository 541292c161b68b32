"""Servers from settings: in a thread of this process, or for the command line."""

import asyncio
import contextlib
import logging
import threading
from pathlib import Path
from typing import Self

from drone_rl.flight.airsim.lockstep import PATIENCE
from drone_rl.flight.airsim.server import AirsimServer
from drone_rl.flight.airsim.settings_file import AirsimSettings, parse_settings, read_settings
from drone_rl.flight.airsim.simulation import CLOCKS, DATE, Simulation
from drone_rl.utils.files import as_path
from drone_rl.utils.schema import OneOf, Real, Text, Whole

_log = logging.getLogger(__name__)


class RunningServer:
    """A server in a thread of this process; a context manager that stops it."""

    def __init__(
        self, simulation: Simulation, host: str, port: int, patience: float = PATIENCE
    ) -> None:
        """Start it; see `AirsimServer.start` for errors."""
        self._patience = patience
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
            self._thread.join()
            simulation.close()
            raise self._error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop it; calls that wait are answered with an error."""
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
        try:
            server = AirsimServer(self.simulation, self._patience)
            await server.start(host, port)
            self.address = server.address
        except Exception as error:  # raised again in the thread that started this one
            self._error = error
            return
        finally:
            self._ready.set()
        await server.serve()


def serve(
    settings: str | Path | AirsimSettings | None = None,
    *,
    scene: str | Path = "cubes",
    clock: str = "wall",
    date: str = DATE,
    patience_s: float = PATIENCE,
    address: str | None = None,
    port: int | None = None,
    seed: int = 0,
    raw_channels: int = 3,
    renderer: str | None = None,
    recordings: str | Path | None = None,
) -> RunningServer:
    """Start a server for AirSim's clients in a thread of this process.

    >>> with drone_rl.serve(scene="blocks", clock="lockstep") as server:
    ...     client = airsim.MultirotorClient(port=server.address[1])

    Args:
        settings: Path of a settings.json, or parsed settings; by default one multirotor.
        scene: cubes, blocks, pillars, empty, or the path of an MJCF file.
        clock: "wall", or "lockstep", in which time passes only while a call waits for it.
        date: Time at which lockstep starts, as ISO 8601, UTC; time stamps count from 1970.
        patience_s: Real seconds without a request before time advances for a waiting call in
            lockstep.
        address: Address to listen at; that of the settings by default.
        port: Port; that of the settings by default, and 0 for a free one.
        seed: Of placements, gusts and sensor noise.
        raw_channels: Channels of raw images of AirSim's clients from version 1.2 on: 3, or 4 as
            AirSim 1.2 had.
        renderer: raytrace or mujoco_warp; by default the one that fits the scene.
        recordings: Folder for recordings; None refuses `startRecording`.

    Raises:
        InputError: A setting is wrong, the port is in use, or the address is not this machine's.
    """
    patience_s = Real(0.0, 60.0).read(patience_s, "patience_s")
    simulation, host, number = make_simulation(
        settings,
        scene=scene,
        clock=clock,
        date=date,
        address=address,
        port=port,
        seed=seed,
        raw_channels=raw_channels,
        renderer=renderer,
        recordings=recordings,
    )
    return RunningServer(simulation, host, number, patience_s)


def make_simulation(
    settings: str | Path | AirsimSettings | None,
    *,
    scene: str | Path,
    clock: str,
    date: str,
    address: str | None,
    port: int | None,
    seed: int,
    raw_channels: int,
    renderer: str | None,
    recordings: str | Path | None,
) -> tuple[Simulation, str, int]:
    """Return a simulation, and the address and port to serve it at; see `serve`."""
    if settings is None:
        settings = parse_settings("{}")
    elif not isinstance(settings, AirsimSettings):
        settings = read_settings(as_path(settings, "settings"))
    scene = Text().read(scene, "scene")
    clock = OneOf(CLOCKS).read(clock, "clock")
    date = Text().read(date, "date")
    seed = Whole(0, 2**31 - 1).read(seed, "seed")
    host = settings.address if address is None else Text().read(address, "address")
    number = settings.port if port is None else Whole(0, 65535).read(port, "port")
    if host not in ("127.0.0.1", "localhost", "::1"):
        _log.warning(
            "the server listens at %s: everybody in that network can control the vehicles", host
        )
    folder = None if recordings is None else as_path(recordings, "recordings")
    simulation = Simulation(
        settings,
        scene,
        clock=clock,
        date=date,
        seed=seed,
        raw_channels=Whole(3, 4).read(raw_channels, "raw_channels"),
        renderer=renderer,
        recordings=folder,
    )
    return simulation, host, number
