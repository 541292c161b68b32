"""Verdicts to choose by, for trainings and sweeps: in worlds that no report ever shows."""

import json
from pathlib import Path
from typing import Any

from drone_rl.api.policy import load_policy
from drone_rl.sweeps import read_result
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, write_atomically
from drone_rl.utils.seeding import Stream
from drone_rl.verdicts.judge import judge_policy


def judge_to_choose(
    path: Path, episodes: int, device: str, renderer: str = "raytrace"
) -> tuple[dict[str, Any], dict]:
    """What a checkpoint's policy is, in worlds that are the same for all who are chosen among.

    Args:
        path: The checkpoint.
        episodes: To fly.
        device: Where to fly them.
        renderer: Who draws them.

    Returns:
        The verdict, as in verdict.json, and the checkpoint's progress.

    Raises:
        InputError: The checkpoint is unusable.
    """
    policy = load_policy(path)
    count = min(episodes, 250)
    worlds = policy.flying(count, stream=Stream.CHOICE, device=device, renderer=renderer)
    with worlds as (env, actor):
        return judge_policy(env, actor, episodes).as_dict(), policy.state["progress"]


def judge_run(folder: Path, episodes: int, device: str) -> dict[str, Any]:
    """Judges the last policy of a finished run and keeps the verdict in its result.json.

    Args:
        folder: Of the run.
        episodes: To fly.
        device: Where to fly them.

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
        verdict, progress = judge_to_choose(folder / "checkpoints" / "last.pt", episodes, device)
        if progress["frames"] != result.get("frames"):
            raise InputError(
                f"{folder}/checkpoints/last.pt is of frame {progress['frames']}, result.json of "
                f"frame {result.get('frames')}; go on with: drone-rl train resume={folder}"
            )
        write_atomically(
            folder / "result.json", json.dumps({**result, "verdict": verdict}, indent=2)
        )
    return verdict
