"""`drone-rl export`: write a policy as safetensors with a model card."""

import dataclasses
import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError

from drone_rl.config.commands import HeldOutSettings
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import certificate_path, shifts_path
from drone_rl.policies.zoo.files import Choice, SavedPolicy
from drone_rl.sim.tasks import as_task
from drone_rl.trust.coverage import find_domain
from drone_rl.trust.evaluate import held_out_environments
from drone_rl.trust.findings import untested
from drone_rl.trust.results import Verdict
from drone_rl.trust.shifts_results import SavedShifts, find
from drone_rl.trust.verdict import FindClaim, judge_policy
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_all_atomically
from drone_rl.utils.limits import CERTIFICATE_BYTES, SHIFTS_BYTES
from drone_rl.utils.overrides import COMMAND, read_overrides
from drone_rl.utils.provenance import Provenance
from drone_rl.utils.schema import Instance
from drone_rl.utils.seeding import with_seed
from drone_rl.utils.text import render


def export(
    policy: Policy,
    target: Path,
    settings: HeldOutSettings,
    *,
    command: str | None = None,
    chosen: Choice | Mapping[str, Any] | None = None,
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
        chosen: How it was chosen in a sweep; None takes it from the policy's file.
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
    command = command or recorded_command(policy.path, policy.state)
    command = None if command is None else COMMAND.read(command, "command")
    chosen = Instance(Choice | None).read(chosen, "chosen") or policy.state.chosen
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


def recorded_command(path: Path, state: SavedPolicy) -> str | None:
    """Return the training command of an exported file or a run; None if it is unknown.

    That is so of a run that was trained from Python.
    """
    folder = path.absolute().parent.parent
    if path.suffix == ".safetensors" or not (folder / ".hydra" / "overrides.yaml").is_file():
        return state.command
    typed = [o for o in read_overrides(folder) if not o.startswith(("resume=", "trial="))]
    return shlex.join(["drone-rl", "train", *typed])


def export_policy(
    path: Path,
    policy: SavedPolicy,
    *,
    command: str | None,
    verdict: Verdict,
    seed: int,
    chosen: Choice | None,
    shifts: SavedShifts | None = None,
    carried: Mapping[Path, bytes] | None = None,
) -> None:
    """Write a policy and its model card, .safetensors and .md, both or neither.

    Args:
        path: The file, ending in .safetensors.
        policy: The policy, such as a checkpoint.
        command: The training command.
        verdict: The verdict.
        seed: Root of the verdict's random streams.
        chosen: How it was chosen; None outside a sweep.
        shifts: Its robustness evaluation.
        carried: Further files that the card quotes, by their paths.

    Raises:
        InputError: The files can't be written.
    """
    origin = policy.provenance
    exported = SavedPolicy(
        description=policy.description,
        weights=policy.weights,
        progress=policy.progress,
        provenance=Provenance(versions=origin.versions, git_revision=origin.git_revision),
        command=command,
        verdict=verdict.as_dict(),
        worlds="report",
        seed=seed,
        chosen=chosen,
    )
    try:
        content = exported.to_bytes()
    except SafetensorError as error:
        raise InputError(f"policy {path} can't be written ({error})") from error
    digest = hashlib.sha256(content).hexdigest()
    card = Card(path.stem, digest, exported, verdict, shifts).text()
    try:
        write_all_atomically({path: content, path.with_suffix(".md"): card, **(carried or {})})
    except OSError as error:
        raise InputError(
            f"policy {path} can't be written ({error.filename}: {error.strerror}); free some "
            "space or choose another folder with hydra.run.dir=..."
        ) from error


@dataclasses.dataclass(frozen=True)
class Card:
    """What a model card shows."""

    name: str
    digest: str
    """SHA-256 of the policy's file."""
    policy: SavedPolicy
    verdict: Verdict
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
            "oracle": verdict.baselines.get("oracle"),
        }
        return render(
            "drone_rl.trust",
            "card.md.j2",
            c=self,
            measured=measured,
            columns={name: of for name, of in columns.items() if of is not None},
            findings=findings,
            unknown=untested(findings),
            scenes=as_task(self.policy.description.task.parameters).vocabulary.tested,
        )
