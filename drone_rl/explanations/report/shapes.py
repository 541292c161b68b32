"""How large the parts of an explanation may be that a report renders, and which types they have."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError
from drone_rl.utils.limits import check_indices

_SIDE = 512
"""Pixels of an image, each way."""
_ACTIONS = 16
_MANY = 100_000
_INTEGER, _FLOAT, _BOOL, _PIXEL = "iu", "f", "b", "u"
_ARRAYS: Mapping[str, tuple[str, tuple[int, ...], int]] = {
    "film_frames": (_PIXEL, (2000, _SIDE, _SIDE, 3), 2**23),
    "film_heat": (_FLOAT, (2000, _SIDE, _SIDE), 2**23),
    "film_probabilities": (_FLOAT, (2000, _ACTIONS), 2**20),
    "film_actions": (_INTEGER, (2000,), 2**20),
    "class_model_(probability|logit)": (_FLOAT, (_ACTIONS, 64, _SIDE, _SIDE), 2**25),
    "tsne_(features|pixels)": (_FLOAT, (_MANY, 2), 2**21),
    "places_points": (_FLOAT, (2**16, 2), 2**20),
    "places_(ends|labels)": (_INTEGER, (2**13,), 2**17),
    "response_height": (_FLOAT, (32,), 2**12),
    "(response|outcome)_(forward|lateral)": (_FLOAT, (_SIDE,), 2**12),
    "response_probabilities": (_FLOAT, (32, _SIDE, _SIDE, _ACTIONS), 2**20),
    "response_blind": (_BOOL, (32, _SIDE, _SIDE), 2**18),
    "response_without_target": (_FLOAT, (_ACTIONS,), 2**12),
    "(response|outcome)_(oracle|stratum)": (_INTEGER, (_SIDE,), 2**12),
    "outcome_height": (_FLOAT, (32,), 2**12),
    "outcome_collected": (_BOOL, (32, _SIDE, _SIDE), 2**18),
    "interventions": (_PIXEL, (32, _SIDE, _SIDE, 3), 2**23),
    "patch_effects": (_FLOAT, (_SIDE, _SIDE), 2**20),
    "shifts_[a-z_]+": (_PIXEL, (8, _SIDE, _SIDE, 3), 2**22),
}
"""Of `arrays.npz` by name: kind of type, the greatest shape, and the most bytes."""
_DATA: Mapping[str, tuple[str, tuple[int, ...], int]] = {
    "frames": (_PIXEL, (_MANY, _SIDE, _SIDE, 3), 2**27),
    "probabilities": (_FLOAT, (_MANY, _ACTIONS), 2**23),
    "(actions|episode|step|event)": (_INTEGER, (_MANY,), 2**20),
    "flights/episode": (_INTEGER, (10 * _MANY,), 2**23),
}
"""The same of `dataset.npz`."""
_LENGTHS: Mapping[tuple[str, ...], int] = {
    ("attribution", "film", "key_steps"): 12,
    ("truth", "methods"): 16,
    ("truth", "placebos"): 32,
    ("truth", "heat"): 16,
    ("truth", "curves"): 64,
    ("truth", "interventions"): 32,
    ("shifts", "axes"): 64,
}
"""Of `explanation.json`: entries of the lists and mappings that figures show one by one."""
_INDICES = {"actions": _ACTIONS, "film_actions": _ACTIONS, "episode": _MANY, "step": 10**7}
"""Arrays of whole numbers that are used as indices, and the first one that is too high."""
_FINITE = {
    *("tsne_features", "tsne_pixels", "places_points", "response_height", "outcome_height"),
    *("response_forward", "response_lateral", "outcome_forward", "outcome_lateral"),
}
"""Arrays of places, which are numbers."""
_LONGEST = 2000
"""Entries of any other list or mapping in it."""


def check_sizes(
    numbers: Mapping[str, Any], arrays: Mapping[str, NDArray], data: Mapping[str, NDArray]
) -> None:
    """Refuses an explanation with a part that is too large to render, or of another type.

    Args:
        numbers: `explanation.json`.
        arrays: `arrays.npz`.
        data: `dataset.npz`.

    Raises:
        InputError: There is one; it is named.
    """
    _check_shown(numbers)
    _check_lengths(numbers)
    _check_arrays(arrays, _ARRAYS)
    _check_arrays(data, _DATA)
    known = {**arrays, **data}
    for name in _FINITE & known.keys():
        if not np.isfinite(known[name]).all():
            raise InputError(f"{name} holds NaN or infinity")
    if "places_ends" in arrays:
        ends = arrays["places_ends"]
        check_indices(ends, 1 + len(arrays.get("places_points", ())), "places_ends")
        if (np.diff(ends) < 0).any():
            raise InputError("places_ends go down")
    flown = len(data.get("flights/episode", ()))  # an episode has a step at least
    for name, most in {**_INDICES, "flights/episode": max(1, flown)}.items():
        if name in known:
            check_indices(known[name], most, name)


def _check_shown(numbers: Mapping[str, Any]) -> None:
    for keys, most in _LENGTHS.items():
        part: Any = numbers
        for key in keys:
            part = part.get(key) if isinstance(part, Mapping) else None
        if isinstance(part, list | Mapping) and len(part) > most:
            raise InputError(f"{'.'.join(keys)} has {len(part)} entries; give at most {most}")


def _check_lengths(value: Any) -> None:
    level = [value]
    while level:
        for item in level:
            if len(item) > _LONGEST:
                raise InputError(f"it holds a list of {len(item)}; give at most {_LONGEST}")
        inner = [v for item in level for v in (item.values() if isinstance(item, dict) else item)]
        level = [v for v in inner if isinstance(v, dict | list)]


def _check_arrays(
    arrays: Mapping[str, NDArray], known: Mapping[str, tuple[str, tuple[int, ...], int]]
) -> None:
    if len(arrays) > _LONGEST:
        raise InputError(f"it holds {len(arrays)} arrays; give at most {_LONGEST}")
    for pattern, (kinds, most, size) in known.items():
        for name, value in arrays.items():
            if re.fullmatch(pattern, name):
                _check_array(name, value, kinds, most, size)


def _check_array(name: str, value: NDArray, kinds: str, most: tuple[int, ...], size: int) -> None:
    is_small = len(value.shape) == len(most) and value.nbytes <= size
    if value.dtype.kind not in kinds or not is_small or not np.less_equal(value.shape, most).all():
        raise InputError(
            f"{name} is {value.shape} of {value.dtype}, which can't be shown; give at most {most} "
            f"and {size} bytes"
        )
    if kinds == _PIXEL and value.dtype != np.uint8:
        raise InputError(f"{name} is of {value.dtype}; images have uint8")
