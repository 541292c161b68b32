"""Violations are found, and the report has none."""

import shutil

import pytest

from benchmarks.accessibility import bench_accessibility, check
from benchmarks.injections import chromium
from tests.explanations.quick import quick_figures
from tests.explanations.report.conftest import explanations  # noqa: F401

pytest.importorskip("selenium.webdriver")
pytest.importorskip("axe_core_python")
if not (shutil.which("chromium") and shutil.which("chromedriver")):
    pytest.skip("no chromium with chromedriver on this machine", allow_module_level=True)

PAGE = '<!doctype html><html lang="en"><head><title>x</title></head><body><main><h1>x</h1>{}</main>'


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("<p>plain</p>", None),
        ('<p style="color: #bbb; background: #fff">faint</p>', "color-contrast"),
        ('<img src="data:,">', "image-alt"),
        ("<button></button>", "button-name"),
    ],
)
def test_violations_are_named_with_their_element(browser, tmp_path, content, rule):
    page = tmp_path / "page.html"
    page.write_text(PAGE.format(content))
    found = list(check(browser, page, [(800, 600)]))
    assert len(found) == (0 if rule is None else 2)  # by day and by night
    assert all(rule in text and content[:10] in text for text in found)


@pytest.mark.slow
def test_the_report_has_no_violation(explanations, tmp_path):  # noqa: F811
    with quick_figures():
        found = bench_accessibility(tmp_path, quick=True, explanation=explanations[1])
    assert found == {"a11y_violations": 0, "a11y_pages": 1}
