"""Compose a command's settings from a command line with Hydra, and run the command."""

import contextlib
import dataclasses
import functools
import importlib.util
import logging
import os
import re
import sys
import types
import typing
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import hydra
from hydra._internal.hydra import Hydra
from hydra.core import utils as hydra_utils
from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import MISSING, DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from drone_rl.cli.hydra.help import next_steps, show_help
from drone_rl.cli.hydra.messages import input_error, is_output_closed, one_line
from drone_rl.cli.hydra.mistakes import (
    check_choices,
    check_launcher,
    explain,
    explain_file,
    repeated,
)
from drone_rl.cli.hydra.resuming import spare_run
from drone_rl.cli.hydra.values import whole_numbers
from drone_rl.cli.hydra.words import check_words, sweep_flag_first
from drone_rl.cli.settings import CommandSettings
from drone_rl.config import (
    TASKS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.config.commands import PathsSettings, ProvableSettings
from drone_rl.config.configuration import Changes, Variant, from_config
from drone_rl.config.learning import Collector, Objective, Optimizer, Returns, Scheduler
from drone_rl.config.networks import Network
from drone_rl.config.training import CloningSettings, Logger, TrainerSettings
from drone_rl.config.transforms import Transform
from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import OUTPUT_CLOSED, USER_ERROR
from drone_rl.utils.plugins import IMPORTED, failure, line_of
from drone_rl.utils.progress import Heartbeat
from drone_rl.utils.schema import Kind
from drone_rl.utils.settings import Settings, conf_dir, kinds_of, plain, types_of

GROUPS: dict[str, type[Settings]] = {
    "appearance": AppearanceSettings,
    "dynamics": DynamicsSettings,
    "actions": ActionSettings,
    "camera": CameraSettings,
    "trainer": TrainerSettings,
    "cloning": CloningSettings,
    "provable": ProvableSettings,
    "paths": PathsSettings,
}
"""Groups whose files start from the schema `base_<group>`."""
_CHANGED = (DynamicsSettings,)
"""Settings that commands also accept in part, as in `dynamics.mass=2`.

Hydra merges a file of the group into such a part, so the file's schema extends that of the part.
"""
PARTS: dict[str, type[Variant]] = {
    "network": Network,
    "returns": Returns,
    "objective": Objective,
    "optimizer": Optimizer,
    "scheduler": Scheduler,
    "collector": Collector,
}
"""Groups whose files start from the schema of a variant, `base_<its name>`."""
_EXTENSIBLE = ("task", "network", "returns", "objective", "collector")
"""Groups for which modules of the user's register choices."""
SEVERAL: dict[str, type[Variant]] = {"transforms": Transform, "logger": Logger}
"""Groups whose files name several variants, each by `schema@<name>: <the variant's name>`."""

_log = logging.getLogger(__name__)
_PLUGINS = (("plugins", list[str], dataclasses.field(default_factory=list)),)
"""Modules that register parts; `import_plugins` imports them before Hydra composes."""


def register_schemas(**commands: type[Settings]) -> None:
    """Register the schemas of commands, by the names of their files, before Hydra composes.

    Parts and tasks of plugins, which have no file in conf/, become choices of their groups.
    """
    store = ConfigStore.instance()
    for task in TASKS.values():
        _store("task", "task" if task is TaskSettings else task.name, task)
    for group, settings in GROUPS.items():
        _store(group, group, settings)
    for group, part in PARTS.items():
        for variant in part.variants():
            _store(group, variant.registered_name(), variant)
    for group, part in SEVERAL.items():
        for variant in part.variants():
            name = variant.registered_name()
            store.store(group=f"{group}/schema", name=name, node=schema_of(variant))
    for command, settings in commands.items():
        store.store(name=f"base_{command}", node=schema_of(settings, _PLUGINS))


def _store(group: str, name: str, settings: type[Settings]) -> None:
    """Register the schema of a group's file; settings of a plugin are a choice themselves."""
    store = ConfigStore.instance()
    store.store(group=group, name=f"base_{name}", node=schema_of(settings))
    if not settings.__module__.startswith("drone_rl."):
        store.store(group=group, name=name, node=_choice_of(settings))


def _choice_of(cls: type[Settings]) -> type:
    """A schema with the default of each field."""
    values = cls().values()
    fields = [
        (name, _simple(hint), dataclasses.field(default_factory=lambda n=name: plain(values[n])))
        for name, hint in types_of(cls).items()
    ]
    return dataclasses.make_dataclass(f"{cls.__name__}Choice", [*_named(cls), *fields])


def import_plugins(overrides: Sequence[str]) -> None:
    """Import the modules that `plugins=[MODULE, ...]` names on a command line, and none from files.

    Raises:
        InputError: A module is not found, has the name of an installed one, or fails.
    """
    typed = [o.partition("=")[2] for o in overrides if re.match(r"\+{0,2}plugins=", o)]
    names = re.findall(r"[^\[\]\s,'\"]+", typed[-1]) if typed else []
    if names and os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())  # the end: no file here replaces an installed package
    for name in names:
        _check_module(name)
        try:
            importlib.import_module(name)
            IMPORTED.append(name)
        except ModuleNotFoundError as error:
            is_own = f"{name}.".startswith(f"{error.name}.")  # or its package
            place = "give a module in this folder or on PYTHONPATH"
            remedy = place if is_own else f"install {error.name}"
            if name.endswith(".py"):
                remedy = f"type the module's name: plugins=[{name[:-3]}]"
            raise InputError(f"plugins={name} can't be imported ({error}); {remedy}") from error
        except (Exception, SystemExit) as error:  # any that the user's module raises
            raise InputError(failure(f"plugins={name}", error, name)) from error


