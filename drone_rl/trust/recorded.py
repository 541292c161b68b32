"""The recorded verdict of a policy: commands write one, and others look up the newest."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import fingerprint, parse
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import make_folder, read_json, write_atomically
from drone_rl.utils.readers import read_result
from drone_rl.utils.schema import Text, as_mapping
from drone_rl.utils.text import rate

NAME = "verdict.json"
MAX_FILES = 200
"""Largest number of such files to read, the newest first."""


def identify(policy: BasePolicy | None) -> str | None:
    """Return the hash of a policy's weights, None if its conditions are not those of training."""
    if not isinstance(policy, Policy):
        return None
    if policy.description.as_dict() != parse(policy.state["description"]).as_dict():
        return None
    return fingerprint(policy.state["policy"])


def record_verdict(folder: Path, policy: BasePolicy, verdict: Mapping[str, Any]) -> None:
    """Write a verdict, as in `verdict.json`, to a command's folder, for `recorded_verdict`."""
    content = {"policy": policy.origin["policy"], "weights": identify(policy), **verdict}
    make_folder(folder)
    write_atomically(folder / NAME, json.dumps(content, indent=2))


def recorded_verdict(
    policy: Policy, of_commands: Iterable[tuple[float, Mapping[str, Any]]]
) -> Mapping[str, Any] | None:
    """Return the newest verdict on a policy, or None.

    It is from the result of the policy's run, from its own file, or from those of commands, see
    `read_verdicts`. Its "kind", "certain" and success rate are of the right types.
    """
    weights = identify(policy)
    verdicts = [*_own(policy)]
    if weights is not None:
        verdicts += [dated for dated in of_commands if dated[1].get("weights") == weights]
    for _, verdict in sorted(verdicts, key=lambda dated: dated[0], reverse=True):
        with suppress(KeyError, TypeError, ValueError):
            describe(verdict)
            return verdict
    return None


def describe(verdict: Mapping[str, Any]) -> tuple[str, str]:
    """Return a verdict's kind with its certainty, and the success rate with its interval.

    Raises:
        KeyError, TypeError, ValueError: It comes from a damaged file.
    """
    kind = Text(40).read(verdict["kind"], "kind")
    success = as_mapping(verdict["greedy"]["success"], "success")
    return f"{kind}{'' if verdict['certain'] else ' (uncertain)'}", rate(success, label="")


def _own(policy: Policy) -> Iterator[tuple[float, Any]]:
    """Yield the verdict of the policy's run or file, with its time."""
    if policy.path.suffix != ".pt":
        yield policy.path.stat().st_mtime, policy.state.get("verdict")
        return
    path = policy.path.absolute().parents[1] / "result.json"
    result = read_result(path.parent) or {}
    if result.get("frames") == policy.state["progress"]["frames"]:
        yield path.stat().st_mtime, result.get("verdict")


def read_verdicts(outputs: str | Path) -> list[tuple[float, Mapping[str, Any]]]:
    """Return the newest verdicts in folders of commands below `outputs`, with their times."""
    folders = ("*/runs/*", "*/runs/*/*", "*/multiruns/*/*")
    paths = (path for folder in folders for path in Path(outputs).glob(f"{folder}/{NAME}"))
    times = sorted(((path.stat().st_mtime, path) for path in paths), reverse=True)
    verdicts = []
    for when, path in times[:MAX_FILES]:
        with suppress(InputError):
            verdicts.append((when, as_mapping(read_json(path), "it")))
    return verdicts
