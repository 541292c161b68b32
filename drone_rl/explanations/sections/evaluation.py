"""How good it is: the verdict, on held-out episodes."""

from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations.context import Context
from drone_rl.verdicts.judge import judge_policy
from drone_rl.verdicts.rule import Rule


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "verdict"."""
    settings = context.settings
    rule = Rule(good_share=settings.good_share)
    verdict = judge_policy(context.env, context.restart(), settings.episodes, rule=rule)
    return {"verdict": verdict.as_dict()}, {}
