"""The report in a real browser, headless: what a person would do with it."""

import importlib.resources
import json

import pytest

pytest.importorskip("selenium.webdriver")

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from tests.chromium import open_page


@pytest.fixture(scope="module")
def browser(report, tmp_path_factory):
    with open_page(report, tmp_path_factory.mktemp("profile")) as driver:
        WebDriverWait(driver, 20).until(
            lambda d: d.find_element(By.ID, "map1").get_attribute("data-ready") == "true"
        )
        yield driver


def points(browser):
    """Data of the frames of the first map."""
    script = "return document.querySelector('#map0 script').textContent"
    return json.loads(browser.execute_script(script))


def point_at(browser, number):
    """Point at some frame's cell of the first map."""
    canvas = browser.find_element(By.CSS_SELECTOR, "#map0 > canvas")
    browser.execute_script("arguments[0].scrollIntoView({block: 'start'})", canvas)
    data = points(browser)
    x, y = browser.execute_script(
        """const canvas = document.querySelector('#map0 > canvas');
        const box = canvas.getBoundingClientRect();
        const [[c, r], [w, h]] = arguments;
        return [(c + .5) * w * box.width / canvas.width - box.width / 2,
                (r + .5) * h * box.height / canvas.height - box.height / 2];""",
        data["cells"]["features"][number],
        data["tile"],
    )
    ActionChains(browser).move_to_element_with_offset(canvas, round(x), round(y)).perform()
    return canvas, browser.find_element(By.CSS_SELECTOR, "#map0 .strip"), data


def test_pointing_at_a_frame_shows_its_probabilities_and_neighbours(browser):
    canvas, strip, data = point_at(browser, 4)  # the second of three frames of episode 1
    assert "forward" in strip.text
    assert f"episode 1, step {data['step'][4]} of {data['last'][1]}" in strip.text
    assert all(f"step {step}:" in strip.text for step in data["step"][3:6])
    here = strip.find_element(By.CSS_SELECTOR, ".here")
    assert f"step {data['step'][4]}:" in here.text
    canvas.send_keys(Keys.ARROW_RIGHT)
    here = strip.find_element(By.CSS_SELECTOR, ".here")
    assert f"step {data['step'][5]}:" in here.text


def test_the_map_of_pixels_can_be_chosen(browser):
    button = browser.find_element(By.CSS_SELECTOR, "#map0 button[data-which=pixels]")
    browser.execute_script("arguments[0].click()", button)
    assert button.get_attribute("aria-pressed") == "true"


def test_it_fits_a_phone(browser):
    browser.set_window_size(500, 900)
    wide = browser.execute_script("return document.documentElement.scrollWidth - innerWidth")
    browser.set_window_size(1200, 900)
    assert wide <= 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_accessible(browser, scheme):
    package = pytest.importorskip("axe_core_python")
    source = importlib.resources.files(package).joinpath("axe.min.js").read_text(encoding="utf-8")
    feature = {"name": "prefers-color-scheme", "value": scheme}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    browser.set_script_timeout(120)
    browser.execute_script(source)
    violations = browser.execute_async_script(
        """document.querySelectorAll("details").forEach(d => { d.open = true; });
        axe.run().then(result => arguments[arguments.length - 1](result.violations));"""
    )
    assert [v["id"] for v in violations if v["impact"] in ("serious", "critical")] == []


def test_no_error_and_no_request(browser):
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    sent = [m["params"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    ours = [p["request"]["url"] for p in sent if p["documentURL"].endswith("/report.html")]
    assert sum(url.startswith("file:") for url in ours) == 1  # the page itself
    assert [url for url in ours if not url.startswith(("data:", "file:"))] == []
