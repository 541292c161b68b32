"""The site in a real browser, from the disk: it can be searched, and asks nobody for anything."""

import json

import pytest

pytest.importorskip("selenium.webdriver")

from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from tests.chromium import open_page


@pytest.fixture(scope="module")
def browser(site, tmp_path_factory):
    profile = tmp_path_factory.mktemp("profile")
    with open_page(site / "index.html", profile, size=(1400, 1000)) as driver:
        yield driver


def test_it_can_be_searched_and_asks_nobody(browser):
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
