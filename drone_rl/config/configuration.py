"""Settings and changes to them as arguments of functions, and the settings of resumed runs."""

import dataclasses
import functools
import inspect
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import pydantic

from drone_rl.config import TASKS, DynamicsSettings
from drone_rl.utils.errors import InputError, did_you_mean, shown
from drone_rl.utils.schema import Annotation
from drone_rl.utils.settings import Settings

S = TypeVar("S", bound=Settings)


@dataclasses.dataclass(frozen=True)
class Changes(Annotation):
    """The kind of a mapping with some settings of a class, whose values are checked when applied.

    Changes of None are left out.
    """

    of: type[Settings] | None = None
    """The class; None for the settings of all tasks, and the name of one."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names that may be changed."""
        classes = TASKS.values() if self.of is None else (self.of,)
        fields = (name for cls in classes for name in cls.model_fields)
        return tuple(dict.fromkeys((*fields, "name") if self.of is None else fields))

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[dict[str, Any], pydantic.AfterValidator(self._checked)]

    def _checked(self, changes: dict[str, Any]) -> dict[str, Any]:
        own = getattr(self.of, "name", None)
        if own is not None and (name := changes.pop("name", own)) != own:
            raise InputError(
                f"name={shown(name)} would replace the task, which is {own}; give values of that "
                "task's settings"
            )
        for unknown in changes.keys() - {*self.names}:
            names, meant = ", ".join(self.names), did_you_mean(unknown, self.names)
            raise InputError(f"{unknown} is unknown; valid names: {names}{meant}")
        return {name: value for name, value in changes.items() if value is not None}


def as_changes(value: Any, where: str) -> Mapping[str, Any]:
    """Return changes of settings by name: those of a mapping, all of a settings object, or none."""
    if value is None:
        return {}
    if isinstance(value, Mapping | Settings):
        return value if isinstance(value, Mapping) else value.values()
    raise InputError(
        f"{where}={shown(value)} gives no changes; give values by name, as in "
        "task={'num_cubes': 5} or dynamics={'wind': [5, 0, 0]}"
    )


@functools.cache
def read_other_names() -> dict[str, Any]:
    """Return names of other projects' settings and commands, with ours; see `names.toml`."""
    return tomllib.loads(Path(__file__).with_name("names.toml").read_text("utf-8"))


def from_arguments(
    of: type[S], settings: S | None, changes: Mapping[str, object], function: Callable[..., Any]
) -> S:
    """Return a function's settings, the defaults if None, with its changes to them.

    `function` is the one that has these arguments; messages name its further ones.

    Raises:
        InputError: `settings` is of another class, or a change is no setting.
    """
    if not isinstance(settings, of | None):
        several = ", and several policies as a list" if isinstance(settings, str) else ""
        raise InputError(
            f"settings={shown(settings)} is no {of.__name__}; give settings by name, such as "
            f"{next(iter(of.model_fields))}=...{several}"
        )
    base = of() if settings is None else settings
    parameters = inspect.signature(function).parameters.values()
    others = [p.name for p in parameters if p.kind is inspect.Parameter.KEYWORD_ONLY]
    for name in changes:
        if name not in of.model_fields:
            raise InputError(_unknown(name, changes[name], of, others))
    return base.replace(**changes)


def _unknown(name: str, value: object, of: type[Settings], others: Sequence[str]) -> str:
    """Return the message about a name that is no setting, with the one that is meant."""
    for group, inside in {"task": Changes(), "dynamics": Changes(DynamicsSettings)}.items():
        if group in others and name in inside.names:
            return f"{name} is a setting of {group}; give {group}={{{name!r}: {shown(value)}}}"
    names = [*of.model_fields, *others]
    synonyms = read_other_names()["settings"].get(name.lower(), ())
    for meant in (name, *(synonym.rpartition(".")[2] for synonym in synonyms)):
        for field, info in of.model_fields.items():
            if meant in getattr(type(info.default), "model_fields", ()):
                part = type(info.default)
                place = f"{field}={part.__module__}.{part.__name__}({meant}=...)"
                return f"{name} is unknown; did you mean {place}?"
        if hint := did_you_mean(meant, names):
            return f"{name} is unknown; valid names: {', '.join(names)}{hint}"
    return f"{name} is unknown; valid names: {', '.join(names)}"


TaskChanges = Annotated[Mapping[str, Any], Changes()]
DynamicsChanges = Annotated[Mapping[str, Any], Changes(DynamicsSettings)]


def check_same_config(
    saved: Mapping[str, Any], now: Mapping[str, Any], may_change: Iterable[str]
) -> None:
    """Raise an `InputError` if a resumed run or sweep has other settings than at its start.

    `may_change` are dotted keys, and groups of them, that don't change what is learned.
    """
    allowed = tuple(may_change)
    before, after = _flatten(saved), _flatten(now)
    for key in sorted(before.keys() | after.keys()):
        if any(key == name or key.startswith(f"{name}.") for name in allowed):
            continue
        old, new = before.get(key, "absent"), after.get(key, "absent")
        if old != new:
            raise InputError(
                f"can't resume with {key}={new}: the run was started with {key}={old}; "
                "leave it as it was or start a new run"
            )


def _flatten(config: Any, prefix: str = "") -> dict[str, Any]:
    if isinstance(config, Mapping) and config:
        return {
            k: v
            for name, value in config.items()
            for k, v in _flatten(value, f"{prefix}{name}.").items()
        }
    is_list = isinstance(config, Mapping | list | tuple)
    return {prefix.removesuffix("."): [*config] if is_list else config}
