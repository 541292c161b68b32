"""Verdicts to choose by, for trainings and sweeps: in worlds that no report ever shows."""

from pathlib import Path
from typing import Any

from drone_rl.evaluation.judge import judge_policy
from drone_rl.policies.policy import load_policy
from drone_rl.utils.seeding import RootSeed, Stream, root_seed


def judge_to_choose(
    path: Path,
    episodes: int,
    device: str,
    renderer: str = "raytrace",
    *,
    seed: RootSeed | None = None,
) -> tuple[dict[str, Any], dict]:
    """What a checkpoint's policy is, in environments of which no report shows figures.

    Args:
        path: The checkpoint.
        episodes: To fly.
        device: Where to fly them.
        renderer: Who draws them.
        seed: Root of their random streams; a fresh one by default.

    Returns:
        The verdict, as in verdict.json, and the checkpoint's progress.

    Raises:
        InputError: The checkpoint is unusable.
    """
    policy = load_policy(path)
    count, seed = min(episodes, 250), seed or root_seed(None)
    worlds = policy.flying(
        count, seed=seed.value, stream=Stream.CHOICE, device=device, renderer=renderer
    )
    with worlds as (env, actor):
        verdict = judge_policy(env, actor, episodes, seed=seed)
        return verdict.as_dict(), policy.state["progress"]
