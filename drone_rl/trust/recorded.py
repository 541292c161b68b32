"""The recorded verdict of a policy: commands write one, and others look up the newest."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.trust.judge import Judgement, identify
from drone_rl.trust.results import Verdict
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import make_folder, newest_first
from drone_rl.utils.run_result import read_result
from drone_rl.utils.text import rate

NAME = "verdict.json"
MAX_FILES = 200
"""Largest number of such files to read, the newest first."""


def record_verdict(folder: Path, policy: BasePolicy, verdict: Verdict) -> None:
    """Write a verdict to a command's folder, for `recorded_verdict`."""
    make_folder(folder)
    origin = {"policy": policy.source, "weights": identify(policy)}
    Judgement(**dict(verdict), **origin).save(folder / NAME)


def recorded_verdict(
    policy: Policy, of_commands: Iterable[tuple[float, Judgement]]
) -> Verdict | None:
    """Return the newest verdict on a policy, or None.

    It is from the result of the policy's run, from its own file, or from those of commands, see
    `read_verdicts`.
    """
    weights = identify(policy)
    verdicts: list[tuple[float, Verdict]] = [*_own(policy)]
    if weights is not None:
        verdicts += [(when, one) for when, one in of_commands if one.weights == weights]
    return max(verdicts, key=lambda dated: dated[0])[1] if verdicts else None


def describe(verdict: Verdict) -> tuple[str, str]:
    """Return a verdict's kind with its certainty, and the success rate with its interval."""
    unsure = "" if verdict.certain else " (uncertain)"
    return f"{verdict.kind.value}{unsure}", rate(verdict.greedy.success, label="")


def _own(policy: Policy) -> Iterator[tuple[float, Verdict]]:
    """Yield the verdict of the policy's run or file, with its time."""
    path, verdict = policy.path, policy.state.verdict
    if path.suffix == ".pt":
        path = path.absolute().parents[1] / "result.json"
        result = read_result(path.parent)
        if result is None or result.frames != policy.state.progress.frames:
            return
        verdict = result.verdict and dict(result.verdict)
    with suppress(InputError):
        if verdict is not None:
            yield path.stat().st_mtime, Verdict.read(verdict)


def read_verdicts(outputs: str | Path) -> list[tuple[float, Judgement]]:
    """Return the newest verdicts in folders of commands below `outputs`, with their times."""
    folders = ("*/runs/*", "*/runs/*/*", "*/multiruns/*/*")
    paths = (path for folder in folders for path in Path(outputs).glob(f"{folder}/{NAME}"))
    verdicts = []
    for path in newest_first(paths)[:MAX_FILES]:
        with suppress(InputError):
            verdicts.append((path.stat().st_mtime, Judgement.read_json(path)))
    return verdicts
