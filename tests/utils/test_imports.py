"""A package that is waited for, in interpreters of its own."""

import importlib
import subprocess
import sys
import warnings

import pytest

from drone_rl.utils.imports import import_quietly

WAITING = (
    "import importlib.util, sys; from drone_rl.utils.imports import when_imported\n"
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


def test_a_warning_of_one_module_is_hidden_while_it_is_imported(tmp_path, monkeypatch):
    warn = "import warnings\nwarnings.simplefilter('always')\n" + "".join(
        f"warnings.warn('{text}', {kind})\n"
        for text, kind in [
            ("old words", "DeprecationWarning"),
            ("old words", "UserWarning"),
            ("other", "DeprecationWarning"),
        ]
    )
    for name in ("noisy_one", "noisy_two"):
        (tmp_path / f"{name}.py").write_text(warn)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    import_quietly("noisy_one", "DeprecationWarning", "old words")
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        importlib.import_module("noisy_one")
        one = [(str(w.message), w.category) for w in seen]
        importlib.import_module("noisy_two")
    assert one == [("old words", UserWarning), ("other", DeprecationWarning)]
    assert len(seen) == 5
    for name in ("noisy_one", "noisy_two"):
        del sys.modules[name]
