"""Kinds of plain data: types and bounds, as pydantic's metadata in annotations of settings.

`Annotated[int, Whole(1, 100, "cubes")]` is a setting's type. `Whole(1, 100).read(value, where)`
checks one value: it returns the value, or raises an `InputError` that begins with the name `where`.
"""

import dataclasses
import functools
import math
import os
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from annotated_types import MaxLen, MinLen, Predicate
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    Strict,
    Tag,
    TypeAdapter,
    ValidationError,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema
from typing_extensions import TypeAliasType

from drone_rl.utils.errors import InputError
from drone_rl.utils.errors import shown as shown
from drone_rl.utils.models import input_error

LONGEST_TEXT = 4000
"""Characters of one text in a file."""


class Annotation:
    """A kind that pydantic checks by the annotation `hint`."""

    hint: Any
    unit: str = ""
    """Unit, for documentation."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return ""

    @property
    def reason(self) -> str:
        """Why a value is refused; empty for pydantic's own reasons."""
        return f"must be {self.words}" if self.words else ""

    def read(self, value: Any, where: str) -> Any:
        """Return a value of this kind; raise an `InputError` about `where` for any other."""
        try:
            return self._adapter.validate_python(as_plain(value))
        except ValidationError as error:
            raise input_error(error, self.hint, where) from None

    @functools.cached_property
    def _adapter(self) -> TypeAdapter[Any]:
        config = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)
        hint = Annotated[Any, self]
        return TypeAdapter(hint, config=config)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        schema = handler.generate_schema(self.hint)
        if not self.reason:
            return schema
        return core_schema.custom_error_schema(schema, "kind", custom_error_message=self.reason)


@dataclasses.dataclass(frozen=True)
class Whole(Annotation):
    """An integer; neither true nor 3.0 is one."""

    low: int
    high: float = math.inf
    unit: str = ""

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        high = None if self.high == math.inf else int(self.high)
        return Annotated[int, Field(strict=True, ge=self.low, le=high)]

    @property
    def words(self) -> str:
        """The range in words."""
        if self.high == math.inf:
            return f"a whole number of {self.low} or more"
        return f"a whole number from {self.low} to {self.high}"


@dataclasses.dataclass(frozen=True)
class Real(Annotation):
    """A finite number."""

    low: float
    high: float = math.inf
    is_above: bool = False
    """Whether `low` is excluded."""
    is_below: bool = False
    """Whether `high` is excluded."""
    unit: str = ""

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        bounds = {
            "gt" if self.is_above else "ge": self.low,
            "lt" if self.is_below else "le": self.high,
        }
        bounds = {name: bound for name, bound in bounds.items() if abs(bound) != math.inf}
        return Annotated[float, Field(strict=True, allow_inf_nan=False, **bounds)]

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
class Flag(Annotation):
    """True or false."""

    hint = Annotated[bool, Strict()]

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return "true or false"


@dataclasses.dataclass(frozen=True)
class OneOf(Annotation):
    """One of some texts."""

    names: tuple[str, ...]
    also: tuple[str, ...] = ()
    """Accepted as well, but not offered."""

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Literal[*self.names, *self.also]


@dataclasses.dataclass(frozen=True)
class Instance(Annotation):
    """An object of a class; settings are also read from mappings, and parts from names."""

    of: Any
    """The class, or another type, such as one that allows None."""

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return self.of


@dataclasses.dataclass(frozen=True)
class Text(Annotation):
    """One line of printable characters; a path or a device of torch is its text."""

    longest: int = LONGEST_TEXT

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[str, Strict(), MaxLen(self.longest), Predicate(str.isprintable)]

    @property
    def reason(self) -> str:
        """See `Annotation`."""
        return f"must be one line of at most {self.longest} printable characters"


@dataclasses.dataclass(frozen=True)
class FileName(Annotation):
    """The name of a file without its suffix; no path and no hidden file."""

    longest: int = 150

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[Text().hint, Predicate(self._is_name)]

    @property
    def reason(self) -> str:
        """See `Annotation`."""
        return (
            f"must be a name of at most {self.longest} bytes without / and \\, not beginning with "
            "a dot, ~, - or a space"
        )

    def _is_name(self, text: str) -> bool:
        is_short = 0 < len(text.encode(errors="replace")) <= self.longest
        return is_short and not {*text} & {*"/\\"} and text[0] not in ".~- "


@dataclasses.dataclass(frozen=True)
class Several(Annotation):
    """A list of values of one kind, as a tuple."""

    kind: Any
    least: int
    most: int

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        values = tuple[Annotated[Any, self.kind], ...]
        return Annotated[values, MinLen(self.least), MaxLen(self.most)]


@dataclasses.dataclass(frozen=True)
class Span(Annotation):
    """A value of a kind, or a range: the pair of its lowest and highest value."""

    kind: Any

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        value = Annotated[Any, self.kind]
        ends = Annotated[tuple[value, value], AfterValidator(_rising)]
        tagged: Any = Annotated[value, Tag("(value)")]
        return Annotated[tagged | Annotated[ends, Tag("(range)")], Discriminator(self._tag)]

    def _tag(self, value: Any) -> str:
        is_pair = isinstance(value, list | tuple) and len(value) == 2
        is_nested = is_pair and isinstance(value[0], list | tuple)
        return "(range)" if is_pair and is_nested == isinstance(self.kind, Several) else "(value)"


def _rising(ends: tuple[Any, Any]) -> tuple[Any, Any]:
    low, high = (end if isinstance(end, tuple) else (end,) for end in ends)
    if any(least > most for least, most in zip(low, high, strict=True)):
        raise PydanticCustomError("order", "must have the lower value first")
    return ends


@dataclasses.dataclass(frozen=True)
class Listed(Annotation):
    """One text or a list of them, as a tuple."""

    what: str
    """The thing that each names."""
    most: int = 1000

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[
            tuple[Text().hint, ...],
            BeforeValidator(lambda names: (names,) if isinstance(names, str) else names),
            Predicate(lambda names: 0 < len(names) == len({*names}) <= self.most),
        ]

    @property
    def reason(self) -> str:
        """See `Annotation`."""
        return f"must name {self.words}, each once, at most {self.most}"

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return f"{'an' if self.what[0] in 'aeiou' else 'a'} {self.what} or a list of them"


PlainData = TypeAliasType(
    "PlainData",
    Annotated[bool, Strict()]
    | Annotated[int, Strict()]
    | Annotated[float, Strict(), AllowInfNan(False)]
    | Annotated[str, Text()]
    | Annotated[list["PlainData"], Strict()]
    | Annotated[dict[Annotated[str, Text()], "PlainData"], Strict()]
    | None,
)
"""Values of plain data."""


@dataclasses.dataclass(frozen=True)
class Plain(Annotation):
    """A mapping of plain data."""

    hint = dict[Annotated[str, Text()], PlainData]

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return "plain data: short lines of text, finite numbers, true, false, null, lists, mappings"


def as_mapping(value: Any, where: str) -> Mapping[str, Any]:
    """Return a mapping whose keys are texts; raise an `InputError` for anything else."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f"{where}={shown(value)} must be a mapping from names to values")
    return value


def as_plain(value: Any) -> Any:
    """Return Python's numbers for NumPy's or PyTorch's, texts for paths, and tuples for lists."""
    if isinstance(value, list) or type(value) is tuple:
        return tuple(map(as_plain, value))
    module = type(value).__module__
    if module in ("numpy", "torch") and getattr(value, "shape", None) == ():
        return value.item()
    is_device = module == "torch" and type(value).__name__ == "device"
    return str(value) if is_device or isinstance(value, os.PathLike) else value
