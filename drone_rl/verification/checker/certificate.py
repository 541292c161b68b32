"""A certificate out of a file: data of bounded size, read strictly and believed in nothing."""

import dataclasses
import hashlib
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.config import BaseTaskSettings, TaskSettings
from drone_rl.policies.zoo import PolicyDescription, parse
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import CERTIFICATE_BYTES, CERTIFICATE_VALUES
from drone_rl.utils.schema import (
    Flag,
    OneOf,
    Plain,
    Real,
    Record,
    Several,
    Text,
    Whole,
    as_mapping,
    shown,
)
from drone_rl.verification.requirements import require_cubes, require_moves

FORMAT = "drone_rl certificate"
FORMAT_VERSION = 1
MOST_BOXES = 2**17
MOST_CORNERS = 2**20
"""Of all boxes together."""
MOST_CUBES = 8
MOST_OUTCOMES = 2**11
MOST_STEPS = 20_000
"""Numbers of steps in all outcomes together."""
LEAST_BORDER = 2.0**-100
"""Metres from 0 to a border that is not 0: exact sums need as many bits as this has zeros."""
MOST_BORDER = 2.0**20
"""Metres from 0 to any border."""
_NO_ENDS = (EndReason.RUNNING, EndReason.LOST_CONTROL)
"""Nobody loses control who flies in computer-vision mode."""
_ENDS = tuple(end.name.lower() for end in EndReason if end not in _NO_ENDS)
_DIGITS = len(str(10**5))


@dataclasses.dataclass(frozen=True)
class Outcome:
    """One way in which flights end, and from where."""

    end: EndReason
    """Why."""
    collected: tuple[bool, ...]
    """Which cubes were collected by then."""
    loops: bool
    """Whether the drone goes to and fro until the step limit."""
    share: float
    """Of the volume of all placements, as stated."""
    steps: Mapping[int, float]
    """The same by number of steps; what is missing is not certain."""
    boxes: NDArray[np.float64]
    """From where: metres to the left of each cube, lowest and highest. Shape: (boxes, cubes, 2)."""

    def __str__(self) -> str:
        """In few words."""
        which = ", ".join(str(i + 1) for i, collected in enumerate(self.collected) if collected)
        loops = ", to and fro" if self.loops else ""
        return f"{self.end.name.lower()}{loops}, cubes collected: {which or 'none'}"


@dataclasses.dataclass(frozen=True)
class Certificate:
    """What is stated of a policy in a task."""

    name: str
    """Of the policy, for people."""
    weights: str
    """Of its network, see `drone_rl.verification.checker.fingerprint`."""
    description: PolicyDescription
    """The policy's, in the task that it is stated of."""
    outcomes: tuple[Outcome, ...]
    undecided_share: float
    undecided: NDArray[np.float64]
    """Boxes of which nothing is stated. Shape: (boxes, cubes, 2)."""
    finished: bool
    """Whether the proof came to its end."""

    @property
    def task(self) -> TaskSettings:
        """The task that it is stated of."""
        return require_cubes(self.description.task, "what a certificate states")

    @property
    def bound(self) -> float:
        """Metres to either side at which cubes are placed at most."""
        return self.task.lateral_bound

    @property
    def groups(self) -> list[NDArray[np.float64]]:
        """The boxes of each outcome, then the undecided ones."""
        return [*(outcome.boxes for outcome in self.outcomes), self.undecided]


def read_certificate(path: Path) -> Certificate:
    """A certificate out of a file.

    Args:
        path: Of the JSON file.

    Raises:
        InputError: It is missing, too large, damaged, or no certificate.
    """
    content = read_bytes(path, CERTIFICATE_BYTES)
    try:
        return parse_certificate(parse_json(content, "it", most_values=CERTIFICATE_VALUES))
    except InputError as error:
        raise InputError(f"certificate {path} can't be used: {error}") from None


