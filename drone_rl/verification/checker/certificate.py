"""Certificates: files of bounded size, whose content is checked before use."""

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field, PlainSerializer, PlainValidator, model_validator

from drone_rl.config import BaseTaskSettings, TaskSettings
from drone_rl.policies.zoo import PolicyDescription, fingerprint
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import as_path
from drone_rl.utils.limits import CERTIFICATE_BYTES
from drone_rl.utils.models import Model
from drone_rl.utils.provenance import Provenance
from drone_rl.verification.requirements import require_cubes

MAX_CORNERS = 2**20  # corners of all boxes together
MAX_CUBES = 8
MAX_STEPS = 20_000  # step counts of all outcomes together
MIN_BORDER = 2.0**-100  # metres. Smallest nonzero |border|; bounds the bits of exact sums.
MAX_BORDER = 2.0**20  # metres. Largest |border|


def _as_array(value: Any) -> NDArray[np.float64]:
    try:
        return np.array(value)
    except ValueError:  # of lists of different lengths
        return np.array("")


Share = Annotated[float, Field(ge=0.0, le=1.0)]
"""Fraction of the volume of all placements."""


class Region(Model):
    """Placements of the cubes."""

    share: Share
    """Their fraction of the volume of all placements."""
    boxes: Annotated[
        NDArray[np.float64],
        PlainValidator(_as_array),
        PlainSerializer(np.ndarray.tolist, return_type=list),
    ]
    """Metres to the left of each cube, lowest and highest. Shape: (boxes, cubes, 2)."""

    @model_validator(mode="after")
    def _check_boxes(self) -> Self:
        boxes = self.boxes
        if boxes.size == 0:
            return self
        if boxes.dtype.kind not in "if" or boxes.ndim != 3 or boxes.shape[2] != 2:
            raise InputError("boxes must be a list of boxes, each of a pair of numbers per cube")
        size = abs(boxes)
        if not ((size == 0) | (size >= MIN_BORDER) & (size <= MAX_BORDER)).all():
            raise InputError(
                f"boxes must have borders from {MIN_BORDER:.1g} to {MAX_BORDER:.1g} m, or of 0"
            )
        if not (boxes[..., 0] < boxes[..., 1]).all():
            raise InputError("boxes must have lower borders below their upper borders")
        return self


class Outcome(Region):
    """One outcome of episodes, and the placements that lead to it."""

    end: Literal["all_cubes", "front_boundary", "side_boundary", "step_limit"]
    """Why the episodes end."""
    collected: tuple[bool, ...]
    """Whether each cube is collected by then."""
    loops: bool
    """Whether the drone oscillates until the step limit."""
    steps: dict[Annotated[int, Field(gt=0)], Annotated[float, Field(gt=0.0, le=1.0)]]
    """Fraction by number of steps; they may sum to less than `share`."""

    def __str__(self) -> str:
        return ending_text(self.end, self.collected, self.loops)

    @property
    def is_success(self) -> bool:
        """Whether all cubes are collected."""
        return self.end == "all_cubes"


class Subject(Model):
    """The policy of a certificate."""

    name: Annotated[str, Field(max_length=200)]
    """Its name, for display."""
    weights: Annotated[str, Field(max_length=64)]
    """Hash of its weights, see `fingerprint`."""
    description: PolicyDescription
    """Its description, with the task of the certificate."""


class Stated(Model):
    """What a certificate holds for."""

    logit_gap: float
    """An action is certain if its logit leads by more than this."""
    largest_band: float
    """Width of the widest band of uncertain images around a border, metres."""
    renderer: str


class Effort(Model):
    """What a proof took."""

    least_gap: float | None
    """Smallest gap of the two highest logits among the images that were evaluated singly."""
    pictures: int
    """Number of evaluated images."""
    states: int
    """Visited states of the drone."""
    most_boxes: int
    """Most boxes in one of them."""
    seconds: float
    """Duration since the proof was started or resumed."""
    stopped_by: str | None = None
    """The setting that stopped the proof early."""


