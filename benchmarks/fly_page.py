"""The page to fly from: images that a browser displays per second."""

import tempfile
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.browser import chromium
from drone_rl.flight.fly_page.server import fly

_SIZE = (1300, 900)
_START_S = 60.0
"""Seconds until the first image, at most."""
_HELD = "send({type: 'hold', controls: arguments[0]})"


def bench_fly_page(setup: Setup) -> dict[str, float]:
    """Fly a drone with dynamics in Chromium, so that every image differs from the one before.

    Returns:
        "fly_page_fps": images of 256x144 displayed per second.

    Raises:
        InputError: Chromium, its driver or the extra `fly` is not installed.
    """
    folder = setup.runs / "fly_page"
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory(dir=folder) as profile,
        fly("good", mode="simple_flight", saliency=False) as page,
        chromium(Path(profile)) as browser,
    ):
        browser.set_window_size(*_SIZE)
        browser.get(page.url)
        wait_until(browser, "flyStats.displayed > 0")
        browser.execute_script(_HELD, ["forward", "yaw_left"])  # in circles
        watch(browser, 1.0)
        return {"fly_page_fps": watch(browser, 3.0 if setup.quick else 15.0)}


def watch(browser: Any, seconds: float) -> float:
    """Return the images per second that the open page displays over some seconds."""
    browser.set_script_timeout(seconds + _START_S)
    return browser.execute_async_script(
        """const [milliseconds, done] = arguments, first = flyStats.displayed;
        const begin = performance.now();
        setTimeout(() => done(1000 * (flyStats.displayed - first) / (performance.now() - begin)),
            milliseconds);""",
        1000.0 * seconds,
    )


def wait_until(browser: Any, condition: str) -> None:
    """Wait until a JavaScript expression is true; raise selenium's TimeoutException if it isn't."""
    from selenium.webdriver.support.ui import WebDriverWait

    wait = WebDriverWait(browser, _START_S, 0.05)
    wait.until(lambda driver: driver.execute_script(f"return {condition}"))
