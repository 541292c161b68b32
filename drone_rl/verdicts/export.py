"""Export a policy as safetensors with a model card."""

import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError

from drone_rl.config.commands import FlightSettings
from drone_rl.evaluation.judge import judge_policy
from drone_rl.evaluation.verdict_text import is_quoted
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import certificate_path, shifts_path
from drone_rl.policies.zoo.files import exported_bytes
from drone_rl.robustness.domain_text import is_quoted as is_told
from drone_rl.sweeps.manifest import read_sweep
from drone_rl.sweeps.rows import read_rows
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_all_atomically
from drone_rl.utils.limits import CERTIFICATE_BYTES, SHIFTS_BYTES
from drone_rl.utils.overrides import COMMAND, read_overrides
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.verdicts.card import write_card
from drone_rl.verdicts.certificate import find_claim
from drone_rl.verdicts.coverage import find_domain


def export(
    policy: Policy,
    target: Path,
    settings: FlightSettings,
    *,
    command: str | None = None,
    certificate: str | Path | None = None,
    shifts: str | Path | None = None,
    outputs: str | Path = "outputs",
) -> RootSeed:
    """Judge a policy and write it as safetensors with a model card.

    Args:
        policy: Which.
        target: The file, ending in .safetensors.
        settings: Of the card's verdict.
        command: That trained it; None takes it from its file or folder.
        certificate: Certificate to quote and to copy; by default the one next to the policy.
        shifts: The same of a robustness evaluation, see `find_domain`.
        outputs: See `find_domain`.

    Returns:
        Root of the random streams of the verdict's environments.

    Raises:
        InputError: It can't be written, or a given file is unusable.
    """
    settings, seed = with_seed(settings)
    device = settings.device
    claim = find_claim(policy, certificate, seed=seed)
    claim = None if claim is None or claim.refused else claim  # cards quote no refused certificate
    measured = find_domain(policy, shifts, outputs)
    with policy.flying(
        settings.num_worlds, seed=seed.value, device=device, renderer=settings.renderer
    ) as (env, actor):
        verdict = judge_policy(env, actor, settings.episodes, claim=claim, seed=seed).as_dict()
    noted, chosen = origin_of(policy.path, policy.state)
    carried = {}
    if measured is not None and is_told({"shifts": measured.evidence, "verdict": verdict}):
        carried[shifts_path(target)] = read_bytes(measured.path, SHIFTS_BYTES)
    if claim is not None and is_quoted(verdict):
        carried[certificate_path(target)] = read_bytes(claim.path, CERTIFICATE_BYTES)
    export_policy(
        target,
        policy.state,
        command=command or noted,
        verdict=verdict,
        seed=seed.value,
        chosen=chosen,
        shifts=None if measured is None else _as_carried(measured.numbers, target),
        carried=carried,
    )
    return seed


def _as_carried(numbers: dict[str, Any] | None, target: Path) -> dict[str, Any] | None:
    """Name the copied file, without its folder."""
    if numbers is None:
        return None
    return {**numbers, "file": {**numbers["file"], "path": shifts_path(target).name}}


def origin_of(path: Path, state: dict[str, Any]) -> tuple[str, dict[str, Any] | None]:
    """Return the command that repeats the training, and the selection in a sweep, if any."""
    folder = path.absolute().parent.parent
    if path.suffix == ".pt" and (folder.parent / "sweep.json").is_file():
        rows = read_rows(read_sweep(folder.parent))
        row = next((row for row in rows if row.run.folder == folder), None)
        if row is not None:
            episodes = None if row.verdict is None else row.verdict["greedy"]["episodes"]
            return row.run.repeat_command(), {"runs": len(rows), "episodes": episodes}
    noted = state.get("command") or shlex.join(["drone-rl", "train", *read_overrides(folder)])
    return noted, state.get("chosen")


def export_policy(
    path: Path,
    checkpoint: Mapping[str, Any],
    *,
    command: str,
    verdict: Mapping[str, Any],
    seed: int,
    chosen: Mapping[str, Any] | None,
    shifts: Mapping[str, Any] | None = None,
    carried: Mapping[Path, bytes] | None = None,
) -> None:
    """Write a checkpoint's policy and its model card, both or neither.

    Args:
        path: The file, ending in .safetensors; the card ends in .md.
        checkpoint: From `read_policy`.
        command: The training command.
        verdict: As in verdict.json, from environments reserved for reports.
        seed: Root of their random streams.
        chosen: "runs" of the sweep that it is of, and "episodes" by which it was judged there;
            None outside a sweep.
        shifts: As in shifts.json, for the card.
        carried: Further files that the card quotes, by their paths.

    Raises:
        InputError: It can't be written.
    """
    origin = checkpoint["provenance"]
    about = {
        "progress": checkpoint["progress"],
        "provenance": {k: origin[k] for k in ("versions", "git_revision")},
        "command": COMMAND.read(command, "command"),
        "verdict": verdict,
        "worlds": "report",
        "seed": seed,
        "chosen": chosen,
    }
    described = checkpoint["description"]
    try:
        content = exported_bytes(checkpoint["policy"], described, about)
    except SafetensorError as error:
        raise InputError(f"policy {path} can't be written ({error})") from error
    told = {
        **about,
        "task": described["task"],
        "dynamics": described.get("dynamics"),
        "shifts": shifts,
    }
    card = write_card(path.stem, hashlib.sha256(content).hexdigest(), told)
    try:
        write_all_atomically({path: content, path.with_suffix(".md"): card, **(carried or {})})
    except OSError as error:
        raise InputError(
            f"policy {path} can't be written ({error.filename}: {error.strerror}); free some "
            "space or choose another folder with hydra.run.dir=..."
        ) from error
