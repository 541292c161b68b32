"""`drone-rl check`: check a certificate independently of the prover."""

import dataclasses
import functools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.config.commands import CheckSettings
from drone_rl.config.configuration import as_changes, from_arguments
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import policy_names
from drone_rl.utils.display import Result, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import CERTIFICATE_REFUSED
from drone_rl.utils.files import as_path, newest
from drone_rl.utils.models import Seeded
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import exact_percent
from drone_rl.verification.checker.certificate import (
    Certificate,
    certificate_file,
    check_same_policy,
    read_certificate,
)
from drone_rl.verification.checker.checker import CheckFindings, check_certificate


@dataclasses.dataclass(frozen=True)
class Check(Result):
    """The result of checking a certificate."""

    path: Path
    """The certificate's file."""
    policy: Policy
    """The policy, in the task of the certificate."""
    settings: CheckSettings
    certificate: Certificate
    """The statements."""
    findings: CheckFindings
    seed: RootSeed
    """Root seed of the simulated placements."""

    @property
    def accepted(self) -> bool:
        """Whether nothing contradicts the certificate."""
        return self.findings.accepted

    @property
    def exit_code(self) -> int:
        """Exit status of a process that reports it."""
        return 0 if self.accepted else CERTIFICATE_REFUSED

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, as in `check.json`."""
        return {
            "certificate": str(self.path),
            "policy": str(self.policy.path),
            "task": self.policy.task.values(),
            **self.seed.as_dict(),
            **self.findings.model_dump(mode="json"),
            **provenance(),
        }

    def save(self, path: Path) -> None:
        """Write `check.json`."""
        path.write_text(json.dumps(self.as_dict(), indent=2))

    def lines(self) -> list[str]:
        """Return the result, the statements, and each finding in one line."""
        stated, seed = self.certificate, Seeded(**self.seed.as_dict())
        task = self.policy.state["description"]["task"]
        changed = [f"{n}={v}" for n, v in self.policy.task.values().items() if task.get(n) != v]
        return [
            f"{'accepted' if self.accepted else 'refused'}: {self.path}, of policy "
            f"{self.policy.name}{' with ' if changed else ''}{', '.join(changed)}, "
            f"{sum(map(len, stated.groups))} boxes, {sum(self.findings.flights.values())} flights, "
            f"{self.findings.contradicted} of them ended otherwise than stated",
            *(f"stated: {exact_percent(of.share)} {of}" for of in stated.outcomes),
            f"stated: {exact_percent(stated.undecided.share)} undecided",
            *(f"refused: {line}" for line in self.findings.lines()),
            *(f"note: {line}" for line in [seed.seed_warning("placements")] if line),
            seed.seed_line("placements"),
        ]

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        head, *rows = (line.split(": ", 1) for line in self.lines())
        return table(head, rows)


def check(
    certificate: str | Path,
    policy: str | Path | Policy | None = None,
    settings: CheckSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Check:
    """Check a certificate independently of the prover: exact sums, and simulated episodes.

    Args:
        certificate: The file or its folder, or "latest" for the newest one.
        policy: The policy, or an argument of `load_policy`; by default the policy that the
            certificate names, if it is shipped with the package.
        settings: Settings of the check.
        task: Changes to the policy's task; the certificate must be for the changed task. Without
            changes, it may be for any task.
        outputs: Folder of runs.
        progress: Called with the progress; a bar by default.
        changes: Changes to the settings, as in `check("certificate.json", flights=10_000)`.

    Raises:
        InputError: The certificate is of another network or task, or an input is unusable.
    """
    settings, seed = with_seed(from_arguments(CheckSettings, settings, changes, check))
    path = _find(certificate, outputs)
    stated = read_certificate(path)
    if policy is None and stated.policy.name not in policy_names():
        raise InputError(
            f"the certificate is of policy {stated.policy.name!r}, which is none of "
            f"{', '.join(policy_names())}; give policy= its file"
        )
    policy = load_policy(stated.policy.name if policy is None else policy, outputs=outputs)
    weights = policy.state["policy"]
    required = policy.in_task(**as_changes(task, "task")).task if task else None
    check_same_policy(stated, policy.description, weights, required)
    policy = dataclasses.replace(policy, description=stated.policy.description)
    findings = check_certificate(
        stated,
        weights,
        flights=settings.flights,
        seed=seed.value,
        device=settings.device,
        renderer=settings.renderer,
        report=functools.partial(as_progress(progress), "flown"),
    )
    return Check(path, policy, settings, stated, findings, seed)


def _find(certificate: str | Path, outputs: str | Path) -> Path:
    if certificate != "latest":
        return certificate_file(certificate)
    path = newest(as_path(outputs, "outputs").glob("prove/**/certificate.json"))
    if path is None:
        raise InputError(
            f"certificate=latest, but there is none under {outputs}/prove; run drone-rl prove "
            "first or give the path of a certificate"
        )
    return path
