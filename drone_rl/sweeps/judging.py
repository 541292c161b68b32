"""Judge the runs of a sweep in environments that are used for selection only."""

import json
from pathlib import Path
from typing import Any

from drone_rl.evaluation.judge import judge_for_selection
from drone_rl.sweeps.runs import read_result
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, write_atomically
from drone_rl.utils.seeding import RootSeed, root_seed


def draw_seed() -> RootSeed:
    """Return a fresh seed, for all runs that are compared."""
    return root_seed(None)


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
        verdict, progress = judge_for_selection(last, episodes, device, seed=seed)
        if progress["frames"] != result.get("frames"):
            raise InputError(
                f"{folder}/checkpoints/last.pt is of frame {progress['frames']}, result.json of "
                f"frame {result.get('frames')}; go on with: drone-rl train resume={folder}"
            )
        write_atomically(
            folder / "result.json", json.dumps({**result, "verdict": verdict}, indent=2)
        )
    return verdict
