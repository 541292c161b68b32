"""The report in a real browser, headless: what a person would do with it."""

import json

import pytest

pytest.importorskip("selenium.webdriver")

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
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
    """What the first map knows of its frames."""
    found = browser.execute_script("return document.querySelector('#map0 script').textContent")
    return json.loads(found)


def middle_of_a_frame(browser, number):
    """Offset from the map's middle of some frame's cell."""
    known = points(browser)
    return browser.execute_script(
        """const canvas = document.querySelector('#map0 canvas');
        const box = canvas.getBoundingClientRect();
        const [[c, r], [w, h]] = arguments;
        return [(c + .5) * w * box.width / canvas.width - box.width / 2,
                (r + .5) * h * box.height / canvas.height - box.height / 2];""",
        known["cells"]["features"][number],
        known["tile"],
    )


def test_hover_shows_the_frame_with_its_probabilities(browser):
    canvas = browser.find_element(By.CSS_SELECTOR, "#map0 canvas")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    x, y = middle_of_a_frame(browser, 4)
    ActionChains(browser).move_to_element_with_offset(canvas, round(x), round(y)).perform()
    tip, known = browser.find_element(By.ID, "tip"), points(browser)
    assert tip.is_displayed()
    assert "forward" in tip.text
    assert f"episode 1, step {known['step'][4]} of {known['last'][1]}" in tip.text


def test_click_shows_the_moment_in_the_episode(browser):
    canvas = browser.find_element(By.CSS_SELECTOR, "#map0 canvas")
    x, y = middle_of_a_frame(browser, 4)  # the second of three frames of episode 1
    ActionChains(browser).move_to_element_with_offset(canvas, round(x), round(y)).click().perform()
    strip, steps = browser.find_element(By.CSS_SELECTOR, "#map0 .strip"), points(browser)["step"]
    assert all(f"step {step}:" in strip.text for step in steps[3:6])
    assert f"step {steps[4]}:" in strip.find_element(By.CSS_SELECTOR, ".here").text


def test_the_map_of_pixels_can_be_chosen(browser):
    button = browser.find_element(By.CSS_SELECTOR, "#map0 button[data-which=pixels]")
    button.click()
    assert button.get_attribute("aria-pressed") == "true"


def test_the_exact_map_is_zoomed_and_shown_whole_again(browser):
    element = browser.find_element(By.CSS_SELECTOR, "#places svg")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
    whole = element.get_dom_attribute("viewBox").split()
    browser.execute_script(
        """const box = arguments[0].getBoundingClientRect();
        arguments[0].dispatchEvent(new WheelEvent("wheel", {deltaY: -500, cancelable: true,
            clientX: box.left + box.width / 2, clientY: box.top + box.height / 2}));""",
        element,
    )
    assert float(element.get_dom_attribute("viewBox").split()[2]) < 0.5 * float(whole[2])
    ActionChains(browser).move_to_element(element).perform()
    where = browser.find_element(By.CSS_SELECTOR, "#places .where").text
    assert "m ahead" in where and "goes " in where
    ActionChains(browser).double_click(element).perform()
    assert [float(v) for v in element.get_dom_attribute("viewBox").split()] == [
        float(v) for v in whole
    ]
    margin = element.size["width"] // 2 - 2, element.size["height"] // 2 - 2
    ActionChains(browser).move_to_element_with_offset(element, *margin).perform()
    assert "goes " not in browser.find_element(By.CSS_SELECTOR, "#places .where").text


def test_it_fits_a_phone(browser):
    browser.set_window_size(500, 900)
    wide = browser.execute_script("return document.documentElement.scrollWidth - innerWidth")
    browser.set_window_size(1200, 900)
    assert wide <= 0


def test_no_error_and_no_request(browser):
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    sent = [m["params"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    ours = [p["request"]["url"] for p in sent if p["documentURL"].endswith("/report.html")]
    assert sum(url.startswith("file:") for url in ours) == 1  # the page itself
    assert [url for url in ours if not url.startswith(("data:", "file:"))] == []
