"""How good it is: the verdict, on held-out episodes."""

from typing import Any

from numpy.typing import NDArray

from drone_rl.evaluation.judge import judge_policy
from drone_rl.evaluation.rule import Rule
from drone_rl.explanations.context import Context


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "verdict"."""
    episodes, rule = context.settings.episodes, Rule(good_share=context.settings.good_share)
    actor, claim = context.restart(), context.claim
    verdict = judge_policy(
        context.env,
        actor,
        episodes,
        rule=rule,
        claim=claim,
        unlike=context.unlike,
        seed=context.seed,
    )
    return {"verdict": verdict.as_dict()}, {}
