"""Read `shifts.json`: its types, and that it is of the given policy.

Whether the episodes were run cannot be checked. `drone_rl.trust.coverage` re-runs a sample.
"""

import dataclasses
import datetime
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from numpy.typing import NDArray

from drone_rl.config.commands import MODES, ShiftSettings
from drone_rl.policies.zoo import PolicyDescription, fingerprint, parse
from drone_rl.sim.tasks import as_task
from drone_rl.sim.vocabulary import terms_of
from drone_rl.trust.axes import AXES, GROUPS
from drone_rl.trust.suite import unpacked
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import SHIFTS_BYTES
from drone_rl.utils.schema import (
    Flag,
    Kind,
    Maybe,
    OneOf,
    Plain,
    Real,
    Record,
    Several,
    Text,
    Whole,
    as_mapping,
)
from drone_rl.utils.text import SEED_KEYS

FORMAT = "drone_rl shifts"
FORMAT_VERSION = 2
_MAX_IMAGE_LENGTH = 2**22
"""Largest number of characters of one image."""


@dataclasses.dataclass(frozen=True)
class SavedShifts:
    """A robustness evaluation read from a file, or the reason why it is refused."""

    path: Path
    """The file."""
    numbers: dict[str, Any] | None
    """As in `shifts.json`, without images but with "file" ("path", "dated"); None if refused."""
    pictures: Mapping[str, list[NDArray | None]] = dataclasses.field(default_factory=dict)
    """See `Shifts.pictures`."""
    refused: str | None = None
    """The reason, in one line."""

    @property
    def evidence(self) -> dict[str, Any]:
        """Evidence for sentences."""
        return {"refused": self.refused} if self.numbers is None else self.numbers

    @property
    def has_ranges(self) -> bool:
        """Whether it has an operating domain."""
        return self.numbers is not None and self.numbers["domain"] is not None