def parse_certificate(data: Any) -> Certificate:
    """A certificate out of plain data.

    Raises:
        InputError: A key is missing or unknown, or a value of another type or out of bounds.
    """
    read = _WHOLE.read(data, "certificate")
    described = read["policy"]["description"]
    task = described.task
    if task.vertical_bound != 0 or task.lateral_bound == 0:
        raise InputError(
            f"its task has vertical_bound={task.vertical_bound} and lateral_bound="
            f"{task.lateral_bound}; certificates are of 0 and of more than 0"
        )
    if task.num_cubes > MOST_CUBES:
        raise InputError(f"num_cubes={task.num_cubes} is out of range; give at most {MOST_CUBES}")
    cubes = task.num_cubes
    outcomes = tuple(
        _read_outcome(one, f"outcomes[{i}]", cubes) for i, one in enumerate(read["outcomes"])
    )
    undecided = _read_boxes(read["undecided"]["boxes"], "undecided.boxes", cubes)
    if (steps := sum(len(outcome.steps) for outcome in outcomes)) > MOST_STEPS:
        raise InputError(f"it has {steps} numbers of steps; give at most {MOST_STEPS}")
    count = sum(len(outcome.boxes) for outcome in outcomes) + len(undecided)
    if count > min(MOST_BOXES, MOST_CORNERS >> cubes):
        raise InputError(
            f"it has {count} boxes; of {cubes} cubes give at most "
            f"{min(MOST_BOXES, MOST_CORNERS >> cubes)}"
        )
    return Certificate(
        name=read["policy"]["name"],
        weights=read["policy"]["weights"],
        description=described,
        outcomes=outcomes,
        undecided_share=read["undecided"]["share"],
        undecided=undecided,
        finished=read["finished"],
    )


class _Anything:
    """What is looked at later."""

    def read(self, value: Any, where: str) -> Any:
        """See `drone_rl.utils.schema.Kind`."""
        return value


class _Description:
    """A policy's description."""

    def read(self, value: Any, where: str) -> PolicyDescription:
        """See `drone_rl.utils.schema.Kind`."""
        return parse(Plain(most=1000).read(value, where))


_SHARE = Real(0.0, 1.0)
_OUTCOME = Record(
    {
        "end": OneOf(_ENDS),
        "collected": Several(Flag(), 1, MOST_CUBES),
        "loops": Flag(),
        "share": _SHARE,
        "steps": _Anything(),
        "boxes": _Anything(),
    }
)
_ORIGIN = {"versions": Plain(), "git_revision": Plain(), "machine": Plain()}
_WHOLE = Record(
    {
        "format": OneOf((FORMAT,)),
        "format_version": Whole(FORMAT_VERSION, FORMAT_VERSION),
        "policy": Record({"name": Text(), "weights": Text(64), "description": _Description()}),
        "outcomes": Several(_OUTCOME, 0, MOST_OUTCOMES),
        "undecided": Record({"share": _SHARE, "boxes": _Anything()}),
        "finished": Flag(),
        "stated": Record({"logit_gap": Real(0.0), "largest_band": Real(0.0), "renderer": Text()}),
        "found": Plain(most=1000, deepest=3),
        **_ORIGIN,
    },
    optional=frozenset(_ORIGIN),
)


def _read_outcome(read: Mapping[str, Any], where: str, cubes: int) -> Outcome:
    if len(read["collected"]) != cubes:
        raise InputError(
            f"{where}.collected has {len(read['collected'])} values; give {cubes}, one a cube"
        )
    return Outcome(
        end=EndReason[read["end"].upper()],
        collected=read["collected"],
        loops=read["loops"],
        share=read["share"],
        steps=_read_steps(read["steps"], f"{where}.steps"),
        boxes=_read_boxes(read["boxes"], f"{where}.boxes", cubes),
    )


def _read_steps(value: Any, where: str) -> dict[int, float]:
    """Shares by number of steps, which is written without zeros before it."""
    steps = {}
    for name, share in Plain(deepest=1).read(as_mapping(value, where), where).items():
        if not (name.isascii() and name.isdigit() and len(name) <= _DIGITS and name[0] != "0"):
            raise InputError(f"{where}.{shown(name)} is no number of steps; give one above 0")
        steps[int(name)] = _SHARE.read(share, f"{where}.{name}")
    return steps


