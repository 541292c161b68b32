"""A headless Chromium for tests of pages."""

from contextlib import ExitStack, contextmanager

import pytest

from benchmarks.browser import chromium
from drone_rl.utils.errors import InputError


@contextmanager
def open_browser(profile, size=(1200, 900)):
    """Start Chromium; skip the test if there is none on this machine.

    Args:
        profile: Folder of the browser's profile.
        size: Width and height of the window.
    """
    with ExitStack() as stack:
        try:
            browser = stack.enter_context(chromium(profile))
        except InputError as error:
            pytest.skip(str(error))
        browser.set_window_size(*size)
        yield browser


@contextmanager
def open_page(path, profile, size=(1200, 900)):
    """Open a file in Chromium; see `open_browser`."""
    with open_browser(profile, size) as browser:
        browser.get(path.as_uri())
        yield browser
