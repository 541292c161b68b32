"""Frozen classes of plain data whose values are checked: settings and results."""

import re
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import pydantic
from pydantic_core import ErrorDetails

from drone_rl.utils.errors import InputError, did_you_mean, shown
from drone_rl.utils.files import read_bytes, write_atomically
from drone_rl.utils.limits import RESULT_BYTES


class _Checked(type(pydantic.BaseModel)):
    if not typing.TYPE_CHECKING:  # whose return value would hide the class from type checkers

        def __call__(cls, *args: Any, **values: Any) -> Any:
            """Make an instance; errors in nested ones have their place."""
            try:
                return super().__call__(*args, **values)
            except pydantic.ValidationError as error:
                raise input_error(error, cls) from None


class Model(pydantic.BaseModel, metaclass=_Checked, frozen=True):
    """Base of frozen classes with typed fields; a docstring below a field describes it.

    JSON files are read strictly: "3" is no number and 3.0 no whole one.

    Raises:
        InputError: A field is unknown, missing or invalid. The message begins with its name.
    """

    model_config = pydantic.ConfigDict(
        extra="forbid",
        defer_build=True,  # most commands use few classes, and reading docstrings is slow; see
        # `drone_rl.utils.settings.meanings`
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
    )

    @classmethod
    def read(cls, data: object, where: str = "") -> Self:
        """Return an instance from plain data.

        Args:
            data: A mapping from names to values; nested models are mappings, too.
            where: Its name, for messages; empty at the root.

        Raises:
            InputError: See above.
        """
        try:
            return cls.model_validate(data)
        except pydantic.ValidationError as error:
            raise input_error(error, cls, where) from None

    @classmethod
    def read_json(cls, path: Path, most: int = RESULT_BYTES) -> Self:
        """Return an instance from a JSON file of at most `most` bytes.

        Errors are as of `read`, without the path; those of `read_bytes` name it.
        """
        try:
            return cls.model_validate_json(read_bytes(path, most), strict=True)
        except pydantic.ValidationError as error:
            raise input_error(error, cls) from None

    def write_json(self, path: Path) -> None:
        """Write a JSON file that `read_json` reads."""
        write_atomically(path, self.model_dump_json(indent=2))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values of some fields; see above for errors."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**fields, **(self.model_extra or {}), **changes})


class Stored(Model):
    """Base of results: entries of files that this version does not know are ignored."""

    model_config = pydantic.ConfigDict(extra="ignore")


class Seeded(Stored):
    """Base of results that are claims: they record the seed of what was sampled for them."""

    seed: int | None = None
    """Root of the random streams; None if it was not recorded."""
    seed_is_fixed: bool = True
    """Whether the seed was known before, so that a policy could have been fitted to it."""

    def seed_line(self, what: str = "environments") -> str:
        """Return the seed and its origin; `what` is sampled from its streams."""
        seed = "not recorded" if self.seed is None else self.seed
        return f"{what}: seed {seed} ({'fixed' if self.seed_is_fixed else 'fresh'})"

    def seed_warning(self, what: str = "environments") -> str:
        """Return a warning of a seed that was known before; empty for a fresh one."""
        if not self.seed_is_fixed:
            return ""
        label = f"Fixed {what}" if self.seed is None else f"Fixed seed {self.seed}"
        return f"{label}: a policy could have been fitted to these {what}."


def input_error(error: pydantic.ValidationError, cls: Any = None, where: str = "") -> InputError:
    """Return the first error of pydantic as a user's error, with the place, value and remedy."""
    details = error.errors(include_url=False)[0]
    place = _place(details, where)
    if details["type"] == "extra_forbidden":
        names = _names(cls, details["loc"][:-1])
        meant = did_you_mean(details["loc"][-1], names)
        valid = f"valid names: {', '.join(names)}{meant}" if names else "leave it out"
        return InputError(f"{place} is unknown; {valid}")
    if details["type"] == "json_invalid":
        return InputError(f"it is damaged: {details['msg']}; write the file again")
    if details["type"] == "missing":
        return InputError(f"{place} is missing; give it")
    if details["type"] == "value_error":  # raised by a validator of this project
        text = str(details.get("ctx", {}).get("error", details["msg"]))
        is_inside = re.match(r"(?!it\b)[\w.\[\]]+(=| (is|are|must) )", text)
        return InputError(f"{place}{'.' if is_inside else ': '}{text}" if place else text)
    reason = details["msg"][:1].lower() + details["msg"][1:]
    if rest := details["msg"].partition(" should ")[2]:
        plain = rest.replace(" after validation", "").replace("a valid tuple", "a list")
        reason = f"must {plain}"
    if details["type"] == "literal_error":
        reason = re.sub(r"<[\w.]+: ('[^']*')>", r"\1", reason)  # a member of an enum
        reason += did_you_mean(details["input"], re.findall(r"'([^']+)'", reason))
    value = f"{place}={shown(details['input'])}" if place else shown(details["input"])
    return InputError(f"{value}: it {reason}")


def _place(details: ErrorDetails, where: str) -> str:
    """Return the dotted name of a value; pydantic's words for alternatives are left out."""
    text = where
    for part in details["loc"]:
        if isinstance(part, int):
            text += f"[{part}]"
        elif all(name.isidentifier() for name in part.split(".")):
            text += f".{part}" if text else part
    return text


def _names(hint: Any, loc: tuple[int | str, ...]) -> list[str]:
    """Return the fields of the model at a place in a value of a type."""
    if not hasattr(hint, "model_fields"):
        return next(filter(None, (_names(of, loc) for of in typing.get_args(hint))), [])
    fields: Mapping[str, Any] = hint.model_fields
    for i, part in enumerate(loc):
        if part in fields:
            return _names(fields[str(part)].annotation, loc[i + 1 :])
    return [*fields]
