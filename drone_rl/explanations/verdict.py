"""Sections "evaluation" (the verdict) and "shifts" (robustness, measured by `drone-rl shifts`)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.evaluation.judge import judge_policy
from drone_rl.evaluation.rule import Rule
from drone_rl.explanations.context import Context


def evaluation_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "verdict", on held-out episodes."""
    verdict = judge_policy(
        context.env,
        context.restart(),
        context.settings.episodes,
        rule=Rule(good_share=context.settings.good_share),
        claim=context.claim,
        unlike=context.unlike,
        seed=context.seed,
    )
    return {"verdict": verdict.as_dict()}, {}


def shifts_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "shifts", as in `shifts.json`, or why it is "refused"; nothing without such a file.

    Arrays: "shifts_..." of each axis, frames without a shift and at the five strengths, black where
    the task can't be changed so. Shapes: (6, H, W, 3).
    """
    measured = context.measured
    if measured is None:
        return {}, {}
    arrays = {
        f"shifts_{name}": np.stack([np.zeros_like(strip[0]) if p is None else p for p in strip])
        for name, strip in measured.pictures.items()
    }
    return {"shifts": measured.evidence}, arrays
