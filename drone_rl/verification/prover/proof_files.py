"""Files of a proof (`drone-rl prove`): the certificate, and the state from which a proof resumes.

A certificate can be checked without this program: the boxes of all outcomes and the undecided ones
partition the placements, and every episode from a box must end as stated.
"""

import dataclasses
import io
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.archives import check_indices, read_arrays
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_atomically
from drone_rl.utils.limits import ARRAYS_BYTES
from drone_rl.verification.prover.boxes import Boxes, volumes
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Ending, LatticeState
from drone_rl.verification.prover.prover import ProofFindings, Prover, combine

FORMAT = "drone_rl certificate"
FORMAT_VERSION = 1
_COUNTS = ("num_states", "num_images", "most_boxes", "least_gap", "largest_band", "decided")
_BOX_SETS = ("waiting", "ended", "ways", "forked", "parts", "part", "done", "undecided")
"""Names in files, a part of their format."""
_DAMAGE = (ValueError, TypeError, LookupError, ArithmeticError, AttributeError)  # of damaged files
_MAX_INTEGER = 2**40  # in a row
_UNKNOWN = (-1, 0, 0)  # row of an unknown ending

_Row = tuple[int, ...]  # a lattice state or an ending as integers; empty for neither
_BoxSet = list[tuple[_Row, Boxes]]  # boxes by lattice state or ending


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
    done = prover.done
    sets: dict[str, _BoxSet] = {
        "waiting": [
            ((*dataclasses.astuple(state), prover.longest.get(state, 0)), boxes)
            for state, known in prover.waiting.items()
            for boxes in known
        ],
        "ended": [
            ((*_row(ending), steps), boxes)
            for (ending, steps), known in prover.ended.items()
            for boxes in known
        ],
        "ways": [(_row(end), boxes) for end, known in prover.fork_ends.items() for boxes in known],
        "forked": [((), boxes) for boxes in prover.forked],
        "parts": [((), prover.parts)],
        "part": [((), prover.part)],
        "done": [(_row(ending), boxes) for ending, boxes in done.endings.items()],
        "undecided": [((), done.undecided)],
    }
    volumes_of = [
        ((*_row(ending), steps), volume)
        for ending, known in done.steps.items()
        for steps, volume in known.items()
    ]
    arrays: dict[str, Any] = {
        "subject": np.frombuffer(proof_id.encode(), np.uint8),
        "counts": np.array([getattr(prover, name) for name in _COUNTS], np.float64),
    }
    for name, parts in sets.items():
        arrays |= _packed(name, parts)
    rows = [row for row, _ in volumes_of]
    arrays["steps_rows"] = np.array(rows, np.int64).reshape(len(rows), 4)
    arrays["steps_volumes"] = np.array([volume for _, volume in volumes_of], np.float64)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    write_atomically(path, buffer.getvalue())


def load(prover: Prover, path: Path, proof_id: str, most: int = ARRAYS_BYTES) -> None:
    """Resume a new proof from a state of at most `most` bytes.

    Raises:
        InputError: The file is damaged or of another proof; the proof is unchanged.
    """
    try:
        state = read_arrays(path, most=most)
        saved = state["subject"].tobytes().decode()
        counts = {
            name: type(getattr(prover, name))(count)
            for name, count in zip(_COUNTS, state["counts"].tolist(), strict=True)
        }
        shape = prover.parts.shape[1:]
        sets = {name: _unpacked(name, state, shape) for name in _BOX_SETS}
        waiting = [(*_lattice_state(row), b) for row, b in sets["waiting"]]
        ended = [((_ending(row), row[3]), b) for row, b in sets["ended"]]
        forks = [(None if row == _UNKNOWN else _ending(row), b) for row, b in sets["ways"]]
        forked = [boxes for _, boxes in sets["forked"]]
        ((_, parts),), ((_, part),) = sets["parts"], sets["part"]
        ((_, undecided),) = sets["undecided"]
        _check(part, waiting, [*ended, *forks, *forked])
        done = [ProofFindings({_ending(row): b}, undecided[:0], {}) for row, b in sets["done"]]
        done = combine([ProofFindings({}, undecided, _steps(state)), *done])
    except _DAMAGE as error:
        raise InputError(
            f"{path} is not a saved proof state ({error}); delete it to start again"
        ) from None
    if saved != proof_id:
        raise InputError(f"{path} belongs to another proof; delete it, or give another folder")
    prover.waiting.clear()
    prover.boxes_under_way = 0
    for waited, longest, boxes in waiting:
        prover.wait(waited, boxes)
        if waited.is_fork:
            prover.longest[waited] = longest
    for key, boxes in ended:
        prover.ended[key].append(boxes)
    for ending, boxes in forks:
        prover.fork_ends[ending].append(boxes)
    prover.forked, prover.parts, prover.part, prover.done = forked, parts, part, done
    for name, count in counts.items():
        setattr(prover, name, count)


