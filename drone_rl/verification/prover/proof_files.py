"""Files of a proof: its certificate, and the state from which it resumes."""

import io
import pickle
from pathlib import Path

import numpy as np
import torch

from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_atomically
from drone_rl.utils.provenance import provenance
from drone_rl.verification.checker.certificate import (
    Certificate,
    Effort,
    Outcome,
    Region,
    Stated,
    Subject,
)
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import Ending, LatticeState
from drone_rl.verification.prover.prover import ProofFindings, Prover

_MAX_STATE_BYTES = 2**33
_STATE = (
    *("parts", "part", "done", "waiting", "ended", "forked", "longest", "fork_ends"),
    *("boxes_under_way", "num_states", "num_images", "most_boxes", "decided"),
    *("least_gap", "largest_band"),
)
"""Attributes of `Prover` that a state holds."""
_array_maker = np.empty(0).__reduce__()[0]
_CLASSES = [
    *(LatticeState, Ending, CubesEnd, ProofFindings),
    *(list, float, bytes, np.ndarray, np.dtype, type(np.dtype(float)), _array_maker),
]
"""What a state may be built from."""
_DAMAGE = (RuntimeError, pickle.UnpicklingError, EOFError, LookupError, TypeError)
"""Errors of `torch.load` and of a file that holds something else."""


def certify(
    name: str,
    description: PolicyDescription,
    weights: str,
    prover: Prover,
    seconds: float,
    stopped_by: str | None = None,
) -> Certificate:
    """Return the certificate of what is known so far.

    `description` has the task of the proof, `weights` is the SHA-256 hash of the network's weights,
    `seconds` the time since the proof was started or resumed, and `stopped_by` the setting that
    stopped it early.
    """
    findings, task = prover.findings(), prover.lattice.task
    total = (2 * task.lateral_bound) ** task.num_cubes

    def share(volume: float) -> float:
        return min(1.0, float(volume) / total)  # sums of volumes are rounded

    outcomes = [
        Outcome.read(
            {
                "end": ending.reason.name.lower(),
                "collected": [bool(ending.collected >> k & 1) for k in range(task.num_cubes)],
                "loops": ending.loops,
                "share": share(volumes(boxes).sum()),
                "steps": {k: share(v) for k, v in sorted(findings.steps.get(ending, {}).items())},
                "boxes": boxes,
            }
        )
        for ending, boxes in sorted(findings.endings.items())
        if len(boxes)
    ]
    undecided = findings.undecided
    return Certificate(
        policy=Subject(name=name, weights=weights, description=description),
        outcomes=tuple(outcomes),
        undecided=Region(share=share(volumes(undecided).sum()), boxes=undecided),
        finished=prover.is_finished,
        stated=Stated(
            logit_gap=prover.spec.bounds.gap,
            largest_band=prover.largest_band,
            renderer=type(prover.spec.worlds.renderer).__name__,
        ),
        found=Effort(
            least_gap=prover.least_gap if prover.least_gap < float("inf") else None,
            pictures=prover.num_images,
            states=prover.num_states,
            most_boxes=prover.most_boxes,
            seconds=seconds,
            stopped_by=stopped_by,
        ),
        **provenance(),
    )


def save(prover: Prover, path: Path, proof_id: str) -> None:
    """Write a proof's state atomically; `proof_id` identifies what is proved."""
    buffer = io.BytesIO()
    torch.save({"proof_id": proof_id} | {name: getattr(prover, name) for name in _STATE}, buffer)
    write_atomically(path, buffer.getvalue())


def load(prover: Prover, path: Path, proof_id: str) -> None:
    """Resume a new proof from a saved state.

    Raises:
        InputError: The file is damaged or of another proof.
    """
    content = read_bytes(path, _MAX_STATE_BYTES)
    try:
        with torch.serialization.safe_globals(_CLASSES):
            state = torch.load(io.BytesIO(content), weights_only=True)
        is_same, values = state["proof_id"] == proof_id, {name: state[name] for name in _STATE}
    except _DAMAGE:
        raise InputError(
            f"{path} is damaged, or of an older version of drone_rl; delete it to start again"
        ) from None
    if not is_same:
        raise InputError(f"{path} belongs to another proof; delete it, or give another folder")
    vars(prover).update(values)
