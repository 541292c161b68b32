"""Kinds of plain data: types and bounds, checked before anything is built from a file.

Each kind has one method, `read(value, where)`. It returns the value, or raises an `InputError` that
begins with the name `where`.
"""

import dataclasses
import math
import numbers
import os
import sys
from collections.abc import Mapping
from typing import Any, Protocol

from drone_rl.utils.errors import InputError, did_you_mean

LONGEST_TEXT = 4000
"""Characters of one text in a file."""
_MOST_BITS = 10_000
"""Of a whole number in a message."""


class Kind(Protocol):
    """One kind of value."""

    def read(self, value: Any, where: str) -> Any:
        """Return a value of this kind; raise an `InputError` about `where` for any other."""
        ...


@dataclasses.dataclass(frozen=True)
class Whole:
    """An integer; neither true nor 3.0 is one."""

    low: int
    high: float = math.inf
    unit: str = ""
    """Unit, for documentation."""

    def read(self, value: Any, where: str) -> int:
        """See `Kind`."""
        if not _is_number(value, numbers.Integral):
            raise InputError(f"{where}={shown(value)} is not a whole number; give {self.words}")
        if not self.low <= value <= self.high:
            raise InputError(f"{where}={shown(value)} is out of range; give {self.words}")
        return int(value)

    @property
    def words(self) -> str:
        """The range in words."""
        if self.high == math.inf:
            return f"a whole number of {self.low} or more"
        return f"a whole number from {self.low} to {self.high}"


@dataclasses.dataclass(frozen=True)
class Real:
    """A finite number."""

    low: float
    high: float = math.inf
    is_above: bool = False
    """Whether `low` is excluded."""
    is_below: bool = False
    """Whether `high` is excluded."""
    unit: str = ""
    """Unit, for documentation; empty for rates and other bare numbers."""

    def read(self, value: Any, where: str) -> float:
        """See `Kind`."""
        value = _unboxed(value)
        if not _is_number(value, numbers.Real) or not self._holds(value):
            raise InputError(f"{where}={shown(value)} is out of range; give {self.words}")
        return float(value)

    def _holds(self, value: float) -> bool:
        if not abs(value) <= sys.float_info.max:
            return False
        above = value > self.low if self.is_above else value >= self.low
        return above and (value < self.high if self.is_below else value <= self.high)

    @property
    def words(self) -> str:
        """The range in words."""
        low, high = f"{self.low:g}", f"{self.high:g}"
        if (self.low, self.high) == (-math.inf, math.inf):
            return "a finite number"
        if self.high == math.inf:
            return f"a number above {low}" if self.is_above else f"a number of {low} or more"
        if self.is_above:
            until = f"and below {high}" if self.is_below else f"up to {high}"
            return f"a number above {low} {until}"
        return f"a number from {low} to {'below ' if self.is_below else ''}{high}"


@dataclasses.dataclass(frozen=True)
class Flag:
    """True or false."""

    def read(self, value: Any, where: str) -> bool:
        """See `Kind`."""
        value = _unboxed(value)
        if type(value) is not bool:
            raise InputError(f"{where}={shown(value)} is neither true nor false; give one of them")
        return value


@dataclasses.dataclass(frozen=True)
class OneOf:
    """One of some texts."""

    names: tuple[str, ...]
    also: tuple[str, ...] = ()
    """Accepted as well, but not offered."""

    def read(self, value: Any, where: str) -> str:
        """See `Kind`."""
        if not isinstance(value, str) or value not in (*self.names, *self.also):
            meant = did_you_mean(value, self.names)
            raise InputError(
                f"{where}={shown(value)} is unknown; give {', '.join(self.names)}{meant}"
            )
        return value


@dataclasses.dataclass(frozen=True)
class Instance:
    """An object of a class."""

    of: type

    def read(self, value: Any, where: str) -> Any:
        """See `Kind`; a class with `from_name` accepts names."""
        if isinstance(value, str) and hasattr(self.of, "from_name"):
            return self.of.from_name(value, where)
        if not isinstance(value, self.of):
            name = self.of.__name__
            remedy = " or a registered name" if hasattr(self.of, "from_name") else ""
            raise InputError(f"{where}={shown(value)} is no {name}; give one{remedy}")
        return value


@dataclasses.dataclass(frozen=True)
class Text:
    """One line of printable characters."""

    longest: int = LONGEST_TEXT

    def read(self, value: Any, where: str) -> str:
        """See `Kind`; a path or a device of torch is its text."""
        is_device = f"{type(value).__module__}.{type(value).__name__}" == "torch.device"
        if is_device or isinstance(value, os.PathLike):
            value = str(value)
        if not isinstance(value, str) or len(value) > self.longest or not value.isprintable():
            raise InputError(
                f"{where}={shown(value)} is no text; give one line of at most {self.longest} "
                "printable characters"
            )
        return value


@dataclasses.dataclass(frozen=True)
class FileName:
    """The name of a file without its suffix; no path and no hidden file."""

    longest: int = 150

    def read(self, value: Any, where: str) -> str:
        """See `Kind`."""
        text = value if isinstance(value, str) else ""
        is_name = bool(text) and len(text.encode(errors="replace")) <= self.longest
        if not is_name or not text.isprintable() or {*text} & {*"/\\"} or text[0] in ".~- ":
            raise InputError(
                f"{where}={shown(value)} is no name of a file; give one of at most "
                f"{self.longest} bytes without / and \\, not beginning with a dot, ~, - or a space"
            )
        return text


