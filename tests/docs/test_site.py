"""The site has every page, no broken link, and asks nobody for anything."""

import json
import re
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

import pytest

from tests.chromium import open_page
from tests.docs.conftest import ROOT

PAGES = sorted(
    path.relative_to(ROOT / "docs").with_suffix("").as_posix()
    for path in (ROOT / "docs").rglob("*.md")
)
RESOURCES = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href"}


class Page(HTMLParser):
    """Names that can be pointed at, links to follow, and what the browser fetches by itself."""

    def __init__(self, path):
        super().__init__()
        self.path, self.ids, self.links, self.resources = path, set(), [], []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids |= {given[name] for name in ("id", "name") if given.get(name)}
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if given.get(RESOURCES.get(tag)):
            self.resources.append(given[RESOURCES[tag]])
        assert "mermaid" not in (given.get("class") or ""), "drawn by a program from the network"


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html") if path.name != "404.html"}


@pytest.mark.parametrize("page", PAGES)
def test_every_page_is_there_and_says_something(page, site):
    text = (site / f"{page}.html").read_text()
    assert len(re.sub("<[^>]*>", "", text.partition("<article")[2])) > 500


def test_no_link_is_broken(pages):
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https"):
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.exists(), f"{path.name} points at {link}"
            if parts.fragment and target.suffix == ".html":
                assert unquote(parts.fragment) in pages[target].ids, f"{path.name}: {link}"


def test_nothing_is_fetched_from_elsewhere(pages):
    for path, page in pages.items():
        assert page.resources
        for resource in page.resources:
            parts = urlsplit(resource)
            assert not parts.netloc, f"{path.name} fetches {resource}"
            assert parts.scheme == "data" or (path.parent / unquote(parts.path)).exists(), resource


def test_styles_fetch_nothing_from_elsewhere(site):
    styles = list(site.rglob("*.css"))
    assert styles
    for style in styles:
        fetched = re.findall(r"(?:@import|url\()\s*[\"']?(https?:|//)", style.read_text())
        assert not fetched, style


def test_the_readers_files_are_beside_the_pages(site):
    for name in ("results.json", "tutorials/notebook.ipynb", "flight.gif"):
        assert (site / name).read_bytes() == (ROOT / "docs" / name).read_bytes()


@pytest.fixture
def browser(site, tmp_path):
    """A real browser, which opens the site from the disk."""
    pytest.importorskip("selenium.webdriver")
    with open_page(site / "index.html", tmp_path, size=(1400, 1000)) as driver:
        yield driver


def test_it_can_be_searched_and_asks_nobody(browser):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait

    field = browser.find_element(By.CSS_SELECTOR, "input.md-search__input")
    browser.execute_script("arguments[0].focus()", field)
    field.send_keys("placebo")
    found = WebDriverWait(browser, 20).until(
        lambda b: b.find_elements(By.CSS_SELECTOR, ".md-search-result__link")
    )
    assert any("explanations.html" in link.get_attribute("href") for link in found)
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [e["params"]["request"]["url"] for e in events if e["method"].endswith("WillBeSent")]
    assert any(url.endswith("search_index.js") for url in asked)
    assert [url for url in asked if url.startswith(("http", "ws", "ftp"))] == []
    assert [e for e in browser.get_log("browser") if e["level"] == "SEVERE"] == []
