"""Whether the parts of an explanation fit each other, so that no report fails half-way."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explanations.report.truth_text import NAMES
from drone_rl.sim.action_display import ShownActions
from drone_rl.utils.errors import InputError
from drone_rl.utils.limits import check_indices
from drone_rl.utils.schema import Kind, Maybe, OneOf, Real, Colors, Whole, as_mapping
from drone_rl.verification.text import WHERE

_DIMENSIONS: Mapping[str, tuple[str, ...]] = {
    "film_frames": ("steps of the film", "", "", ""),
    "film_heat": ("steps of the film", "", ""),
    "film_probabilities": ("steps of the film", "actions"),
    "film_actions": ("steps of the film",),
    "frames": ("frames", "", "", ""),
    "probabilities": ("frames", "actions"),
    "actions": ("frames",),
    "episode": ("frames",),
    "step": ("frames",),
    "event": ("frames",),
    "tsne_features": ("frames", ""),
    "tsne_pixels": ("frames", ""),
    "class_model_probability": ("actions", "", "", ""),
    "class_model_logit": ("actions", "", "", ""),
    "places_ends": ("outlines",),
    "places_labels": ("outlines",),
    "response_height": ("heights",),
    "response_forward": ("places ahead",),
    "response_lateral": ("places to the side",),
    "response_oracle": ("places to the side",),
    "response_probabilities": ("heights", "places ahead", "places to the side", "actions"),
    "response_blind": ("heights", "places ahead", "places to the side"),
    "outcome_height": ("heights",),
    "outcome_forward": ("starts ahead",),
    "outcome_lateral": ("starts to the side",),
    "outcome_collected": ("heights", "starts ahead", "starts to the side"),
}
"""What the dimensions of arrays count; those that count the same are equally long."""
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
_FARTHEST_RATIO = 20
"""Between the sides of the map: beyond that it is a line."""


def check_fit(
    numbers: Mapping[str, Any],
    arrays: Mapping[str, NDArray],
    data: Mapping[str, NDArray],
    actions: ShownActions,
) -> None:
    """Refuses an explanation whose arrays and numbers do not belong together.

    Args:
        numbers: `explanation.json`.
        arrays: `arrays.npz`.
        data: `dataset.npz`.
        actions: Those of the policy.

    Raises:
        InputError: They do not; the part is named.
    """
    known = {**data, **arrays}
    lengths: dict[str, tuple[int, str]] = {"actions": (len(actions.names), "the list of actions")}
    for name, dimensions in _DIMENSIONS.items():
        if name in known:
            _check_lengths(name, known[name].shape, dimensions, lengths)
    steps, frames = (lengths.get(what, (0, ""))[0] for what in ("steps of the film", "frames"))
    for name in ("actions", "film_actions"):
        if name in known:
            check_indices(known[name], len(actions.names), name)
    _check_film(numbers, steps)
    for where, index in _frames_shown(numbers):
        Whole(0, max(0, frames - 1)).read(index, where)
    _check_places(numbers, arrays, len(actions.names))


def _check_lengths(
    name: str,
    shape: tuple[int, ...],
    dimensions: tuple[str, ...],
    lengths: dict[str, tuple[int, str]],
) -> None:
    if len(shape) != len(dimensions):
        raise InputError(f"{name} has {len(shape)} dimensions, not {len(dimensions)}")
    for length, what in zip(shape, dimensions, strict=True):
        if length == 0:
            raise InputError(f"{name} has the shape {shape}: it is empty")
        before, where = lengths.setdefault(what, (length, name)) if what else (length, name)
        if before != length:
            raise InputError(f"{name} has {length} {what}, but {where} has {before}")


def _check_film(numbers: Mapping[str, Any], steps: int) -> None:
    film = _part(numbers, "attribution", "film")
    if film is None:
        return
    heat = film.get("heat_by")
    if isinstance(heat, list) and len(heat) != steps:
        raise InputError(f"attribution.film.heat_by has {len(heat)} steps; the film has {steps}")
    for i, method in enumerate(_list(heat)):
        Maybe(OneOf(tuple(NAMES))).read(method, f"attribution.film.heat_by[{i}]")
    for i, entry in enumerate(_list(film.get("key_steps"))):
        where = f"attribution.film.key_steps[{i}]"
        step = as_mapping(entry, where).get("step")
        Whole(0, max(0, steps - 1)).read(step, f"{where}.step")


def _frames_shown(numbers: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Return the names and values of all numbers of frames."""
    worst = _part(numbers, "asymmetry", "dataset")
    for i, entry in enumerate(_list((worst or {}).get("worst"))):
        where = f"asymmetry.dataset.worst[{i}]"
        yield f"{where}.frame", as_mapping(entry, where).get("frame")
    for i, entry in enumerate(_list((_part(numbers, "contradictions") or {}).get("list"))):
        where = f"contradictions.list[{i}]"
        for side in ("left", "right"):
            yield f"{where}.{side}", as_mapping(entry, where).get(side)


def _check_places(numbers: Mapping[str, Any], arrays: Mapping[str, NDArray], count: int) -> None:
    places = _part(numbers, "places")
    if places is None or "refused" in places:
        return
    for key, kind in _PLACES.items():
        kind.read(places.get(key), f"places.{key}")
    Whole(0, count - 1).read(places.get("alone"), "places.alone")
    window = as_mapping(places.get("window"), "places.window")
    for key, kind in _WINDOW.items():
        kind.read(window.get(key), f"places.window.{key}")
    _check_window(window)
    shares = Several(_SHARE, count, count)
    shares.read(places.get("actions"), "places.actions")
    for side, of in as_mapping(places.get("sides"), "places.sides").items():
        if side not in WHERE:
            raise InputError(f"places.sides.{side} is unknown; there are {', '.join(WHERE)}")
        where = f"places.sides.{side}"
        shares.read(as_mapping(of, where).get("actions"), f"{where}.actions")
        for key in ("share", "unseen", "blind"):
            Maybe(_SHARE).read(of.get(key), f"{where}.{key}")
    points = arrays.get("places_points")
    if points is not None and (np.abs(points) > _METRES.high).any():
        raise InputError(f"places_points are up to {np.abs(points).max():g} m away")


def _check_window(window: Mapping[str, Any]) -> None:
    near, far, side = (window[key] for key in ("nearest", "farthest", "sideways"))
    if not near < far:
        raise InputError(f"places.window goes from {near:g} to {far:g} m ahead; it must go up")
    if not 1 / _FARTHEST_RATIO <= far / (2 * side) <= _FARTHEST_RATIO:
        raise InputError(
            f"places.window is {far:g} m long and {2 * side:g} m wide; a map can be up to "
            f"{_FARTHEST_RATIO} times as long as wide"
        )


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