def read_shifts(
    path: Path, described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> SavedShifts:
    """Read the robustness evaluation of a policy in its task from a JSON file.

    Raises:
        InputError: It is missing, damaged, or of another network, camera or task.
    """
    content = read_bytes(path, SHIFTS_BYTES)
    try:
        data = dict(as_mapping(parse_json(content, "it"), "it"))
        pictures = as_mapping(data.pop("pictures", None), "pictures")
        _WHOLE.read(data, "shifts")
        numbers = data
        _refuse_another(numbers, described, weights)
        terms_of(numbers)
        task = as_task(described.task)
        numbers["terms"] = task.vocabulary.as_dict()  # the file's own could say anything
        shape = (described.camera.height, described.camera.width, 3)
        images = {name: _read_strip(pictures.get(name), shape, name) for name in numbers["axes"]}
    except InputError as error:
        raise InputError(f"shifts {path} can't be used: {error}") from None
    when = datetime.datetime.fromtimestamp(path.stat().st_mtime).strftime("%Y-%m-%d %H:%M")
    return SavedShifts(path, {**numbers, "file": {"path": str(path), "dated": when}}, images)


@dataclasses.dataclass(frozen=True)
class _Each:
    """Mapping from names to values of a kind."""

    kind: Kind
    names: tuple[str, ...] | None = None
    """Allowed names; any short ones by default."""

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `drone_rl.utils.schema.Kind`."""
        items = as_mapping(value, where)
        if self.names is None:
            Plain().read(items, where)
        else:
            for key in items:
                OneOf(self.names).read(key, f"a name in {where}")
        return {key: self.kind.read(item, f"{where}.{key}") for key, item in items.items()}


_ANY = Real(-1e12, 1e12)
_COUNT, _PART = Whole(0, 10**9), Real(0.0, 1.0)
_BOUNDS = {"lower95": _PART, "upper95": _PART}
_SHARE = Record({"share": Maybe(_PART), **_BOUNDS, "successes": _COUNT, "trials": _COUNT})
_FREE = Plain()
_SIGNED = Real(-1.0, 1.0)
_MEAN = Record({"mean": Maybe(_PART), **_BOUNDS, "count": _COUNT})
_FIGURES = {
    "success": _SHARE,
    "difference": Record(
        {"mean": _SIGNED, "lower95": _SIGNED, "upper95": _SIGNED, "count": _COUNT}
    ),
    "paired": _FREE,  # of earlier versions
    "shares": _Each(_MEAN),
    "ends": _Each(_COUNT),
    "unchanged": Flag(),
}
_EARLIER = frozenset({"paired"})
_FLOWN = {
    "refused": Maybe(Text()),
    "oracle": Maybe(_SHARE),
    "impossible": Maybe(Flag()),
    "modes": _Each(Record(_FIGURES, _EARLIER), MODES),
}
_LEVEL = Record({"number": Whole(1, 5), "value": _ANY, "position": _ANY, **_FLOWN})
_AXIS = Record(
    {
        "group": OneOf(GROUPS),
        "unit": Text(),
        "neutral": Maybe(_ANY),
        "areas": _Each(Maybe(_PART), MODES),
        "levels": Several(_LEVEL, 1, 5),
    }
)
_WORST = Record({"side": Text(200), "share": _PART})
_PROBE: dict[str, Kind] = {
    "good": Flag(),
    "bad": Flag(),
    "refused": Maybe(Text()),
    "success": _PART,
    "fragile": _COUNT,
    "worst": Maybe(_WORST),
}
_UNLESS_REFUSED = frozenset({"success", "fragile", "worst"})
_END = {"end": OneOf(("low", "high")), "value": Maybe(_ANY)}
_FAILED = Record(
    {**_END, "oracle": Maybe(_SHARE), "impossible": Flag(), **_PROBE}, optional=_UNLESS_REFUSED
)
_RANGE = Record(
    {
        "low": Maybe(_ANY),
        "high": Maybe(_ANY),
        "positions": Maybe(Several(_ANY, 2, 2)),
        "low_open": Maybe(Flag()),
        "high_open": Maybe(Flag()),
        "failed": Several(_FAILED, 0, 2),
        "flown": Several(Record({"position": _ANY, "value": Maybe(_ANY), "good": Flag()}), 0, 100),
    }
)
_PLAIN = Record(_PROBE, optional=_UNLESS_REFUSED)
_DOMAIN = Record({"plain": _PLAIN, "ranges": _Each(_RANGE, tuple(AXES))})
_PARTS = ("appearance", "dynamics", "actions", "camera", "transforms", "network")
_ORIGIN = {"versions": _FREE, "git_revision": _FREE, "machine": _FREE}
_WHOLE = Record(
    {
        "format": OneOf((FORMAT,)),
        "format_version": Whole(FORMAT_VERSION, FORMAT_VERSION),
        "policy": Text(),
        "network": Record({"weights": Text(64), "description": Plain()}),
        "settings": Plain(),
        "seed": Whole(0),
        "seed_is_fixed": Flag(),
        "terms": Plain(),
        "plain": Record({"oracle": Maybe(_SHARE), **_FIGURES}, _EARLIER),
        "axes": _Each(_AXIS, tuple(AXES)),
        "together": Record(_FLOWN),
        "domain": Maybe(_DOMAIN),
        "seconds": Real(0.0),
        **_ORIGIN,
    },
    optional=frozenset((*_ORIGIN, *SEED_KEYS)),
)


def _refuse_another(
    numbers: Mapping[str, Any], described: PolicyDescription, weights: Mapping[str, torch.Tensor]
) -> None:
    """Refuse figures of another network, camera or task, or with unknown settings."""
    stated = numbers["network"]["weights"]
    if stated != (actual := fingerprint(weights)):
        raise InputError(
            f"it is for a network with hash {stated[:12]}..., but the policy's has {actual[:12]}..."
        )
    of, description = parse(numbers["network"]["description"]).as_dict(), described.as_dict()
    for part in ("task", *_PARTS):
        if of.get(part) != description.get(part):
            raise InputError(f"it is of another {part} than the policy's")
    ShiftSettings.read(numbers["settings"], "settings")


def _read_strip(value: Any, shape: tuple[int, int, int], name: str) -> list[NDArray | None]:
    texts = Several(Maybe(Text(_MAX_IMAGE_LENGTH)), 6, 6).read(value, f"pictures.{name}")
    if texts[0] is None:
        raise InputError(f"pictures.{name} has no image without perturbation")
    return [None if t is None else unpacked(t, shape, f"pictures.{name}") for t in texts]
