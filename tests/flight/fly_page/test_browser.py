"""The page in a real browser, headless: what a person would do with it."""

import importlib.resources

import pytest

pytest.importorskip("selenium.webdriver")
pytest.importorskip("websockets")

from selenium.common.exceptions import JavascriptException
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

import drone_rl
from tests.chromium import open_browser

WAIT_S = 30


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("demonstrations"))
    with drone_rl.fly("good", saliency=False, demonstrations=folder) as opened:
        yield opened


@pytest.fixture(scope="module")
def session(page, tmp_path_factory):
    with open_browser(tmp_path_factory.mktemp("profile"), (1300, 900)) as driver:
        yield driver


@pytest.fixture
def browser(session, page):
    """The page, open for at least one frame, with a new episode that a person flies."""
    session.get(page.url)
    until(session, "return flyStats.displayed > 0 && !!hello")
    click(session, "person")
    episode = session.execute_script("return state.episode")
    session.execute_script("send({type: 'mode', mode: 'actions'}); send({type: 'reset'})")
    until(session, f"return state.episode > {episode} && state.mode === 'actions'")
    return session


def until(browser, script, seconds=WAIT_S):
    return WebDriverWait(browser, seconds, 0.05, [JavascriptException]).until(
        lambda d: d.execute_script(script)  # fails until the page has run its own script
    )


def click(browser, name):
    browser.find_element(By.ID, name).click()


def choose(browser, name, value):
    browser.find_element(By.CSS_SELECTOR, f"#{name} option[value={value}]").click()


def text(browser, name):
    return browser.find_element(By.ID, name).text


def press(browser, *keys):
    chain = ActionChains(browser)
    for key in keys:
        chain.key_down(key).pause(0.1).key_up(key).pause(0.1)
    chain.perform()


def position(browser):
    return browser.execute_script("return state.position")


def test_keys_move_the_drone_by_the_policys_actions(browser):
    click(browser, "view")
    press(browser, Keys.ARROW_UP, "w", "a", Keys.ARROW_RIGHT, "d")
    until(browser, "return state.steps === 5")
    assert position(browser) == [2.0, -1.0, 2.5]


def test_keys_turn_and_lift_it_in_computer_vision_mode(browser):
    choose(browser, "mode", "computer_vision")
    until(browser, "return state.mode === 'computer_vision'")
    assert "You fly: computer vision" in text(browser, "flyer")
    click(browser, "view")
    press(browser, "w", "e", "r", "i")
    until(browser, "return state.attitude[1] > 4")
    assert browser.execute_script("return state.attitude") == pytest.approx([0, 5, 5], abs=0.01)
    assert position(browser) == pytest.approx([0.25, 0.0, 2.75])


def test_held_keys_fly_it_in_simple_flight(browser):
    choose(browser, "mode", "simple_flight")
    until(browser, "return state.mode === 'simple_flight'")
    click(browser, "view")
    ActionChains(browser).key_down("w").perform()
    until(browser, "return state.velocity > 2")
    assert browser.execute_script("return state.attitude[1] < -1")  # it leans forward
    ActionChains(browser).key_up("w").perform()
    until(browser, "return state.velocity < 0.2")
    assert position(browser)[0] > 1.0


def test_keys_do_nothing_while_something_else_has_the_focus(browser):
    browser.execute_script("document.getElementById('reset').focus()")
    press(browser, "w", "a")
    slider = browser.find_element(By.ID, "s-light")
    slider.send_keys(Keys.ARROW_LEFT, "w")
    until(browser, "return state.settings.light < 1")
    assert position(browser) == [0.0, 0.0, 2.5]
    assert text(browser, "hint") == "Click here to fly with the keys" or not browser.execute_script(
        "return matchMedia('(hover: hover) and (pointer: fine)').matches"
    )
    browser.execute_script("send({type: 'set', name: 'light', value: 1})")


def test_the_policy_takes_over_and_collects_a_cube(browser):
    browser.execute_script("send({type: 'set', name: 'speed', value: 10})")
    click(browser, "policy")
    until(browser, "return state.goals[0] >= 1 && state.objects[0] === null")
    assert text(browser, "flyer") == "The policy good flies"
    until(browser, "return /^[123] of 3 cubes collected/.test($('score').textContent)")
    assert browser.find_element(By.ID, "policy").get_attribute("aria-pressed") == "true"
    click(browser, "view")
    press(browser, "p")  # by the keyboard back to the person
    until(browser, "return state.pilot === 'person'")
    assert "You fly" in text(browser, "flyer")


