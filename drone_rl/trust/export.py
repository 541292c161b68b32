"""`drone-rl export`: write a policy as safetensors with a model card."""

import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError

from drone_rl.config.commands import HeldOutSettings
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import certificate_path, shifts_path
from drone_rl.policies.zoo.files import exported_bytes
from drone_rl.sim.vocabulary import some_cubes
from drone_rl.trust.coverage import find_domain
from drone_rl.trust.evaluate import held_out_environments
from drone_rl.trust.findings import untested
from drone_rl.trust.results import Verdict
from drone_rl.trust.shifts_results import SavedShifts, find
from drone_rl.trust.verdict import FindClaim, judge_policy
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_all_atomically
from drone_rl.utils.limits import CERTIFICATE_BYTES, SHIFTS_BYTES
from drone_rl.utils.models import Stored
from drone_rl.utils.overrides import COMMAND, read_overrides
from drone_rl.utils.provenance import Provenance
from drone_rl.utils.schema import Maybe
from drone_rl.utils.seeding import with_seed
from drone_rl.utils.text import render


def export(
    policy: Policy,
    target: Path,
    settings: HeldOutSettings,
    *,
    command: str | None = None,
    chosen: Mapping[str, Any] | None = None,
    certificate: str | Path | None = None,
    shifts: str | Path | None = None,
    outputs: str | Path = "outputs",
    find_claim: FindClaim | None = None,
) -> Verdict:
    """Judge a policy and write it as safetensors with a model card, next to the verdict.

    Args:
        policy: The policy.
        target: The file, ending in .safetensors.
        settings: Settings of the card's verdict.
        command: The training command; None takes it from the policy's file or folder.
        chosen: How it was chosen in a sweep, see `export_policy`; None takes it from the policy's
            file.
        certificate: See `find_claim`; it is quoted and copied, like the robustness evaluation.
        shifts: See `find_domain`.
        outputs: See `find_domain`.
        find_claim: Finds and checks certificates, see `judge`.

    Returns:
        The verdict.

    Raises:
        InputError: The policy can't be written, or a given file is unusable.
    """
    settings, seed = with_seed(settings)
    noted, noted_choice = recorded_origin(policy.path, policy.state)
    command, chosen = Maybe(COMMAND).read(command or noted, "command"), chosen or noted_choice
    claim = None if find_claim is None else find_claim(policy, certificate, seed=seed)
    claim = None if claim is None or claim.refused else claim  # cards quote no refused certificate
    measured = find_domain(policy, shifts, outputs)
    with held_out_environments(policy, settings, seed) as (env, actor):
        judged = judge_policy(env, actor, settings.episodes, claim=claim, seed=seed)
    carried = {}
    if measured is not None and measured.why_not(judged) is None:
        carried[shifts_path(target)] = read_bytes(Path(measured.path), SHIFTS_BYTES)
        # the card names the copied file, without its folder
        measured = measured.replace(path=shifts_path(target).name)
    if claim is not None and judged.quoted:
        carried[certificate_path(target)] = read_bytes(Path(claim.path), CERTIFICATE_BYTES)
    about: dict[str, Any] = {"verdict": judged, "seed": seed.value, "chosen": chosen}
    about |= {"command": command, "shifts": measured, "carried": carried}
    export_policy(target, policy.state, **about)
    return judged


def recorded_origin(path: Path, state: dict[str, Any]) -> tuple[str | None, dict[str, Any] | None]:
    """Return the training command of a run or exported file, and the file's "chosen", if any.

    The command is None if it is unknown, as of a run that was trained from Python.
    """
    metadata = state if path.suffix == ".safetensors" else {}  # nobody checked that of a checkpoint
    noted, folder = metadata.get("command"), path.absolute().parent.parent
    if noted is None and (folder / ".hydra" / "overrides.yaml").is_file():
        typed = [o for o in read_overrides(folder) if not o.startswith(("resume=", "trial="))]
        noted = shlex.join(["drone-rl", "train", *typed])
    return noted, metadata.get("chosen")


def export_policy(
    path: Path,
    checkpoint: Mapping[str, Any],
    *,
    command: str | None,
    verdict: Verdict,
    seed: int,
    chosen: Mapping[str, Any] | None,
    shifts: SavedShifts | None = None,
    carried: Mapping[Path, bytes] | None = None,
) -> None:
    """Write a checkpoint's policy and its model card, .safetensors and .md, both or neither.

    `checkpoint` is from `read_policy`, `seed` is the root of the verdict's random streams. `chosen`
    has the entries of `Choice`; None outside a sweep. `carried` are further files that the card
    quotes, by their paths.

    Raises:
        InputError: The files can't be written.
    """
    origin = checkpoint["provenance"]
    about = {
        "progress": checkpoint["progress"],
        "provenance": {k: origin[k] for k in ("versions", "git_revision")},
        "command": Maybe(COMMAND).read(command, "command"),
        "verdict": verdict.as_dict(),
        "worlds": "report",
        "seed": seed,
        "chosen": chosen,
    }
    described = checkpoint["description"]
    try:
        content = exported_bytes(checkpoint["policy"], described, about)
    except SafetensorError as error:
        raise InputError(f"policy {path} can't be written ({error})") from error
    of_policy = {name: described.get(name) for name in ("task", "appearance", "dynamics")}
    digest = hashlib.sha256(content).hexdigest()
    card = Card.read(
        {**about, **of_policy, "name": path.stem, "digest": digest, "shifts": shifts}
    ).text()
    try:
        write_all_atomically({path: content, path.with_suffix(".md"): card, **(carried or {})})
    except OSError as error:
        raise InputError(
            f"policy {path} can't be written ({error.filename}: {error.strerror}); free some "
            "space or choose another folder with hydra.run.dir=..."
        ) from error


class Choice(Stored):
    """How a policy was chosen in a sweep."""

    runs: int
    """Number of runs in the sweep."""
    episodes: int | None
    """Number of episodes by which they were compared; None if it was not judged there."""


class Progress(Stored):
    """Progress of the training."""

    frames: int


class Card(Stored):
    """What a model card shows; mostly the metadata of the policy's file."""

    name: str
    digest: str
    """SHA-256 of the file."""
    command: str | None = None
    """The training command."""
    progress: Progress
    provenance: Provenance
    verdict: Verdict
    worlds: str | None = None
    """Stream of the verdict's environments."""
    seed: int | None = None
    """Root of their streams."""
    chosen: Choice | None = None
    """None outside a sweep."""
    task: dict[str, Any]
    """Settings of the task."""
    appearance: dict[str, Any] | None = None
    dynamics: dict[str, Any] | None = None
    """None in computer-vision mode."""
    shifts: SavedShifts | None = None

    def text(self) -> str:
        """Return the card as Markdown."""
        measured, verdict = self.shifts, self.verdict
        if measured is not None and measured.why_not(verdict):
            measured = None
        findings = find(verdict, measured)
        columns = {
            "most probable actions": verdict.greedy,
            "sampled actions": verdict.sampled,
            f"best random or constant actions ({verdict.best_baseline})": (
                verdict.baselines[verdict.best_baseline]
            ),
            "oracle": verdict.baselines["oracle"],
        }
        return render(
            "drone_rl.trust",
            "card.md.j2",
            c=self,
            measured=measured,
            columns={name: of for name, of in columns.items() if of is not None},
            findings=findings,
            unknown=untested(findings),
            cubes=None if "name" in self.task else some_cubes(self.task),
        )
