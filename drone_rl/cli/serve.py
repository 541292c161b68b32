"""`drone-rl serve`: its settings."""

import asyncio
import contextlib
import logging
from pathlib import Path
from typing import Annotated

from drone_rl.cli.settings import CommandSettings
from drone_rl.config import RendererName
from drone_rl.utils.schema import OneOf, Real, Whole

_log = logging.getLogger(__name__)


class ServeCommand(CommandSettings):
    """Settings of `drone-rl serve`."""

    settings: str | None = None
    """AirSim's settings.json; null for settings.json in the working directory, else in
    ~/Documents/AirSim, else for one multirotor; none for one multirotor."""
    scene: str = "cubes"
    """Objects in the scene: cubes, which vanish when touched; blocks; pillars; empty; or the
    path of an MJCF file, *.xml."""
    clock: Annotated[str, OneOf(("wall", "lockstep"))] = "wall"
    """wall: real time, multiplied by ClockSpeed. lockstep: time advances only while a call waits
    for it, as fast as the machine can, with the same results every time if clients send their
    requests within `patience_s` of each other."""
    date: str = "2024-01-01T00:00:00"
    """Time at which lockstep starts, as ISO 8601, UTC: time stamps count nanoseconds from 1970.
    With the wall clock they start at the present time."""
    patience_s: Annotated[float, Real(0.0, 60.0, unit="s")] = 0.02
    """Real seconds without a request before time advances for a waiting call in lockstep. Give more
    for a client that computes long between the start of a movement and its next request."""
    address: str | None = None
    """Address to listen at; null for that of the settings file, 127.0.0.1 by default."""
    port: Annotated[int, Whole(0, 65535)] | None = None
    """Port; null for that of the settings file, 41451 by default; 0 for a free one."""
    seed: Annotated[int, Whole(0, 2**31 - 1)] = 0
    """Seed of the placement of cubes and pillars, of gusts and of sensor noise."""
    raw_channels: Annotated[int, Whole(3, 4)] = 3
    """Channels of raw images of AirSim's clients from version 1.2 on: 3 (blue, green, red), or 4
    (red, green, blue, opacity) for programs that were written for AirSim 1.2."""
    renderer: RendererName | None = None
    """raytrace or mujoco_warp; null for the one that fits the scene."""
    watch: bool = False
    """Whether to serve a page that shows the first vehicle while programs fly it; needs the extra
    fly."""

    def ends_alone(self) -> bool:
        """See `CommandSettings`."""
        return False

    def run(self, folder: Path) -> tuple[int, None]:
        """Serve until Ctrl-C; return the exit status."""
        import torch

        from drone_rl.flight.airsim.server import run  # slow to import
        from drone_rl.flight.airsim.serving import make_simulation
        from drone_rl.flight.airsim.settings_file import find_settings

        settings = find_settings() if self.settings is None else self.settings
        torch.set_num_threads(1)  # its tensors are too small to split over threads
        simulation, host, port = make_simulation(
            None if settings == "none" else settings,
            scene=self.scene,
            clock=self.clock,
            date=self.date,
            address=self.address,
            port=self.port,
            seed=self.seed,
            raw_channels=self.raw_channels,
            renderer=self.renderer,
            recordings=folder / "recordings",
        )

        def ready(address: str) -> None:
            vehicles = ", ".join(name or "(unnamed)" for name in simulation.vehicles)
            _log.info("scene %s, clock %s, vehicles: %s", self.scene, self.clock, vehicles)
            print(f"ready: AirSim's clients can connect to {address}", flush=True)
            if self.watch:
                from drone_rl.flight.fly_page.watch import watch  # slow to import

                page = ending.enter_context(watch(simulation, asyncio.get_running_loop()))
                print(f"open {page.url} to watch", flush=True)

        with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as ending:
            ending.callback(simulation.close)
            asyncio.run(run(simulation, host, port, ready, self.patience_s))
        return 0, None