def test_sliders_change_wind_and_light(browser):
    for name, key in (("wind", Keys.END), ("light", Keys.HOME)):
        browser.find_element(By.ID, f"s-{name}").send_keys(key)
    until(browser, "return state.settings.wind === 12 && state.settings.light === 0.2")
    assert "12.0 m/s" in browser.find_element(By.ID, "sliders").text
    for name, value in (("wind", 0), ("light", 1)):
        browser.execute_script(f"send({{type: 'set', name: '{name}', value: {value}}})")
    until(browser, "return state.settings.light === 1")


def test_the_pad_flies_by_pointer_and_by_keyboard(browser):
    forward = browser.find_element(By.CSS_SELECTOR, "#pad [data-control=forward]")
    forward.click()
    until(browser, "return state.steps === 1")
    forward.send_keys(Keys.ENTER)
    until(browser, "return state.steps === 2")
    assert position(browser) == [2.0, 0.0, 2.5]
    hidden = browser.find_element(By.CSS_SELECTOR, "#pad [data-control=up]")
    assert not hidden.is_displayed()  # no action of this policy


def test_messages_of_the_server_are_shown(browser):
    browser.execute_script("send({type: 'take_off'})")
    until(browser, "return /needs simple flight/.test($('problem').textContent)")
    press_reset = browser.find_element(By.ID, "reset")
    press_reset.click()
    until(browser, "return $('problem').textContent === ''")


@pytest.mark.parametrize("width", [1300, 390])
def test_it_fits_the_window(browser, width):
    size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        for mode in ("actions", "computer_vision", "simple_flight"):
            choose(browser, "mode", mode)
            until(browser, f"return state.mode === '{mode}'")
            wide = browser.execute_script("return document.documentElement.scrollWidth")
            assert wide <= width
        assert browser.find_element(By.ID, "view").size["width"] > 0.4 * width
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_violation(browser, scheme):
    package = pytest.importorskip("axe_core_python")
    source = importlib.resources.files(package).joinpath("axe.min.js").read_text(encoding="utf-8")
    feature = {"name": "prefers-color-scheme", "value": scheme}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    browser.set_script_timeout(120)
    browser.execute_script(source)
    for mode in ("computer_vision", "simple_flight"):
        choose(browser, "mode", mode)
        until(browser, f"return state.mode === '{mode}'")
        found = browser.execute_async_script(
            "const done = arguments[0]; axe.run().then(found => done(found.violations))"
        )
        assert [(one["id"], one["nodes"][0]["html"]) for one in found] == []
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_a_lost_connection_is_shown(tmp_path):
    with open_browser(tmp_path / "profile", (800, 600)) as browser:
        with drone_rl.fly("good", saliency=False) as opened:
            browser.get(opened.url)
            until(browser, "return flyStats.displayed > 0")
        until(browser, "return $('connection').classList.contains('bad')")


def test_a_page_that_connects_again_shows_the_same_controls(browser):
    browser.execute_script("window.earlier = hello; hold('test', 'forward'); socket.close()")
    until(browser, "return !document.querySelector('#pad .held')")
    until(browser, "return hello !== earlier")
    until(browser, "return document.querySelector('#pad [data-control=up]').hidden", seconds=10)
    assert "1.0 \u00d7" in browser.find_element(By.ID, "sliders").text


def test_a_frame_that_is_decoded_late_does_not_bring_back_the_last_episode(browser):
    late, shown = browser.execute_async_script(
        """const done = arguments[0], late = {...state, episode: state.episode - 1, images: []};
        late.frame -= 1;
        const text = new TextEncoder().encode(JSON.stringify(late));
        const message = new Uint8Array(4 + text.length);
        new DataView(message.buffer).setUint32(0, text.length, true);
        message.set(text, 4);
        frame(message.buffer).then(() => done([late.episode, state.episode]));"""
    )
    assert shown == late + 1


def test_no_error_in_the_console(session):
    severe = [one["message"] for one in session.get_log("browser") if one["level"] == "SEVERE"]
    assert severe == []
