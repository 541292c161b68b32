"""How good it is: the verdict, on held-out episodes."""

from typing import Any

from numpy.typing import NDArray

from drone_rl.evaluation import run_episodes, summarise
from drone_rl.explain.context import Context
from drone_rl.explain.verdict import judge_policy


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "evaluation" and "verdict"."""
    settings = context.settings
    actor = context.restart()
    episodes = run_episodes(context.env, actor, settings.episodes, greedy=settings.greedy)
    summary = summarise(episodes)
    verdict = judge_policy(summary, context.scenes.worlds.settings.num_cubes)
    return {"evaluation": summary, "verdict": verdict.as_dict()}, {}
