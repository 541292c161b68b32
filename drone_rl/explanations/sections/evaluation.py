"""How good it is: the verdict, on held-out episodes."""

from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations.context import Context
from drone_rl.verdicts.judge import judge_policy
from drone_rl.verdicts.rule import Rule


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