class Certificate(Provenance, extra="forbid"):
    """Statements about a policy in a task.

    It can be checked without the prover: the boxes of all outcomes and the undecided ones partition
    the placements, and every episode from a box must end as stated.
    """

    format: Literal["drone_rl certificate"] = "drone_rl certificate"
    format_version: Literal[1] = 1
    policy: Subject
    outcomes: tuple[Outcome, ...]
    undecided: Region
    """Placements without a statement."""
    finished: bool
    """Whether the proof was completed."""
    stated: Stated
    found: Effort

    @model_validator(mode="after")
    def _check(self) -> Self:
        task = self.task
        if task.vertical_bound != 0 or task.lateral_bound == 0:
            raise InputError(
                f"its task has vertical_bound={task.vertical_bound} and lateral_bound="
                f"{task.lateral_bound}; certificates require vertical_bound=0 and lateral_bound "
                "above 0"
            )
        cubes = task.num_cubes
        if cubes > MAX_CUBES:
            raise InputError(f"num_cubes={cubes} is out of range; give at most {MAX_CUBES}")
        shapes = {r.boxes.shape[1] for r in (*self.outcomes, self.undecided) if r.boxes.size}
        if not shapes | {len(outcome.collected) for outcome in self.outcomes} <= {cubes}:
            raise InputError(f"outcomes must have {cubes} cubes, as its task")
        if (steps := sum(len(outcome.steps) for outcome in self.outcomes)) > MAX_STEPS:
            raise InputError(f"it has {steps} step counts; give at most {MAX_STEPS}")
        if (count := sum(map(len, self.groups))) > (most := MAX_CORNERS >> cubes):
            raise InputError(f"it has {count} boxes; give at most {most} for {cubes} cubes")
        return self

    @functools.cached_property
    def task(self) -> TaskSettings:
        """The task of the certificate."""
        return require_cubes(self.policy.description, "certificates")

    @property
    def groups(self) -> list[NDArray[np.float64]]:
        """The boxes of each outcome, then the undecided ones. Shapes: (boxes, cubes, 2)."""
        regions = (*self.outcomes, self.undecided)
        return [region.boxes.reshape(-1, self.task.num_cubes, 2) for region in regions]

    @property
    def success(self) -> float:
        """Fraction of all placements from which all cubes are certainly collected."""
        return self._share_of(is_success=True)

    @property
    def lost(self) -> float:
        """Fraction of all placements from which they certainly are not."""
        return self._share_of(is_success=False)

    @property
    def is_full_success(self) -> bool:
        """Whether it states success from every placement."""
        return self._is_everything(is_success=True)

    def _share_of(self, *, is_success: bool) -> float:
        share = sum(o.share for o in self.outcomes if o.is_success == is_success)  # rounded
        return min(share, 1.0 if self._is_everything(is_success=is_success) else 1 - 2.0**-53)

    def _is_everything(self, *, is_success: bool) -> bool:
        kinds = {outcome.is_success for outcome in self.outcomes}
        return kinds == {is_success} and not len(self.undecided.boxes)


def ending_text(end: str, collected: Sequence[bool], loops: bool) -> str:
    """Return the end of an episode in words."""
    which = ", ".join(str(i + 1) for i, is_collected in enumerate(collected) if is_collected)
    return f"{end}{', to and fro' if loops else ''}, cubes collected: {which or 'none'}"


def certificate_file(path: str | Path) -> Path:
    """Return the file of a certificate: a path, or certificate.json in a folder."""
    path = as_path(path, "certificate")
    return path / "certificate.json" if path.is_dir() else path


def read_certificate(path: Path) -> Certificate:
    """Read a certificate from `certificate.json` of `drone-rl prove`.

    Raises:
        InputError: The file is missing, too large, damaged or not a certificate.
    """
    try:
        return Certificate.read_json(path, CERTIFICATE_BYTES)
    except InputError as error:
        raise InputError(f"certificate {path} can't be used: {error}") from None


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
    if certificate.policy.weights != (policy_hash := fingerprint(weights)):
        raise InputError(
            f"the certificate is for a network with hash {certificate.policy.weights[:12]}..., but "
            f"the policy's has {policy_hash[:12]}...; set policy to the file that was proved"
        )
    stated = certificate.policy.description
    for part in ("appearance", "dynamics", "actions", "camera", "transforms", "network"):
        if getattr(stated, part) != getattr(described, part):
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