def _read_boxes(value: Any, where: str, cubes: int) -> NDArray[np.float64]:
    """Boxes, each a list of pairs of numbers, the first of a pair the lower."""
    shape = f"give a list of boxes, each of {cubes} pairs of finite numbers [low, high]"
    if type(value) is not list or not all(_is_list(box, cubes) for box in value):
        raise InputError(f"{where} is of another shape; {shape}")
    pairs = list(chain.from_iterable(value))
    if not all(_is_list(pair, 2) for pair in pairs):
        raise InputError(f"{where} is of another shape; {shape}")
    numbers = list(chain.from_iterable(pairs))
    if not {*map(type, numbers)} <= {int, float}:
        raise InputError(f"{where} holds something else than numbers; {shape}")
    boxes = np.array(numbers, np.float64).reshape(len(value), cubes, 2)
    if not np.isfinite(boxes).all():
        raise InputError(f"{where} holds a number that is not finite; {shape}")
    size = abs(boxes)
    if ((size < LEAST_BORDER) & (size > 0)).any() or (size > MOST_BORDER).any():
        raise InputError(
            f"{where} has a border below {LEAST_BORDER:.1g} m or above {MOST_BORDER:.1g} m; {shape}"
        )
    empty = np.flatnonzero((boxes[..., 0] >= boxes[..., 1]).any(1))
    if len(empty):
        raise InputError(f"{where}[{empty[0]}] is empty; {shape}, low below high")
    return boxes


def _is_list(value: Any, length: int) -> bool:
    return type(value) is list and len(value) == length


def fingerprint(weights: Mapping[str, torch.Tensor]) -> str:
    """The hash (SHA-256) of a network's weights, as certificates have it.

    Args:
        weights: A state dict; its order and device don't matter.
    """
    digest = hashlib.sha256()
    for name in sorted(weights):
        value = weights[name].detach().cpu().contiguous()
        digest.update(f"{name} {list(value.shape)}\n".encode())
        digest.update(value.numpy().astype("<f4").tobytes())
    return digest.hexdigest()


def refuse_another(
    certificate: Certificate,
    described: PolicyDescription,
    weights: Mapping[str, torch.Tensor],
    task: BaseTaskSettings | None = None,
) -> None:
    """Makes sure that a certificate is of this policy, and that it can be.

    Args:
        certificate: Which.
        described: The policy's description; its task doesn't count.
        weights: Of its network.
        task: That it must be stated of; any by default.

    Raises:
        InputError: It is of another network, camera or task, or the policy remembers pictures, or
            its camera goes wrong.
    """
    for of in (certificate.description, described):
        require_moves(of.dynamics, of.actions, "what a certificate states")
    if certificate.weights != (own := fingerprint(weights)):
        raise InputError(
            f"the certificate is of a network with the hash {certificate.weights[:12]}..., the "
            f"policy's has {own[:12]}...; give policy= the file that was proved"
        )
    stated, own_parts = certificate.description.as_dict(), described.as_dict()
    for part in ("appearance", "dynamics", "actions", "camera", "transforms", "network"):
        if stated.get(part) != own_parts.get(part):
            raise InputError(
                f"the certificate and the policy differ in {part}; give policy= the file that was "
                "proved"
            )
    if task is not None and certificate.task != task:
        name = next(n for n, v in task.values().items() if certificate.task.values()[n] != v)
        raise InputError(
            f"the certificate is of another task: {name}={getattr(certificate.task, name)}, not "
            f"{getattr(task, name)}; prove the policy in that task"
        )
    if any(choice.name == "stack" for choice in described.transforms):
        raise InputError(
            "the policy remembers pictures (transform stack); certificates are of policies that "
            "act by the present picture alone"
        )
    if described.faults:
        raise InputError(
            f"the policy's camera goes wrong (transform {described.faults[0]}); certificates are "
            "of pictures as they are drawn"
        )
