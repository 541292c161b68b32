"""`drone-rl fly`: its settings."""

import contextlib
import logging
import os
import sys
import threading
import webbrowser
from pathlib import Path

import drone_rl
from drone_rl.cli.evaluation import AppearanceCommandSettings
from drone_rl.config.commands import FlySettings

_log = logging.getLogger(__name__)


class FlyCommand(AppearanceCommandSettings, FlySettings):
    """Settings of `drone-rl fly`."""

    policy: str = "good"
    """Policy to hand over to: a .pt or .safetensors file, folder of a run, latest, or name of a
    shipped policy. Its task, camera and dynamics are the page's."""
    browser: bool = True
    """Whether to open the page in the default browser."""

    def run(self, folder: Path) -> tuple[int, None]:
        """Serve the page until Ctrl-C; return the exit status."""
        policy = self.load_policy()
        given = self.as_base(FlySettings)
        with (
            contextlib.suppress(KeyboardInterrupt),
            drone_rl.fly(policy, given, outputs=self.paths.outputs) as page,
        ):
            print(f"open {page.url}", flush=True)
            _log.info("policy %s; end with Ctrl-C", policy.name)
            if self.browser and _has_display():
                threading.Thread(target=webbrowser.open, args=(page.url,), daemon=True).start()
            page.wait()
        return 0, None


def _has_display() -> bool:
    """Return whether a browser would open a window; text browsers would take the terminal."""
    names = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in names)
