"""Policies as files for others, each with a card that says what it is and where it comes from."""

import shlex
from pathlib import Path
from typing import Any

from drone_rl.api.policy import Policy
from drone_rl.settings.judging import FlightSettings
from drone_rl.sweeps import read_sweep
from drone_rl.sweeps.rows import read_rows
from drone_rl.utils.overrides import read_overrides
from drone_rl.verdicts.judge import judge_policy
from drone_rl.zoo import export_policy


def export(
    policy: Policy, target: Path, settings: FlightSettings, *, command: str | None = None
) -> None:
    """Judges a policy and writes it as safetensors, with a model card beside it.

    Args:
        policy: Which.
        target: Of the file, ending in .safetensors.
        settings: Of the flights for the card's verdict.
        command: That trained it; None names what its file or folder says.

    Raises:
        InputError: It can't be written.
    """
    seed, device = settings.seed, settings.device
    with policy.flying(settings.num_worlds, seed=seed, device=device) as (env, actor):
        verdict = judge_policy(env, actor, settings.episodes).as_dict()
    noted, chosen = origin_of(policy.path, policy.state)
    export_policy(
        target,
        policy.state,
        command=command or noted,
        verdict=verdict,
        seed=seed,
        chosen=chosen,
    )


def origin_of(path: Path, state: dict[str, Any]) -> tuple[str, dict[str, Any] | None]:
    """The command that trains the same once more, and the choice in a sweep, if it is of one."""
    folder = path.absolute().parent.parent
    if path.suffix == ".pt" and (folder.parent / "sweep.json").is_file():
        rows = read_rows(read_sweep(folder.parent))
        row = next((row for row in rows if row.run.folder == folder), None)
        if row is not None:
            episodes = None if row.verdict is None else row.verdict["greedy"]["episodes"]
            return row.run.repeat_command(), {"runs": len(rows), "episodes": episodes}
    noted = state.get("command") or shlex.join(["drone-rl", "train", *read_overrides(folder)])
    return noted, state.get("chosen")
