"""Check an explanation's files before rendering: sizes, types, and that they fit each other."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.vocabulary import ShownActions
from drone_rl.utils.errors import InputError
from drone_rl.utils.limits import FILM_BYTES, FILM_STEPS, check_indices
from drone_rl.utils.schema import Kind, Maybe, OneOf, Real, Several, Whole, as_mapping
from drone_rl.verification.text import WHERE

METHOD_NAMES = {
    "grad_cam": "Grad-CAM",
    "grad_cam_logit": "Grad-CAM (logit)",
    "saliency": "saliency",
    "integrated_gradients": "integrated gradients",
    "occlusion": "occlusion",
}
"""Attribution methods and their display names."""
_SIDE = 512  # largest width and height of an image, pixels
_ACTIONS = 16
_MANY = 100_000
_INTEGER, _FLOAT, _BOOL, _PIXEL = "iu", "f", "b", "u"
_SIZES = {
    "steps of the film": FILM_STEPS,
    "frames": _MANY,
    "actions": _ACTIONS,
    "outlines": 2**13,
    "heights": 32,
    **dict.fromkeys(("places ahead", "places to the side", "starts ahead"), _SIDE),
    "starts to the side": _SIDE,
}
"""Largest sizes of dimensions; dimensions of the same name must have the same size."""
_Described = tuple[str, tuple[str | int, ...], int]  # kind of dtype, (largest) sizes, most bytes
_ARRAYS: Mapping[str, _Described] = {
    "film_frames": (_PIXEL, ("steps of the film", _SIDE, _SIDE, 3), FILM_BYTES),
    "film_heat(_[a-z_]+)?": (_FLOAT, ("steps of the film", _SIDE, _SIDE), 2**23),
    "film_probabilities": (_FLOAT, ("steps of the film", "actions"), 2**20),
    "film_actions": (_INTEGER, ("steps of the film",), 2**20),
    "class_model_(probability|logit)": (_FLOAT, ("actions", 64, _SIDE, _SIDE), 2**25),
    "tsne_(features|pixels)": (_FLOAT, ("frames", 2), 2**21),
    "places_points": (_FLOAT, (2**16, 2), 2**20),
    "places_(ends|labels)": (_INTEGER, ("outlines",), 2**17),
    "(response|outcome)_height": (_FLOAT, ("heights",), 2**12),
    "response_forward": (_FLOAT, ("places ahead",), 2**12),
    "response_lateral": (_FLOAT, ("places to the side",), 2**12),
    "response_oracle": (_INTEGER, ("places to the side",), 2**12),
    "response_probabilities": (
        _FLOAT,
        ("heights", "places ahead", "places to the side", "actions"),
        2**20,
    ),
    "response_blind": (_BOOL, ("heights", "places ahead", "places to the side"), 2**18),
    "response_without_target": (_FLOAT, (_ACTIONS,), 2**12),
    "outcome_oracle|(response|outcome)_stratum": (_INTEGER, (_SIDE,), 2**12),
    "outcome_forward": (_FLOAT, ("starts ahead",), 2**12),
    "outcome_lateral": (_FLOAT, ("starts to the side",), 2**12),
    "outcome_collected": (_BOOL, ("heights", "starts ahead", "starts to the side"), 2**18),
    "interventions": (_PIXEL, (32, _SIDE, _SIDE, 3), 2**23),
    "patch_effects": (_FLOAT, (_SIDE, _SIDE), 2**20),
    "shifts_[a-z_]+": (_PIXEL, (8, _SIDE, _SIDE, 3), 2**22),
}
_DATA: Mapping[str, _Described] = {
    "frames": (_PIXEL, ("frames", _SIDE, _SIDE, 3), 2**27),
    "probabilities": (_FLOAT, ("frames", "actions"), 2**23),
    "(actions|episode|step|event)": (_INTEGER, ("frames",), 2**20),
    "flights/episode": (_INTEGER, (10 * _MANY,), 2**23),
}
"""Arrays of `arrays.npz` and of `dataset.npz`, by patterns of their names."""
_UNSHOWN = re.compile("map_[a-z_]+|observations|regions|depth|features/.+")
"""Large arrays for other readers, which no part of the report shows."""
_LENGTHS: Mapping[tuple[str, ...], int] = {
    ("attribution", "film", "key_steps"): 12,
    ("truth", "methods"): 16,
    ("truth", "placebos"): 32,
    ("truth", "heat"): 16,
    ("truth", "curves"): 64,
    ("truth", "interventions"): 32,
    ("shifts", "axes"): 64,
}
"""Most entries of lists and mappings in `explanation.json` that figures show one by one."""
_INDICES = {"episode": _MANY, "step": 10**7}  # arrays used as indices, and their exclusive limits
_FINITE = {
    *("tsne_features", "tsne_pixels", "places_points", "response_height", "outcome_height"),
    *("response_forward", "response_lateral", "outcome_forward", "outcome_lateral"),
}
"""Arrays of coordinates, which must be finite."""
_LONGEST = 2000  # most entries of any other list or mapping
_METRES = Real(-1e4, 1e4)
_SHARE = Real(0.0, 1.0)
_PLACES: Mapping[str, Kind] = {
    "touch_distance": Real(0.0, 1e3),
    "least_gap": Real(0.0, 1e9),
    "least_gap_ahead": _METRES,
    "least_gap_left": _METRES,
    "logit_gap": Real(0.0, 1e9),
    **dict.fromkeys(("unseen", "blind", "close", "in_doubt"), _SHARE),
}
_WINDOW: Mapping[str, Kind] = {
    "nearest": Real(0.0, 1e3),
    "farthest": Real(0.0, 1e3, is_above=True),
    "sideways": Real(0.0, 1e3, is_above=True),
}
_FARTHEST_RATIO = 20  # largest ratio of the sides of the exact map


def may_be_shown(name: str) -> bool:
    """Return whether a report may show the array of this name."""
    return _UNSHOWN.fullmatch(name) is None


def check_files(
    numbers: Mapping[str, Any],
    arrays: Mapping[str, NDArray],
    data: Mapping[str, NDArray],
    actions: ShownActions,
) -> None:
    """Check the contents of `explanation.json`, `arrays.npz` and `dataset.npz`.

    Raises:
        InputError: A part is too large, of another type or does not fit; the message names it.
    """
    _check_shown(numbers)
    _check_lengths(numbers)
    if (count := max(len(arrays), len(data))) > _LONGEST:
        raise InputError(f"it holds {count} arrays; give at most {_LONGEST}")
    lengths = {"actions": (len(actions.names), "the list of actions")}
    for given, table in ((data, _DATA), (arrays, _ARRAYS)):
        for pattern, described in table.items():
            for name in (name for name in given if re.fullmatch(pattern, name)):
                _check_array(name, given[name], described, lengths)
    _check_values(arrays, data, len(actions.names))
    steps, frames = (lengths.get(what, (0, ""))[0] for what in ("steps of the film", "frames"))
    _check_items(numbers, steps, frames)
    _check_places(numbers, arrays, len(actions.names))


def _check_values(arrays: Mapping[str, NDArray], data: Mapping[str, NDArray], count: int) -> None:
    """Check coordinates and indices."""
    for name in _FINITE & arrays.keys():
        if not np.isfinite(arrays[name]).all():
            raise InputError(f"{name} holds NaN or infinity")
    steps = len(data.get("flights/episode", ()))  # each episode has at least one step
    ends = 1 + len(arrays.get("places_points", ()))
    limits = {"actions": count, "film_actions": count, "flights/episode": steps, **_INDICES}
    for given, most in ((data, limits), (arrays, {**limits, "places_ends": ends})):
        for name in most.keys() & given.keys():
            check_indices(given[name], max(1, most[name]), name)
    outlines = arrays.get("places_ends", np.empty(0)).astype(np.int64)  # unsigned ones can't fall
    if (np.diff(outlines) < 0).any():
        raise InputError("places_ends decrease; run drone-rl explain again")


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
                raise InputError(f"it has a list of {len(item)} entries; give at most {_LONGEST}")
        inner = [v for item in level for v in (item.values() if isinstance(item, dict) else item)]
        level = [v for v in inner if isinstance(v, dict | list)]


def _check_array(
    name: str, value: NDArray, described: _Described, lengths: dict[str, tuple[int, str]]
) -> None:
    """Check one array; `lengths` has the length of each named dimension, and where it was found."""
    kinds, dimensions, size = described
    most = tuple(_SIZES[d] if isinstance(d, str) else d for d in dimensions)
    is_small = len(value.shape) == len(most) and value.nbytes <= size
    if value.dtype.kind not in kinds or not is_small or not np.less_equal(value.shape, most).all():
        raise InputError(
            f"{name} is {value.shape} of {value.dtype}, which can't be rendered; give at most "
            f"{most} and {size} bytes"
        )
    if kinds == _PIXEL and value.dtype != np.uint8:
        raise InputError(f"{name} is of {value.dtype}; images have uint8")
    for length, what in zip(value.shape, dimensions, strict=True):
        if length == 0 and any(isinstance(dimension, str) for dimension in dimensions):
            raise InputError(f"{name} has the shape {value.shape}: it is empty")
        if isinstance(what, str):
            before, where = lengths.setdefault(what, (length, name))
            if before != length:
                raise InputError(f"{name} has {length} {what}, but {where} has {before}")


def _check_items(numbers: Mapping[str, Any], steps: int, frames: int) -> None:
    """Check the steps of the film, and the frames that sections show."""
    heat = (_part(numbers, "attribution", "film") or {}).get("heat_by")
    if isinstance(heat, list) and len(heat) != steps:
        raise InputError(f"attribution.film.heat_by has {len(heat)} steps; the film has {steps}")
    for i, method in enumerate(_list(heat)):
        Maybe(OneOf(tuple(METHOD_NAMES))).read(method, f"attribution.film.heat_by[{i}]")
    step, frame = Whole(0, max(0, steps - 1)), Whole(0, max(0, frames - 1))
    _read_items(numbers, ("attribution", "film", "key_steps"), {"step": step})
    _read_items(numbers, ("asymmetry", "dataset", "worst"), {"frame": frame})
    _read_items(numbers, ("contradictions", "list"), {"left": frame, "right": frame})


def _check_places(numbers: Mapping[str, Any], arrays: Mapping[str, NDArray], count: int) -> None:
    places = _part(numbers, "places")
    if places is None or "refused" in places:
        return
    shares = Several(_SHARE, count, count)
    _read(places, {**_PLACES, "alone": Whole(0, count - 1), "actions": shares}, "places")
    window = _read(places.get("window"), _WINDOW, "places.window")
    near, far, side = (window[key] for key in ("nearest", "farthest", "sideways"))
    if not near < far:
        raise InputError(f"places.window goes from {near:g} to {far:g} m ahead; it must increase")
    if not 1 / _FARTHEST_RATIO <= far / (2 * side) <= _FARTHEST_RATIO:
        raise InputError(
            f"places.window is {far:g} m long and {2 * side:g} m wide; a map can be up to "
            f"{_FARTHEST_RATIO} times as long as wide"
        )
    of_side = {"actions": shares, **dict.fromkeys(("share", "unseen", "blind"), Maybe(_SHARE))}
    for side, of in as_mapping(places.get("sides"), "places.sides").items():
        if side not in WHERE:
            raise InputError(f"places.sides.{side} is unknown; there are {', '.join(WHERE)}")
        _read(of, of_side, f"places.sides.{side}")
    points = arrays.get("places_points")
    if points is not None and (np.abs(points) > _METRES.high).any():
        raise InputError(f"places_points are up to {np.abs(points).max():g} m away")


def _read(value: Any, kinds: Mapping[str, Kind], where: str) -> Mapping[str, Any]:
    """Check entries of a mapping and return it."""
    found = as_mapping(value, where)
    for key, kind in kinds.items():
        kind.read(found.get(key), f"{where}.{key}")
    return found


def _read_items(
    numbers: Mapping[str, Any], keys: tuple[str, ...], kinds: Mapping[str, Kind]
) -> None:
    """Check entries of each item of a list, if there is one."""
    *outer, last = keys
    for i, item in enumerate(_list((_part(numbers, *outer) or {}).get(last))):
        _read(item, kinds, f"{'.'.join(keys)}[{i}]")


def _part(numbers: Mapping[str, Any], *keys: str) -> Mapping[str, Any] | None:
    """Return an inner mapping; None if it is missing."""
    part: Any = numbers
    for i, key in enumerate(keys):
        part = part.get(key)
        if part is None:
            return None
        part = as_mapping(part, ".".join(keys[: i + 1]))
    return part


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
