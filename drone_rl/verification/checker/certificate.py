"""Read certificates: untrusted data of bounded size, parsed strictly."""

import dataclasses
import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.config import BaseTaskSettings, TaskSettings
from drone_rl.policies.zoo import PolicyDescription, fingerprint, parse
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils import schema
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import CERTIFICATE_BYTES
from drone_rl.verification.requirements import require_cubes

FORMAT = "drone_rl certificate"
FORMAT_VERSION = 1
MAX_CORNERS = 2**20  # corners of all boxes together
MAX_CUBES = 8
MAX_OUTCOMES = 2**11
MAX_STEPS = 20_000  # step counts of all outcomes together
MIN_BORDER = 2.0**-100  # metres. Smallest nonzero |border|; bounds the bits of exact sums.
MAX_BORDER = 2.0**20  # metres. Largest |border|
_NO_ENDS = (CubesEnd.RUNNING, CubesEnd.LOST_CONTROL)  # no control is lost in computer-vision mode
_ENDS = tuple(end.name.lower() for end in CubesEnd if end not in _NO_ENDS)


@dataclasses.dataclass(frozen=True)
class Outcome:
    """One outcome of episodes, and the placements that lead to it."""

    end: CubesEnd  # why the episodes end
    collected: tuple[bool, ...]  # whether each cube is collected by then
    loops: bool  # whether the drone oscillates until the step limit
    share: float  # fraction of the volume of all placements
    steps: Mapping[int, float]  # fraction by number of steps; they may sum to less than `share`
    boxes: NDArray[np.float64]
    """Metres to the left of each cube, lowest and highest. Shape: (boxes, cubes, 2)."""

    def __str__(self) -> str:
        which = ", ".join(str(i + 1) for i, collected in enumerate(self.collected) if collected)
        loops = ", to and fro" if self.loops else ""
        return f"{self.end.name.lower()}{loops}, cubes collected: {which or 'none'}"


@dataclasses.dataclass(frozen=True)
class Certificate:
    """Statements about a policy in a task."""

    name: str  # the policy's name, for display
    weights: str  # see `fingerprint`
    description: PolicyDescription  # of the policy, with the task of the certificate
    outcomes: tuple[Outcome, ...]
    undecided_share: float
    undecided: NDArray[np.float64]  # boxes without a statement. Shape: (boxes, cubes, 2)
    finished: bool  # whether the proof was completed

    @functools.cached_property
    def task(self) -> TaskSettings:
        """The task of the certificate."""
        return require_cubes(self.description, "certificates")

    @property
    def groups(self) -> list[NDArray[np.float64]]:
        """The boxes of each outcome, then the undecided ones."""
        return [*(outcome.boxes for outcome in self.outcomes), self.undecided]


def read_certificate(path: Path) -> Certificate:
    """Read a certificate from a JSON file.

    Raises:
        InputError: The file is missing, too large, damaged or not a certificate.
    """
    content = read_bytes(path, CERTIFICATE_BYTES)
    try:
        return parse_certificate(parse_json(content, "it"))
    except InputError as error:
        raise InputError(f"certificate {path} can't be used: {error}") from None


def parse_certificate(data: Any) -> Certificate:
    """Convert plain data to a certificate.

    Raises:
        InputError: A key is missing or unknown, or a value has another type or is out of bounds.
    """
    if isinstance(data, Mapping) and data.get("format") != FORMAT:
        raise InputError(f"its format is not {FORMAT!r}; give certificate.json of drone-rl prove")
    read = _WHOLE.read(data, "certificate")
    described = parse(read["policy"]["description"])
    task = require_cubes(described, "certificates")
    if task.vertical_bound != 0 or task.lateral_bound == 0:
        raise InputError(
            f"its task has vertical_bound={task.vertical_bound} and lateral_bound="
            f"{task.lateral_bound}; certificates require vertical_bound=0 and lateral_bound above 0"
        )
    if task.num_cubes > MAX_CUBES:
        raise InputError(f"num_cubes={task.num_cubes} is out of range; give at most {MAX_CUBES}")
    cubes = task.num_cubes
    outcomes = tuple(
        _read_outcome(one, f"outcomes[{i}]", cubes) for i, one in enumerate(read["outcomes"])
    )
    undecided = _read_boxes(read["undecided"]["boxes"], "undecided.boxes", cubes)
    if (steps := sum(len(outcome.steps) for outcome in outcomes)) > MAX_STEPS:
        raise InputError(f"it has {steps} step counts; give at most {MAX_STEPS}")
    count = sum(len(outcome.boxes) for outcome in outcomes) + len(undecided)
    if count > (most := MAX_CORNERS >> cubes):
        raise InputError(f"it has {count} boxes; give at most {most} for {cubes} cubes")
    return Certificate(
        name=read["policy"]["name"],
        weights=read["policy"]["weights"],
        description=described,
        outcomes=outcomes,
        undecided_share=read["undecided"]["share"],
        undecided=undecided,
        finished=read["finished"],
    )