def _check_module(name: str) -> None:
    """Raise an `InputError` for a path, and for a file that another module has precedence over."""
    if "/" in name or name.startswith("."):
        own = Path(name).name.removesuffix(".py")
        raise InputError(
            f"plugins={name} is a path; type the module's name, plugins=[{own}], in its folder "
            "or with the folder on PYTHONPATH"
        )
    own, found = Path(f"{name}.py"), None
    if own.is_file() and name not in sys.stdlib_module_names:
        found = importlib.util.find_spec(name)
    is_other = found is not None and Path(found.origin or "").resolve() != own.resolve()
    if name in sys.stdlib_module_names or is_other:
        raise InputError(
            f"plugins={name} is a module of Python or of an installed package, which has "
            f"precedence over your {own}; rename the file"
        )


def schema_of(cls: type[Settings], further: Sequence[tuple[str, Any, Any]] = ()) -> type:
    """Return a dataclass with the same fields but no defaults, which are in conf/.

    `further` are name, type and default of further fields.
    """
    types = types_of(cls)
    fields = [(name, *_field(kind, types[name])) for name, kind in kinds_of(cls).items()]
    bases = (_optional(tuple(types.items())),) if cls in _CHANGED else ()
    name = f"{cls.__name__}Schema"
    return dataclasses.make_dataclass(name, [*_named(cls), *fields, *further], bases=bases)


@functools.cache
def _optional(types: tuple[tuple[str, Any], ...]) -> type:
    """A dataclass with these fields, each of which may be absent."""
    return dataclasses.make_dataclass("Changes", [(n, _simple(h) | None, None) for n, h in types])


def _named(cls: type[Settings]) -> list[tuple[str, Any, Any]]:
    """The field with the name of a variant or task."""
    if issubclass(cls, Variant):
        return [("_target_", str, cls.target)]
    if issubclass(cls, BaseTaskSettings) and cls is not TaskSettings:
        return [("name", str, cls.name)]
    return []


def _field(kind: Kind, hint: Any) -> tuple[Any, Any]:
    """The type of a field in OmegaConf, and its value until a file sets one."""
    if isinstance(kind, Changes):
        schema = _optional(tuple(kind.types.items()))
        return schema, dataclasses.field(default_factory=schema)
    return _simple(hint), MISSING


def _simple(hint: Any) -> Any:
    """The type itself if it consists of int, float, str and bool, else Any."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is tuple:
        return hint if set(arguments) <= {int, float, str, ...} else Any
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        inner = [argument for argument in arguments if argument is not types.NoneType]
        return hint if len(inner) == 1 and _simple(inner[0]) is not Any else Any
    return hint if hint in (int, float, str, bool) else Any


_MULTIRUN_WORDS = re.compile(r"^[-+~]|^hydra(?!\.run\.)|^sweep|^experiment")
"""Words on a command line that may start many runs, or select a group that does."""
_MULTIRUN_TEXT = re.compile(r"mode:|sweep: (?!null)")
"""Text of a command's YAML file that may start many runs."""
_save_config = hydra_utils._save_config


def run_command(name: str, command: type[CommandSettings], overrides: Sequence[str]) -> int:
    """Compose the settings of one command and run it; return the exit status.

    `name` is that of its file in conf/. `command.prepare` translates the overrides first.
    """
    is_help = bool({"--help", "-h"} & set(overrides))
    topics = [word for word in overrides if is_help and re.fullmatch(r"[A-Za-z_][\w.]*", word)]
    words = [word for word in overrides if word not in topics]
    overrides = sweep_flag_first(spare_run(command.prepare([*map(whole_numbers, words)])))
    import_plugins(overrides)
    register_schemas(**{name: command})
    check_choices(overrides, conf_dir(), _EXTENSIBLE)
    check_launcher(name, overrides)
    if "hydra.mode=RUN" not in overrides:  # else a sweep starts it
        for override in repeated(words):
            counts = f"{override.partition('=')[0]} is given several times; {override} counts"
            print(f"warning: {counts}", file=sys.stderr)
    check_words(name, conf_dir(), overrides)
    if is_help:
        with _explained(name, overrides):
            show_help(name, conf_dir(), overrides, command, topics)
        return 0
    statuses: list[int] = []
    job = _job(name, command, statuses, overrides)
    wrapped = hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name=name)(job)
    argv = sys.argv
    sys.argv = [f"drone-rl {name.replace('_', '-')}", *overrides]
    mode = Hydra.get_mode if _may_be_multirun(name, overrides) else lambda *_, **__: RunMode.RUN
    try:
        with (
            _explained(name, overrides),
            _replaced(Hydra, "get_mode", mode),
            _replaced(hydra_utils, "_save_config", _save_named),
        ):
            wrapped()
    finally:
        sys.argv = argv
    return max(statuses, default=0)


