"""`drone-rl check`: check a certificate independently of the prover."""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from drone_rl.config import TaskSettings
from drone_rl.config.commands import CheckSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import policy_names
from drone_rl.utils.display import Result, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import CERTIFICATE_REFUSED
from drone_rl.utils.files import as_path, newest
from drone_rl.utils.models import Seeded
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.seeding import with_seed
from drone_rl.utils.text import at_most, exact_percent
from drone_rl.verification.checker.certificate import (
    Certificate,
    certificate_file,
    check_same_policy,
    read_certificate,
)
from drone_rl.verification.checker.checker import CheckFindings, check_certificate


class Check(Result, CheckFindings, Seeded, Provenance):
    """The result of checking a certificate, as in `check.json`; the seed is of the placements."""

    certificate: str
    """The certificate's file."""
    policy: str
    """The policy's file."""
    task: dict[str, Any]
    """Settings of the certificate's task."""
    stated: Certificate = Field(exclude=True)
    """The statements."""

    @property
    def exit_code(self) -> int:
        """Exit status of a process that reports it."""
        return 0 if self.accepted else CERTIFICATE_REFUSED

    def save(self, path: Path) -> None:
        """Write `check.json`."""
        self.write_json(path)

    def lines(self) -> list[str]:
        """Return the result, the statements, and each finding in one line."""
        stated, usual = self.stated, TaskSettings().values()
        changed = [f"{n}={v}" for n, v in self.task.items() if usual.get(n) != v]
        bound = f": not refuted, wrong on at most {at_most(self.wrong_at_most, 2)} of placements"
        return [
            f"{'accepted' if self.accepted else 'refused'}: {self.certificate}, "
            f"of policy {stated.policy.name}"
            f"{' with ' if changed else ''}{', '.join(changed)}, "
            f"{sum(map(len, stated.groups))} boxes, {sum(self.flights.values())} flights, "
            f"{self.contradicted} of them ended otherwise than stated"
            f"{f'{bound} (95% confidence)' if self.accepted else ''}",
            *(f"stated: {exact_percent(of.share)} {of}" for of in stated.outcomes),
            f"stated: {exact_percent(stated.undecided.share)} undecided",
            *(f"refused: {line}" for line in super().lines()),
            *(f"note: {line}" for line in [self.seed_warning("placements")] if line),
            self.seed_line("placements"),
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
    weights = policy.state.weights
    required = policy.in_task(task).task if task else None
    check_same_policy(stated, policy.description, weights, required)
    found = check_certificate(
        stated,
        weights,
        flights=settings.flights,
        seed=seed.value,
        device=settings.device,
        renderer=settings.renderer,
        report=functools.partial(as_progress(progress), "flown"),
    )
    return Check(
        **dict(found),
        certificate=str(path),
        policy=str(policy.path),
        task=stated.task.values(),
        stated=stated,
        **seed.as_dict(),
        **provenance(),
    )


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