_LATER = schema.Instance(object)  # anything; parsed once the number of cubes is known
_SHARE = schema.Real(0.0, 1.0)
_STATED_SHARE = schema.Real(0.0, 1.0, is_above=True)  # else any number of steps would be stated
_OUTCOME = schema.Record(
    {
        "end": schema.OneOf(_ENDS),
        "collected": schema.Several(schema.Flag(), 1, MAX_CUBES),
        "loops": schema.Flag(),
        "share": _SHARE,
        "steps": _LATER,
        "boxes": _LATER,
    }
)
_ORIGIN = {"versions": schema.Plain(), "git_revision": schema.Plain(), "machine": schema.Plain()}
_WHOLE = schema.Record(
    {
        "format": schema.OneOf((FORMAT,)),
        "format_version": schema.Whole(FORMAT_VERSION, FORMAT_VERSION),
        "policy": schema.Record(
            {"name": schema.Text(), "weights": schema.Text(64), "description": schema.Plain()}
        ),
        "outcomes": schema.Several(_OUTCOME, 0, MAX_OUTCOMES),
        "undecided": schema.Record({"share": _SHARE, "boxes": _LATER}),
        "finished": schema.Flag(),
        "stated": schema.Plain(),
        "found": schema.Plain(),
        **_ORIGIN,
    },
    optional=frozenset(_ORIGIN),
)


def _read_outcome(read: Mapping[str, Any], where: str, cubes: int) -> Outcome:
    if len(read["collected"]) != cubes:
        raise InputError(
            f"{where}.collected has {len(read['collected'])} values; give {cubes}, one per cube"
        )
    return Outcome(
        end=CubesEnd[read["end"].upper()],
        collected=read["collected"],
        loops=read["loops"],
        share=read["share"],
        steps=_read_steps(read["steps"], f"{where}.steps"),
        boxes=_read_boxes(read["boxes"], f"{where}.boxes", cubes),
    )


def _read_steps(value: Any, where: str) -> dict[int, float]:
    """Parse fractions above 0 by number of steps; the numbers have no leading zeros."""
    steps = {}
    for name, share in schema.Plain().read(schema.as_mapping(value, where), where).items():
        if not (name.isascii() and name.isdecimal() and len(name) < 7 and name[0] != "0"):
            raise InputError(
                f"{where}.{schema.shown(name)} is not a number of steps; give one above 0"
            )
        steps[int(name)] = _STATED_SHARE.read(share, f"{where}.{name}")
    return steps


def _read_boxes(value: Any, where: str, cubes: int) -> NDArray[np.float64]:
    """Parse lists of boxes, each a list of [low, high] pairs."""
    shape = f"give a list of boxes, each of {cubes} pairs of numbers [low, high], low below high"
    if value == []:
        return np.empty((0, cubes, 2))
    try:
        boxes = np.array(value)
    except ValueError:  # of lists of different lengths
        boxes = np.empty(0)
    if boxes.dtype.kind not in "if" or boxes.shape[1:] != (cubes, 2):
        raise InputError(f"{where} has the wrong shape or values other than numbers; {shape}")
    size = abs(boxes)
    if not ((size == 0) | (size >= MIN_BORDER) & (size <= MAX_BORDER)).all():
        raise InputError(
            f"{where} contains a border whose magnitude is above {MAX_BORDER:.1g} m, or below "
            f"{MIN_BORDER:.1g} m and not 0; {shape}"
        )
    empty = np.flatnonzero((boxes[..., 0] >= boxes[..., 1]).any(1))
    if len(empty):
        raise InputError(f"{where}[{empty[0]}] is empty; {shape}")
    return boxes.astype(np.float64)


def check_same_policy(
    certificate: Certificate,
    described: PolicyDescription,
    weights: Mapping[str, torch.Tensor],
    task: BaseTaskSettings | None = None,
) -> None:
    """Check that a certificate is for this policy and task, and that the policy can be verified.

    The task in `described` is ignored. Without `task`, any task is accepted.

    Raises:
        InputError: Another network, camera or task, or the policy has memory or camera faults.
    """
    require_cubes(described, "certificates")
    if certificate.weights != (policy_hash := fingerprint(weights)):
        raise InputError(
            f"the certificate is for a network with hash {certificate.weights[:12]}..., but the "
            f"policy's network has {policy_hash[:12]}...; set policy to the file that was proved"
        )
    stated, own_parts = certificate.description.as_dict(), described.as_dict()
    for part in ("appearance", "dynamics", "actions", "camera", "transforms", "network"):
        if stated.get(part) != own_parts.get(part):
            raise InputError(
                f"the certificate and the policy differ in {part}; set policy to the file that was "
                "proved"
            )
    if task is not None and certificate.task != task:
        name = next(n for n, v in task.values().items() if certificate.task.values()[n] != v)
        raise InputError(
            f"the certificate is for another task: {name}={getattr(certificate.task, name)}, not "
            f"{getattr(task, name)}; prove the policy in that task"
        )