@dataclasses.dataclass(frozen=True)
class Maybe:
    """A value of some kind, or None."""

    kind: Kind

    def read(self, value: Any, where: str) -> Any:
        """See `Kind`."""
        return None if value is None else self.kind.read(value, where)


@dataclasses.dataclass(frozen=True)
class Several:
    """A list of values of one kind, as a tuple."""

    kind: Kind
    least: int
    most: int

    def read(self, value: Any, where: str) -> tuple:
        """See `Kind`."""
        if not isinstance(value, list | tuple) or not self.least <= len(value) <= self.most:
            raise InputError(
                f"{where}={self._shown(value)} does not fit; give a list of {self._count} values"
            )
        return tuple(self.kind.read(item, f"{where}[{i}]") for i, item in enumerate(value))

    @property
    def _count(self) -> str:
        return f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"

    @staticmethod
    def _shown(value: Any) -> str:
        is_short = isinstance(value, list | tuple) and len(value) <= 8
        return f"[{','.join(map(shown, value))}]" if is_short else shown(value)


@dataclasses.dataclass(frozen=True)
class Span:
    """A value of a kind, or a range: the pair of its lowest and highest value."""

    kind: Kind

    def read(self, value: Any, where: str) -> Any:
        """See `Kind`."""
        if not self._is_range(value):
            return self.kind.read(value, where)
        low, high = (self.kind.read(item, f"{where}[{i}]") for i, item in enumerate(value))
        pairs = zip(low, high, strict=True) if isinstance(low, tuple) else [(low, high)]
        for least, most in pairs:
            if least > most:
                raise InputError(
                    f"{where} goes from {least:g} to {most:g}, which is less; give the lower first"
                )
        return low, high

    def _is_range(self, value: Any) -> bool:
        if not isinstance(value, list | tuple) or len(value) != 2:
            return False
        return not isinstance(self.kind, Several) or isinstance(value[0], list | tuple)


@dataclasses.dataclass(frozen=True)
class Listed:
    """One text or a list of them, as a tuple."""

    what: str
    """The thing that each names."""
    most: int = 1000

    def read(self, value: Any, where: str) -> tuple[str, ...]:
        """See `Kind`."""
        items = [value] if isinstance(value, str) else value
        is_list = isinstance(items, list | tuple) and 0 < len(items) <= self.most
        if not is_list or len({*map(str, items)}) < len(items):
            raise InputError(
                f"{where}={shown(value)} must name {self.words}, each once, at most {self.most}"
            )
        return tuple(Text().read(item, where) for item in items)

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return f"{'an' if self.what[0] in 'aeiou' else 'a'} {self.what} or a list of them"


@dataclasses.dataclass(frozen=True)
class Record:
    """A mapping with exactly these keys."""

    fields: Mapping[str, Kind]
    optional: frozenset[str] = frozenset()
    """Keys that may be missing."""

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `Kind`."""
        value = as_mapping(value, where)
        for key in value:
            if key not in self.fields:
                raise InputError(
                    f"{where}.{shown(key)} is unknown; valid names: {', '.join(self.fields) or '-'}"
                )
        for key in self.fields:
            if key not in value and key not in self.optional:
                raise InputError(f"{where}.{key} is missing; write the file again")
        return {
            key: kind.read(value[key], f"{where}.{key}")
            for key, kind in self.fields.items()
            if key in value
        }


@dataclasses.dataclass(frozen=True)
class Plain:
    """Any plain data: texts, finite numbers, true, false, none, lists, mappings."""

    def read(self, value: Any, where: str) -> Any:
        """See `Kind`."""
        try:
            _check_plain(value, where)
        except RecursionError:
            raise InputError(f"{where} is nested too deeply") from None
        return value


def as_mapping(value: Any, where: str) -> Mapping[str, Any]:
    """Return a mapping whose keys are texts; raise an `InputError` for anything else."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f"{where}={shown(value)} must be a mapping from names to values")
    return value


def shown(value: Any) -> str:
    """Return a value for a message: short, on one line."""
    value = _unboxed(value)
    if isinstance(value, type):
        return f"(the class {value.__name__})"
    if value is not None and not isinstance(value, str | int | float):
        return f"({type(value).__name__})"
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:  # Python refuses to write it
        return f"(a number of {value.bit_length()} bits)"
    text = repr(value[:80] if isinstance(value, str) else value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _unboxed(value: Any) -> Any:
    """Return the Python value of a number or truth value of NumPy or PyTorch; others unchanged."""
    is_array = type(value).__module__ in ("numpy", "torch")
    is_scalar = is_array and getattr(value, "shape", None) == ()
    return value.item() if is_scalar else value


def _is_number(value: Any, kind: type) -> bool:
    """Return whether a value is a number of Python or NumPy, and no bool."""
    return isinstance(value, kind) and not isinstance(value, bool)


def _check_plain(value: Any, where: str) -> None:
    if isinstance(value, Mapping):
        for key, item in as_mapping(value, where).items():
            Text().read(key, f"a name in {where}")
            _check_plain(item, where)
    elif isinstance(value, list | tuple):
        for item in value:
            _check_plain(item, where)
    elif isinstance(value, str):
        Text().read(value, f"a text in {where}")
    elif isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{where} holds {value}; every number must be finite")
    elif value is not None and not isinstance(value, bool | int | float):
        raise InputError(f"{where} holds a value of type {type(value).__name__}; give plain data")
