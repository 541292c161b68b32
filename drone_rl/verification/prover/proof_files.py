"""Files of a proof (`drone-rl prove`): the certificate, and the state from which a proof resumes.

A certificate can be checked without this program: the boxes of all outcomes and the undecided ones
partition the placements, and every episode from a box must end as stated.
"""

import dataclasses
import io
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_atomically
from drone_rl.verification.prover.boxes import Boxes, volumes
from drone_rl.verification.prover.lattice import Ending, LatticeState
from drone_rl.verification.prover.prover import ProofFindings, Prover

FORMAT = "drone_rl certificate"
FORMAT_VERSION = 1
_COUNTS = ("num_states", "num_images", "most_boxes", "least_gap", "largest_band", "decided")
_MAX_STATE_BYTES = 2**33
_DAMAGE = (RuntimeError, pickle.UnpicklingError, EOFError, LookupError, TypeError)
"""Errors of `torch.load` and of a file that holds something else."""
_Row = tuple[int, int, bool]  # an ending as plain values


def certify(
    name: str,
    description: PolicyDescription,
    weights: str,
    prover: Prover,
    seconds: float,
    stopped_by: str | None = None,
) -> dict[str, Any]:
    """Return the certificate of what is known so far, as plain data.

    `description` has the task of the proof, `weights` is the SHA-256 hash of the network's weights,
    `seconds` the time since the proof was started or resumed, and `stopped_by` the setting that
    stopped it early.
    """
    findings, task = prover.findings(), prover.lattice.task
    total = (2 * task.lateral_bound) ** task.num_cubes

    def share(volume: float) -> float:
        return min(1.0, float(volume) / total)  # sums of volumes are rounded

    outcomes = [
        {
            "end": ending.reason.name.lower(),
            "collected": [bool(ending.collected >> k & 1) for k in range(task.num_cubes)],
            "loops": ending.loops,
            "share": share(volumes(boxes).sum()),
            "steps": {str(k): share(v) for k, v in sorted(findings.steps.get(ending, {}).items())},
            "boxes": boxes.tolist(),
        }
        for ending, boxes in sorted(findings.endings.items())
        if len(boxes)
    ]
    undecided = findings.undecided
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "policy": {"name": name, "weights": weights, "description": description.as_dict()},
        "outcomes": outcomes,
        "undecided": {"share": share(volumes(undecided).sum()), "boxes": undecided.tolist()},
        "finished": prover.is_finished,
        "stated": {
            "logit_gap": prover.spec.bounds.gap,
            "largest_band": prover.largest_band,
            "renderer": type(prover.spec.worlds.renderer).__name__,
        },
        "found": {
            "least_gap": prover.least_gap if prover.least_gap < float("inf") else None,
            "pictures": prover.num_images,
            "states": prover.num_states,
            "most_boxes": prover.most_boxes,
            "seconds": seconds,
            "stopped_by": stopped_by,
        },
    }


def save(prover: Prover, path: Path, proof_id: str) -> None:
    """Write a proof's state atomically; `proof_id` identifies what is proved."""
    nothing, done = prover.part[:0], prover.done
    state = {
        "proof_id": proof_id,
        "counts": {name: getattr(prover, name) for name in _COUNTS},
        "waiting": {
            (*dataclasses.astuple(state), prover.longest.get(state, 0)): _joined(boxes)
            for state, boxes in prover.waiting.items()
        },
        "ended": {
            (_row(ending), steps): _joined(boxes) for (ending, steps), boxes in prover.ended.items()
        },
        "fork_ends": {_row(ending): _joined(boxes) for ending, boxes in prover.fork_ends.items()},
        "forked": _joined([nothing, *prover.forked]),
        "parts": _joined([prover.parts]),
        "part": _joined([prover.part]),
        "done": {_row(ending): _joined([boxes]) for ending, boxes in done.endings.items()},
        "undecided": _joined([done.undecided]),
        "steps": {_row(ending): dict(volume) for ending, volume in done.steps.items()},
    }
    buffer = io.BytesIO()
    torch.save(state, buffer)
    write_atomically(path, buffer.getvalue())


def load(prover: Prover, path: Path, proof_id: str) -> None:
    """Resume a new proof from a saved state.

    Raises:
        InputError: The file is damaged or of another proof.
    """
    content = read_bytes(path, _MAX_STATE_BYTES)
    try:
        state = torch.load(io.BytesIO(content), weights_only=True)
        is_same = state["proof_id"] == proof_id
    except _DAMAGE as error:
        raise InputError(
            f"{path} is not a saved proof state ({error}); delete it to start again"
        ) from None
    if not is_same:
        raise InputError(f"{path} belongs to another proof; delete it, or give another folder")
    for name, count in state["counts"].items():
        setattr(prover, name, count)
    for (*fields, longest), boxes in state["waiting"].items():
        waiting = LatticeState(*fields)
        prover.wait(waiting, boxes.numpy())
        if waiting.is_fork:
            prover.longest[waiting] = longest
    for (row, steps), boxes in state["ended"].items():
        prover.ended[_ending(row), steps].append(boxes.numpy())
    for row, boxes in state["fork_ends"].items():
        prover.fork_ends[row and _ending(row)].append(boxes.numpy())
    prover.forked = [state["forked"].numpy()]
    prover.parts, prover.part = state["parts"].numpy(), state["part"].numpy()
    prover.done = ProofFindings(
        {_ending(row): boxes.numpy() for row, boxes in state["done"].items()},
        state["undecided"].numpy(),
        {_ending(row): volume for row, volume in state["steps"].items()},
    )


def _joined(boxes: Sequence[Boxes]) -> Tensor:
    return torch.from_numpy(np.concatenate(boxes))


def _row(ending: Ending | None) -> _Row | None:
    return None if ending is None else (int(ending.reason), ending.collected, ending.loops)


def _ending(row: _Row) -> Ending:
    return Ending(CubesEnd(row[0]), *row[1:])
