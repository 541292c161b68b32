"""Film the page of `drone-rl fly`: `python -m tools.fly_film` writes docs/fly.gif, with Chromium.

A person flies some moves with the keyboard, then a policy takes over.
"""

import io
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

import drone_rl
from benchmarks.browser import chromium

SIZE, WIDTH = (1300, 1040), 800
"""Pixels of the browser's window, and the width of the film."""
MOVES = (Keys.ARROW_UP, Keys.ARROW_UP, Keys.ARROW_LEFT, Keys.ARROW_LEFT, Keys.ARROW_UP)
FRAME_MS = 250
TESTS_S = 300.0
"""Longest time of the tests of saliency maps, seconds."""
POLICY_FRAMES = 36


def main(target: Path) -> int:
    """Write the film and return the exit status."""
    frames: list[Image.Image] = []
    with (
        tempfile.TemporaryDirectory() as profile,
        drone_rl.fly("good") as page,
        chromium(Path(profile)) as browser,
    ):

        def shoot() -> None:
            image = Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB")
            frames.append(image.resize((WIDTH, WIDTH * image.height // image.width)))

        browser.set_window_size(*SIZE)
        browser.get(page.url)
        while not browser.execute_script("return flyStats.displayed > 0 && !!hello"):
            time.sleep(0.1)
        end = time.monotonic() + TESTS_S
        while "testing" in browser.find_element(By.ID, "method").text and time.monotonic() < end:
            time.sleep(1.0)  # the saliency map is shown once it has passed the tests
        browser.execute_script("send({type: 'mode', mode: 'actions'}); send({type: 'reset'})")
        time.sleep(1.0)
        for key in MOVES:
            ActionChains(browser).key_down(key).pause(0.1).key_up(key).perform()
            shoot()
        browser.find_element(By.ID, "policy").click()
        for _ in range(POLICY_FRAMES):
            shoot()
    first, *others = [f.quantize(128, dither=Image.Dither.NONE) for f in frames]
    first.save(
        target, save_all=True, append_images=others, duration=FRAME_MS, loop=0, optimize=True
    )
    print(f"{target}: {len(frames)} frames, {target.stat().st_size / 2**20:.1f} MiB")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(__file__).resolve().parents[1] / "docs" / "fly.gif"))
