"""A package that is waited for, in interpreters of its own."""

import subprocess
import sys

import pytest

WAITING = (
    "import importlib.util, sys; from drone_rl.utils.when_imported import when_imported\n"
    "done = []\n"
    "def do(): done.append(sys.modules['colorsys'].rgb_to_hsv)\n"
    "{}\n"
    "assert not done; when_imported('colorsys', do)\n"
)
"""Waits for a small module that nothing else imports."""


def run(code):
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("imported", ["import colorsys", "from colorsys import rgb_to_hsv"])
def test_it_is_done_once_when_the_package_is_imported_and_not_before(imported):
    run(
        f"{WAITING.format('')}"
        "import json; assert not done\n"
        "assert importlib.util.find_spec('colorsys') and not done  # asked for, not imported\n"
        f"{imported}; assert len(done) == 1, done\n"
        "del sys.modules['colorsys']; import colorsys; assert len(done) == 1\n"
        "assert not any(getattr(f, 'name', '') == 'colorsys' for f in sys.meta_path)\n"
    )


def test_it_is_done_at_once_where_the_package_is_there():
    run(WAITING.format("import colorsys") + "assert len(done) == 1\n")


def test_a_package_that_is_nowhere_is_still_missing():
    run(
        WAITING.format("").replace("'colorsys'", "'no_such_package'")
        + "try: import no_such_package\n"
        "except ModuleNotFoundError as error: assert error.name == 'no_such_package'\n"
        "else: raise AssertionError\n"
        "assert not done\n"
    )
