"""Explanations of policies, side by side in one report."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from drone_rl.evaluation.rounding_sensitivity import require_function
from drone_rl.explanations.report import write_report
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.explanations.study import explain_policy
from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_pilot
from drone_rl.robustness.shifts_file import SavedShifts
from drone_rl.utils.display import page
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import to_file_name
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import seed_line
from drone_rl.verdicts.certificate import find_claim
from drone_rl.verdicts.coverage import find_domain


@dataclasses.dataclass(frozen=True)
class Explanations:
    """What policies see, whether to trust them, and the report that shows it."""

    folder: Path
    """Holds a folder for each policy and the report."""
    report: Path
    """One HTML file that needs nothing else."""
    numbers: dict[str, dict[str, Any]]
    """As in `explanation.json`, by the names that were given."""
    seed: RootSeed
    """Root of all random streams."""

    def __str__(self) -> str:
        """A line for each verdict, and the seed."""
        lines = []
        for name, numbers in self.numbers.items():
            verdict = numbers["verdict"]
            certainty = "" if verdict["certain"] else " (not certain)"
            lines.append(f"{name}: {verdict['kind']}{certainty}. {verdict['sentence']}")
        return "\n".join([*lines, seed_line(self.seed.as_dict())])

    def _repr_html_(self) -> str:
        return page(self.report.read_text(encoding="utf-8"))


Given = str | Path | Pilot | Logits
"""A policy, or what it is made of, see `as_pilot`."""


def explain(
    policies: Given | Sequence[Given],
    settings: ExplainSettings | None = None,
    *,
    folder: str | Path = "outputs/explain/notebook",
    num_envs: int = 128,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Explanations:
    """Shows what policies see, and whether to trust them.

    Args:
        policies: One or several: policies, what `load_policy` takes, or callables, see
            `policy_from`.
        settings: What to compute.
        folder: Where explanations and report go.
        num_envs: Worlds in one batch; bounds memory.
        outputs: Where flights under other conditions are looked for, see `find_domain`.
        progress: Told of what is being done; a bar by default.
        changes: Settings to change, as in `explain("good", frames=100)`.

    Raises:
        InputError: A policy or a setting is unusable.
    """
    settings, seed = with_seed((settings or ExplainSettings()).replace(**changes))
    if num_envs < 1:
        raise InputError(f"num_envs={num_envs} is out of range; give 1 or more")
    chosen = _named(policies)
    folder, progress = Path(folder), progress or Bar()
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # the same file on every machine; pictures this small gain nothing
    try:
        folders = {n: folder / f"{i}_{to_file_name(n)}" for i, n in enumerate(chosen)}
        numbers = {
            name: _explain(
                policy,
                settings,
                seed,
                folders[name],
                num_envs,
                progress,
                find_domain(policy, None, outputs),
            )
            for name, policy in chosen.items()
        }
    finally:
        torch.set_num_threads(threads)
    progress("report")
    report = write_report(list(folders.values()), folder)
    progress("explained", 1, 1)
    return Explanations(folder, report, numbers, seed)


def _named(policies: Given | Sequence[Given]) -> dict[str, Pilot]:
    """The policies by their names or, where some share one, by their files."""
    if isinstance(policies, str) or not isinstance(policies, Sequence):
        policies = [policies]
    loaded = [as_pilot(policy) for policy in policies]
    names = [policy.name for policy in loaded]
    if len(set(names)) < len(names):
        names = [policy.origin["policy"] for policy in loaded]
    if not names or len(set(names)) < len(names):
        raise InputError(f"policy={names} must name one or more policies, each once")
    return dict(zip(names, loaded, strict=True))


def _explain(
    policy: Pilot,
    settings: ExplainSettings,
    seed: RootSeed,
    folder: Path,
    num_envs: int,
    progress: Progress,
    measured: SavedShifts | None,
) -> dict[str, Any]:
    require_function(policy, seed=seed.value, renderer=settings.renderer)
    env = policy.make_env(num_envs, seed=seed.value, renderer=settings.renderer)
    origin = {**policy.origin, **provenance()}
    try:
        return explain_policy(
            env,
            policy.make_network(),
            folder,
            settings,
            name=policy.name,
            provenance=origin,
            progress=lambda title: progress(f"{policy.name}: {title}"),
            claim=find_claim(policy, seed=seed),
            measured=measured,
            unlike=policy.unlike,
            seed=seed,
        )
    finally:
        env.close()
