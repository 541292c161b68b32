"""How long a policy's flights under all conditions take, and how wide the range is."""

import time
from typing import Any

from drone_rl.config.commands import ShiftSettings
from drone_rl.robustness.shifts import shifts
from drone_rl.utils.progress import silent


def bench_shifts(quick: bool) -> dict[str, Any]:
    """Flies the shipped good policy under every condition.

    Args:
        quick: Whether to fly few episodes, and to look for no range.

    Returns:
        "shift_suite_s": seconds from the policy's file to pictures, all axes at five strengths,
        200 episodes each, constantly different; "shift_suite_axes": how many; "shift_area": mean
        area under success over strength; "shift_domain": the sentence.
    """
    begin = time.perf_counter()
    episodes = 20 if quick else 200
    flown = ShiftSettings(seed=0, modes=("constant",))
    suite = shifts("good", flown, episodes=episodes, domain=False, progress=silent)
    seconds = time.perf_counter() - begin
    found = {
        "shift_suite_s": seconds,
        "shift_suite_axes": len(suite.numbers["axes"]),
        "shift_area": suite.area,
    }
    if not quick:
        whole = shifts("good", flown, strengths=[5], progress=silent)
        found["shift_domain"] = whole.sentence
    return found
