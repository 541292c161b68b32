"""`drone-rl fly`: its settings."""

import contextlib
import logging
import threading
import webbrowser
from pathlib import Path

import drone_rl
from drone_rl.cli.evaluation import AppearanceCommandSettings
from drone_rl.flight.settings import FlySettings

_log = logging.getLogger(__name__)


class FlyCommand(AppearanceCommandSettings, FlySettings):
    """Serve a local page from which a person or a policy flies, until Ctrl-C."""

    policy: str = "good"
    """Policy to hand over to: a .pt or .safetensors file, folder of a run, latest, or name of a
    shipped policy. Its task, camera and dynamics are the page's."""
    browser: bool = True
    """Whether to open the page in the default browser."""

    def ends_alone(self) -> bool:
        """See `CommandSettings`."""
        return False

    def run(self, folder: Path) -> tuple[int, None]:
        """Serve the page until Ctrl-C; return the exit status."""
        from drone_rl.trust.video import has_display  # imports torch

        policy = self.load_policy()
        settings = self.as_base(FlySettings)
        with (
            contextlib.suppress(KeyboardInterrupt),
            drone_rl.fly(policy, settings, outputs=self.paths.outputs) as page,
        ):
            print(f"open {page.url}", flush=True)
            _log.info("policy %s; end with Ctrl-C", policy.name)
            if self.browser and has_display():  # text browsers would take the terminal
                threading.Thread(target=webbrowser.open, args=(page.url,), daemon=True).start()
            page.wait()
        return 0, None
