"""`drone-rl serve`: its settings."""

import contextlib
from pathlib import Path

import drone_rl
from drone_rl.cli.settings import CommandSettings
from drone_rl.flight.settings import ServeSettings


class ServeCommand(CommandSettings, ServeSettings):
    """Serve programs that were written for AirSim, until Ctrl-C."""

    settings: str | None = None
    """AirSim's settings.json; null for settings.json in the working directory, else in
    ~/Documents/AirSim, else for one multirotor; none for one multirotor."""

    def ends_alone(self) -> bool:
        """See `CommandSettings`."""
        return False

    def run(self, folder: Path) -> tuple[int, None]:
        """Serve until Ctrl-C; return the exit status."""
        import torch  # slow to import

        from drone_rl.flight.airsim.settings_file import find_settings

        torch.set_num_threads(1)  # its tensors are too small to split over threads
        chosen = find_settings() if self.settings is None else self.settings
        server = drone_rl.serve(
            None if chosen == "none" else chosen,
            recordings=folder / "recordings",
            **self.as_base(ServeSettings).values(),
        )
        with server, contextlib.suppress(KeyboardInterrupt):
            address, port = server.address
            print(f"ready: AirSim's clients can connect to {address}:{port}", flush=True)
            server.wait()
        return 0, None
