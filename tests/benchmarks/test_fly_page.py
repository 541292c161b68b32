"""The benchmark of the page: images that the browser says it has displayed."""

import pytest

from benchmarks.fly_page import bench_fly_page, watch
from drone_rl.utils.errors import InputError


class Browser:
    """A browser that has displayed some images per second."""

    def set_script_timeout(self, seconds):
        self.timeout = seconds

    def execute_async_script(self, script, milliseconds):
        self.script = script
        return 31.5 * milliseconds / 1000.0


def test_the_page_is_watched_for_the_given_time():
    browser = Browser()
    assert watch(browser, 2.0) == 63.0
    assert browser.timeout > 2.0 and "flyStats.displayed" in browser.script


def test_it_measures_in_a_browser(tmp_path):
    pytest.importorskip("uvicorn")
    try:
        found = bench_fly_page(tmp_path / "work", quick=True)
    except InputError as error:
        pytest.skip(str(error))
    assert found.keys() == {"fly_page_fps"} and 1.0 < found["fly_page_fps"] < 70.0
