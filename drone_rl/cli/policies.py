"""`drone-rl policies` and `convert`: list policies and their verdicts; convert older ones."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import drone_rl
from drone_rl.cli.settings import CommandSettings
from drone_rl.utils.display import aligned
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import trained_policies
from drone_rl.utils.schema import Whole
from drone_rl.utils.text import plural

_LONGEST_NAME = 18
"""Characters of a path above which its figures are on a line of their own."""


class PoliciesCommand(CommandSettings):
    """List the shipped policies and the trained ones under outputs/.

    The first column is what policy= takes. Verdicts are those that the policies' files record.
    """

    has_folder = False
    most: Annotated[int, Whole(0, 10_000, "policies")] = 20
    """Trained policies to list, the newest first."""

    def run(self, folder: Path) -> tuple[int, None]:
        """List the shipped and the trained policies; return the exit status."""
        from drone_rl.policies.zoo import policy_names, policy_path  # imports torch
        from drone_rl.trust.recorded import read_verdicts

        outputs = Path(self.paths.outputs)
        verdicts = read_verdicts(outputs)
        shipped = [_row(policy_path(name), name, verdicts) for name in policy_names()]
        newest = trained_policies(outputs)
        trained = [_row(path, str(path.parents[1]), verdicts) for path in newest[: self.most]]
        head = ("policy=", "task", "verdict", "success (95% CI)", "trained")
        lines = aligned([head, *(_short(row) for row in (*shipped, *trained))]).splitlines()
        names = ["", *(row[0] for row in (*shipped, *trained))]
        for name, line in zip(names, lines, strict=True):
            print(*([name] if len(name) > _LONGEST_NAME else []), line, sep="\n")
        left = len(newest) - len(trained)
        if left:
            older = plural(left, "older policy", "older policies")
            print(f"and {older}; list all with most={len(newest)}")
        if not newest:
            print(f"no trained policies under {self.paths.outputs}/train; run drone-rl train")
        return 0, None


class ConvertCommand(CommandSettings):
    """Write a policy of version 0.1 in the present layout: drone-rl convert FILE."""

    unnamed, has_folder = "file", False
    file: str = ""
    """Policy of version 0.1: a .pt or .safetensors file."""
    output: str | None = None
    """The new file; null for NAME_converted.safetensors next to the old one."""

    def run(self, folder: Path) -> tuple[int, None]:
        """Convert; print the new file and return the exit status."""
        from drone_rl.policies.convert import convert  # imports torch

        output = None if self.output is None else Path(self.output)
        print(f"written: {convert(Path(self.file), output)}")
        return 0, None


def _short(row: Sequence[str]) -> Sequence[str]:
    return ["  ..." if len(row[0]) > _LONGEST_NAME else row[0], *row[1:]]


def _row(path: Path, name: str, verdicts: Sequence[tuple[float, Any]]) -> list[str]:
    """Return name, task, verdict, success rate and origin of a policy."""
    from drone_rl.trust.recorded import describe, recorded_verdict  # imports torch

    try:
        policy = drone_rl.load_policy(path)
    except InputError as error:
        is_plugin = "plugins=" in str(error)
        return [name, "", "needs plugins=[MODULE]" if is_plugin else "can't be read", "", ""]
    if path.suffix == ".pt":
        origin = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
    else:
        origin = f"revision {str(policy.state.provenance.git_revision)[:7]}"
    verdict = recorded_verdict(policy, verdicts)
    figures = ("not judged", "") if verdict is None else describe(verdict)
    return [name, policy.task.name, *figures, origin]