def _may_be_multirun(name: str, overrides: Sequence[str]) -> bool:
    """Return whether Hydra must determine its mode, which takes another composition of settings.

    Otherwise the mode is a single run. Hydra rejects a multirun mode in a group's file.
    """
    text = (conf_dir() / f"{name}.yaml").read_text()
    return any(map(_MULTIRUN_WORDS.search, overrides)) or bool(_MULTIRUN_TEXT.search(text))


@contextlib.contextmanager
def _explained(name: str, overrides: Sequence[str]) -> Iterator[None]:
    """Raise an `InputError` for settings that Hydra, OmegaConf or PyYAML rejects."""
    try:
        yield
    except (HydraException, OmegaConfBaseException, YAMLError) as error:
        if input_error(error) is not None:
            raise
        in_file = explain_file(error, name, conf_dir())
        raise in_file or explain(error, name, conf_dir(), overrides) from error


@contextlib.contextmanager
def _replaced(owner: Any, name: str, value: Any) -> Iterator[None]:
    """Replace an attribute temporarily."""
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)


def _save_named(cfg: DictConfig, filename: str, output_dir: Path) -> None:
    """Save a file as Hydra does; its path is part of every error."""
    try:
        _save_config(cfg, filename, output_dir)
    except OSError as error:
        path = str(error.filename or output_dir / filename)
        raise OSError(error.errno, error.strerror, path) from error


def read_settings(cls: type[Settings], config: DictConfig) -> Any:
    """Resolve composed settings and check them as those of a command."""
    values: Any = OmegaConf.to_container(config, resolve=True)
    values.pop("plugins", None)
    return from_config(cls, values)


def _mistake(error: Exception, overrides: Sequence[str]) -> str | None:
    """Return the message about a user's mistake, also in a plugin; None for any other error."""
    if isinstance(error, InputError | OSError):
        return one_line(error)
    plugins = next((o for o in overrides if o.lstrip("+").startswith("plugins=")), "")
    return failure(plugins, error) if plugins and line_of(error) else None


def _take(folder: Path, taken: set[Path]) -> None:
    if folder in taken:
        raise InputError(
            f"an earlier run has the same folder, {folder}; add ${{hydra.job.num}} to "
            "hydra.sweep.subdir"
        )
    taken.add(folder)


def _job(
    name: str, command: type[CommandSettings], statuses: list[int], overrides: Sequence[str] = ()
) -> Callable[[DictConfig], object]:
    """Return the function that Hydra calls for each run."""
    folders: set[Path] = set()

    def job(config: DictConfig) -> object:
        try:
            with _explained(name, overrides):
                settings = read_settings(command, config)
            folder = Path(HydraConfig.get().runtime.output_dir)
            _take(folder, folders)
            which = getattr(settings, "policy", None)
            is_latest = which in ("latest", ("latest",))
            if is_latest and (used := settings.used_policy(folder)) != "latest":
                _log.info("policy=latest is %s", used)
                one = used if which == "latest" else (used,)
                settings = settings.replace(policy=one)  # another may be the newest soon
            with Heartbeat() if settings.ends_alone() else contextlib.nullcontext():
                status, value = settings.run(folder)
            if status < 128 and sys.stdout.isatty():  # pipes get only the results
                used = settings.used_policy(folder)
                print(next_steps(name.replace("_", "-"), used, folder, IMPORTED))
        except Exception as error:  # a failed run of a sweep does not stop the others
            status, value = USER_ERROR, None
            if isinstance(error, BrokenPipeError) and is_output_closed():
                status = OUTPUT_CLOSED  # Hydra would print an error that is raised again
            elif (text := _mistake(error, overrides)) is None:
                raise
            else:
                print(f"error: {text}", file=sys.stderr)
        statuses.append(status)
        if status > 128:  # a signal ends a whole sweep, not one run of it
            sys.exit(status)
        return value

    job.__module__ = f"drone_rl.cli.{name}"  # Hydra names the job by it
    vars(job)["statuses"] = statuses  # launchers append the statuses of other processes
    return job