def _check(part: Boxes, waiting: Sequence, known: Sequence) -> None:
    """Check that lattice states wait only while a part of the placements is in progress."""
    if len(part) != bool(waiting) or (known and not waiting):
        raise ValueError(f"{len(part)} parts in progress, {len(waiting)} states waiting")


def _lattice_state(row: _Row) -> tuple[LatticeState, int]:
    ahead, left, collected, steps, came, is_fork, longest = row
    if came not in (AHEAD, LEFT, RIGHT):
        raise ValueError(f"a state was reached by action {came}")
    return LatticeState(ahead, left, collected, steps, came, bool(is_fork)), longest


def _row(ending: Ending | None) -> tuple[int, int, int]:
    if ending is None:
        return _UNKNOWN
    return int(ending.reason), ending.collected, int(ending.loops)


def _ending(row: _Row) -> Ending:
    return Ending(EndReason(row[0]), row[1], bool(row[2]))


def _steps(state: dict[str, NDArray]) -> dict[Ending, dict[int, float]]:
    rows, volumes = state["steps_rows"], state["steps_volumes"]
    if rows.shape != (*volumes.shape, 4) or not np.isfinite(volumes).all():
        raise ValueError(f"steps are {volumes.dtype} of shape {rows.shape}")
    steps: dict[Ending, dict[int, float]] = defaultdict(dict)
    for row, volume in zip(rows.tolist(), volumes.tolist(), strict=True):
        steps[_ending(row)][row[3]] = volume
    return dict(steps)


def _packed(name: str, parts: Sequence[tuple[_Row, Boxes]]) -> dict[str, NDArray]:
    rows, boxes = [row for row, _ in parts], [b for _, b in parts]
    return {
        f"{name}_rows": np.array(rows, np.int64).reshape(len(rows), -1 if rows and rows[0] else 0),
        f"{name}_counts": np.array([len(b) for b in boxes], np.int64),
        f"{name}_boxes": np.concatenate(boxes) if boxes else np.empty((0, 0, 2)),
    }


def _unpacked(name: str, state: dict[str, NDArray], shape: tuple[int, ...]) -> _BoxSet:
    rows, counts, boxes = (state[f"{name}_{part}"] for part in ("rows", "counts", "boxes"))
    if not len(counts):
        return []
    check_indices(counts, 1 + len(boxes), f"{name}_counts")
    check_indices(abs(rows), _MAX_INTEGER, f"{name}_rows")
    is_sound = boxes.dtype == np.float64 and bool(np.isfinite(boxes).all())
    if boxes.shape != (counts.sum(), *shape) or not is_sound:
        raise ValueError(f"{name} are {boxes.dtype} of shape {boxes.shape}")
    parts = np.split(boxes, np.cumsum(counts)[:-1])
    return [(tuple(row), b) for row, b in zip(rows.tolist(), parts, strict=True)]
