"""A headless Chromium, for the benchmark of the fly page and for tests of pages."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError, extra


@contextmanager
def chromium(profile: Path) -> Iterator[Any]:
    """Start a headless Chromium.

    Args:
        profile: Folder of the browser's profile.

    Raises:
        InputError: Chromium or its driver is not installed.
    """
    webdriver = extra("selenium.webdriver", "dev", "bench fly_page")
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    if not (program and driver):
        raise InputError(
            "bench fly_page needs chromium and chromedriver; install them, on Debian with apt-get "
            "install chromium chromium-driver"
        )
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in (
        "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        "--window-size=1200,900", f"--user-data-dir={profile.absolute()}",
    ):  # fmt: skip
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    options.set_capability("unhandledPromptBehavior", "ignore")
    browser = webdriver.Chrome(options, webdriver.ChromeService(driver))
    try:
        yield browser
    finally:
        browser.quit()
