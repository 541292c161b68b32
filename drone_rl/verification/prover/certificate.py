"""A proof as plain data: how every placement of the cubes ends, box by box.

Whoever gets one can check it without this program: the boxes of all outcomes and of what is
undecided are a partition of the placements, so that they are disjoint and their volumes add up, and
in each box every flight must end as it says.
"""

import hashlib
from collections.abc import Mapping
from typing import Any

from torch import Tensor

from drone_rl.policies.zoo import PolicyDescription
from drone_rl.verification.prover.boxes import Boxes, volumes
from drone_rl.verification.prover.findings import Findings
from drone_rl.verification.prover.lattice import Ending
from drone_rl.verification.prover.prover import Prover

FORMAT = "drone_rl certificate"
FORMAT_VERSION = 1


def weights_hash(weights: Mapping[str, Tensor]) -> str:
    """SHA-256 of a network's weights, whatever file they come from.

    Args:
        weights: Its state, by name.
    """
    digest = hashlib.sha256()
    for name in sorted(weights):
        value = weights[name].detach().cpu().float().contiguous()
        digest.update(f"{name} {list(value.shape)}\n".encode())
        digest.update(value.numpy().astype("<f4").tobytes())
    return digest.hexdigest()


def certify(
    name: str,
    description: PolicyDescription,
    weights: str,
    prover: Prover,
    seconds: float,
    stopped_by: str | None = None,
) -> dict[str, Any]:
    """What is known by now, as plain data.

    Args:
        name: Of the policy, for people.
        description: Of the policy, in the task of the proof.
        weights: See `weights_hash`.
        prover: The proof.
        seconds: That it took.
        stopped_by: The setting that stopped it before its end.
    """
    findings = prover.findings()
    task = prover.lattice.task
    total = (2 * task.lateral_bound) ** task.num_cubes
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "policy": {"name": name, "weights": weights, "description": description.as_dict()},
        "outcomes": [
            _outcome(ending, boxes, findings, task.num_cubes, total)
            for ending, boxes in sorted(findings.endings.items())
            if len(boxes)
        ],
        "undecided": {
            "share": float(volumes(findings.undecided).sum()) / total,
            "boxes": findings.undecided.tolist(),
        },
        "finished": prover.is_finished,
        "stated": {
            "logit_gap": prover.gap,
            "largest_band": prover.largest_band,
            "renderer": prover.renderer,
        },
        "found": {
            "least_gap": prover.least_gap if prover.least_gap < float("inf") else None,
            "pictures": prover.pictures,
            "states": prover.num_places,
            "most_boxes": prover.most_boxes,
            "seconds": seconds,
            "stopped_by": stopped_by,
        },
    }


def _outcome(
    ending: Ending, boxes: Boxes, findings: Findings, num_cubes: int, total: float
) -> dict[str, Any]:
    return {
        "end": ending.reason.name.lower(),
        "collected": [bool(ending.collected >> k & 1) for k in range(num_cubes)],
        "loops": ending.loops,
        "share": float(volumes(boxes).sum()) / total,
        "steps": {str(k): v / total for k, v in sorted(findings.steps.get(ending, {}).items())},
        "boxes": boxes.tolist(),
    }
