"""Accessibility of the report and of the documentation site, by axe-core in Chromium."""

import importlib.resources
import logging
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.injections import chromium, explained
from drone_rl.explanations.report import write_report
from drone_rl.utils.errors import InputError, extra

IMPACTS = ("serious", "critical")
"""Impacts of violations that count."""
_SIZES = ((1300, 900), (390, 844))
"""Width and height of the window: a desk and a phone."""
_SCHEMES = ("light", "dark")
_RUN = """
const done = arguments[arguments.length - 1];
document.querySelectorAll("details").forEach(d => { d.open = true; });
axe.run().then(found => done(found.violations));
"""
"""Check the page with all details open."""
_log = logging.getLogger(__name__)


def bench_accessibility(
    folder: Path, quick: bool, explanation: Path | None = None
) -> dict[str, int]:
    """Check every page by day and by night, the report also on a phone.

    Args:
        folder: Folder of the files; created if missing.
        quick: Whether to leave out the documentation site.
        explanation: Folder of an explanation; by default a shipped policy is explained.

    Returns:
        "a11y_violations", the number of serious or critical violations, each rule once for each
        page, size and scheme; "a11y_pages", the number of pages.

    Raises:
        InputError: Chromium, its driver or axe-core is not installed, or a page can't be opened.
    """
    with chromium(folder / "profile") as browser:
        report = write_report([explanation or explained(folder)], folder / "report")
        pages = [report, *([] if quick else build_site(folder / "site"))]
        found = [
            violation
            for page in pages
            for violation in check(browser, page, _SIZES if page == report else _SIZES[:1])
        ]
    for violation in found:
        _log.warning("%s", violation)
    return {"a11y_violations": len(found), "a11y_pages": len(pages)}


def build_site(folder: Path) -> list[Path]:
    """Build the documentation site; return its pages.

    Raises:
        InputError: The site can't be built.
    """
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--quiet",
        "--site-dir",
        str(folder.absolute()),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise InputError(f"the site can't be built: {done.stderr.strip()[-500:]}")
    return sorted(path for path in folder.rglob("*.html") if path.name != "404.html")


def check(browser: Any, page: Path, sizes: Sequence[tuple[int, int]]) -> Iterator[str]:
    """Yield the violations of a page at each size of the window and in each color scheme."""
    extra("axe_core_python", "dev", "bench accessibility")
    program = importlib.resources.files("axe_core_python").joinpath("axe.min.js")
    source = program.read_text(encoding="utf-8")
    browser.set_script_timeout(120)
    for scheme in _SCHEMES:
        feature = {"name": "prefers-color-scheme", "value": scheme}
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
        for width, height in sizes:
            browser.set_window_size(width, height)
            browser.get(page.absolute().as_uri())
            if browser.execute_script("return location.protocol") != "file:":
                raise InputError(f"Chromium can't open {page}")  # it shows a page of its own
            browser.execute_script(source)
            for found in browser.execute_async_script(_RUN):
                if found["impact"] in IMPACTS:
                    where = found["nodes"][0]["html"][:200]
                    count = len(found["nodes"])
                    yield f"{page.name} {width} {scheme}: {found['id']} x{count}: {where}"
