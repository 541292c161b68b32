"""Policies as files for others, each with a card that says what it is and where it comes from."""

import shlex
from pathlib import Path
from typing import Any

from drone_rl.api.policy import Policy
from drone_rl.api.quoting import find_claim
from drone_rl.settings.judging import FlightSettings
from drone_rl.sweeps import read_sweep
from drone_rl.sweeps.rows import read_rows
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_atomically
from drone_rl.utils.overrides import read_overrides
from drone_rl.verdicts.judge import judge_policy
from drone_rl.words.certificate import is_quoted
from drone_rl.zoo import certificate_path, export_policy


def export(
    policy: Policy,
    target: Path,
    settings: FlightSettings,
    *,
    command: str | None = None,
    certificate: str | Path | None = None,
) -> None:
    """Judges a policy and writes it as safetensors, with a model card beside it.

    Args:
        policy: Which.
        target: Of the file, ending in .safetensors.
        settings: Of the flights for the card's verdict.
        command: That trained it; None names what its file or folder says.
        certificate: A proof's file for the card to quote and for the policy to have beside it; by
            default the one that lies with the policy already.

    Raises:
        InputError: It can't be written, or the certificate that is given is unusable.
    """
    seed, device = settings.seed, settings.device
    claim = find_claim(policy, certificate)
    claim = None if claim is None or claim.refused else claim  # a card tells of what is
    with policy.flying(settings.num_worlds, seed=seed, device=device) as (env, actor):
        verdict = judge_policy(env, actor, settings.episodes, claim=claim).as_dict()
    noted, chosen = origin_of(policy.path, policy.state)
    export_policy(
        target,
        policy.state,
        command=command or noted,
        verdict=verdict,
        seed=seed,
        chosen=chosen,
    )
    if claim is not None and is_quoted(verdict):
        _carry(claim.path, certificate_path(target))


def _carry(certificate: Path, target: Path) -> None:
    """Puts a certificate beside the policy that it is of."""
    try:
        write_atomically(target, certificate.read_bytes())
    except OSError as error:
        raise InputError(f"certificate {target} can't be written ({error})") from error


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
