"""Read `shifts.json`, and check that it is of the given policy.

Whether the episodes were run cannot be checked. `drone_rl.trust.coverage` re-runs a sample.
"""

import datetime
from collections.abc import Mapping
from pathlib import Path

import torch

from drone_rl.policies.zoo import PolicyDescription, fingerprint
from drone_rl.sim.tasks import as_task
from drone_rl.trust.shifts_results import Robustness, SavedShifts
from drone_rl.utils.errors import InputError
from drone_rl.utils.limits import SHIFTS_BYTES

_PARTS = ("task", "appearance", "dynamics", "actions", "camera", "transforms", "network")


def read_shifts(
    path: Path, described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> SavedShifts:
    """Read the robustness evaluation of a policy in its task from a JSON file.

    Raises:
        InputError: It is missing, damaged, or of another network, camera or task.
    """
    try:
        shifts = Robustness.read_json(path, SHIFTS_BYTES)
        _refuse_another(shifts, described, weights)
        size = (described.camera.height, described.camera.width)
        terms = as_task(described.task.parameters).vocabulary  # the file's own could say anything
        shifts = shifts.replace(terms=terms, image_size=size)
        for name in shifts.axes:
            shifts.frames(name)
    except InputError as error:
        raise InputError(f"shifts {path} can't be used: {error}") from None
    when = datetime.datetime.fromtimestamp(path.stat().st_mtime).strftime("%Y-%m-%d %H:%M")
    return SavedShifts(path=str(path), dated=when, shifts=shifts)


def _refuse_another(
    shifts: Robustness, described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> None:
    if shifts.network is None:
        raise InputError("it is of a third-party policy")
    stated, actual = shifts.network.weights, fingerprint(weights)
    if stated != actual:
        raise InputError(
            f"it is for a network with hash {stated[:12]}..., but the policy's has {actual[:12]}..."
        )
    of = PolicyDescription.read(shifts.network.description)
    for part in _PARTS:
        if getattr(of, part) != getattr(described, part):
            raise InputError(f"it is of another {part} than the policy's")
