"""Time of `drone-rl shifts` with the shipped good policy, and the policy's operating domain."""

import time
from typing import Any

from benchmarks.benchmark import Setup
from drone_rl.config.commands import ShiftSettings
from drone_rl.trust.shifts import shifts
from drone_rl.utils.progress import silent


def bench_shifts(setup: Setup) -> dict[str, Any]:
    """Evaluate the shipped good policy under every perturbation.

    Returns:
        "shift_suite_s": seconds to load the policy and evaluate all axes at five constant strengths
        with 200 episodes each, figures included; "shift_suite_axes": the number of axes;
        "shift_area": mean area under success rate over strength; "shift_domain": the sentence
        about the operating domain.
    """
    begin = time.perf_counter()
    episodes = 20 if setup.quick else 200
    settings = ShiftSettings(seed=0, modes=("constant",))
    suite = shifts("good", settings, episodes=episodes, domain=False, progress=silent)
    seconds = time.perf_counter() - begin
    figures = {
        "shift_suite_s": seconds,
        "shift_suite_axes": len(suite.axes),
        "shift_area": suite.area,
    }
    if not setup.quick:
        complete = shifts("good", settings, strengths=[5], progress=silent)
        figures["shift_domain"] = complete.sentence
    return figures
