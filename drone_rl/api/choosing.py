"""Verdicts to choose by, for trainings and sweeps: in worlds that no report ever shows."""

import json
from pathlib import Path
from typing import Any

from drone_rl.api.policy import load_policy
from drone_rl.sweeps import read_result
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, write_atomically
from drone_rl.utils.seeding import RootSeed, Stream, root_seed
from drone_rl.verdicts.judge import judge_policy


def draw_seed() -> RootSeed:
    """Return a fresh seed, for all runs that are compared."""
    return root_seed(None)


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
    count, seed = min(episodes, 250), seed or draw_seed()
    worlds = policy.flying(
        count, seed=seed.value, stream=Stream.CHOICE, device=device, renderer=renderer
    )
    with worlds as (env, actor):
        verdict = judge_policy(env, actor, episodes, seed=seed)
        return verdict.as_dict(), policy.state["progress"]


def judge_run(
    folder: Path, episodes: int, device: str, *, seed: RootSeed | None = None
) -> dict[str, Any]:
    """Judges the last policy of a finished run and keeps the verdict in its result.json.

    Args:
        folder: Of the run.
        episodes: To fly.
        device: Where to fly them.
        seed: Root of the environments' random streams, the same for all runs that are compared; a
            fresh one by default.

    Returns:
        The verdict.

    Raises:
        InputError: The run has no result, or its last checkpoint is unusable or not that of its
            result.
    """
    with folder_lock(folder):
        result = read_result(folder)
        if result is None:
            raise InputError(f"{folder} has no result.json; give the sweep's command to finish it")
        last = folder / "checkpoints" / "last.pt"
        verdict, progress = judge_to_choose(last, episodes, device, seed=seed)
        if progress["frames"] != result.get("frames"):
            raise InputError(
                f"{folder}/checkpoints/last.pt is of frame {progress['frames']}, result.json of "
                f"frame {result.get('frames')}; go on with: drone-rl train resume={folder}"
            )
        write_atomically(
            folder / "result.json", json.dumps({**result, "verdict": verdict}, indent=2)
        )
    return verdict
