"""Compose a command's settings from a command line with Hydra, and run the command."""

import contextlib
import functools
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import hydra
from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.utils import run_job
from hydra.errors import HydraException
from hydra.experimental.callback import Callback
from hydra.types import HydraContext, RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from drone_rl.cli.hydra.help import next_steps, show_help
from drone_rl.cli.hydra.messages import input_error, is_output_closed, one_line
from drone_rl.cli.hydra.mistakes import OPTIONS, check_words, composed, explain
from drone_rl.cli.hydra.resuming import spare_run
from drone_rl.cli.settings import CommandSettings
from drone_rl.config import (
    TASKS,
    ActionSettings,
    AppearanceSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.commands import PathsSettings, ProvableSettings
from drone_rl.config.configuration import Changes
from drone_rl.config.inputs import PIXELS, Input
from drone_rl.config.learning import Collector, Objective, Optimizer, Returns, Scheduler
from drone_rl.config.networks import Network
from drone_rl.config.parts import Part
from drone_rl.config.training import CloningSettings, Logger, TrainerSettings
from drone_rl.config.transforms import Transform
from drone_rl.sweeps.manifest import is_sweep, path_argument
from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import OUTPUT_CLOSED, USER_ERROR
from drone_rl.utils.plugins import IMPORTED, failure, import_plugin, line_of
from drone_rl.utils.progress import Heartbeat
from drone_rl.utils.settings import S, Settings, conf_dir, hints_of, inner_types, plain

GROUPS: dict[str, tuple[type[Settings], str]] = {
    "appearance": (AppearanceSettings, "minimal"),
    "dynamics": (DynamicsSettings, "computer_vision"),
    "actions": (ActionSettings, "moves"),
    "camera": (CameraSettings, "small"),
    "trainer": (TrainerSettings, "default"),
    "cloning": (CloningSettings, "default"),
    "provable": (ProvableSettings, "default"),
    "paths": (PathsSettings, "default"),
}
"""Groups of settings, with the name of the choice that has their defaults."""
PARTS: dict[str, type[Part]] = {
    "network": Network,
    "returns": Returns,
    "objective": Objective,
    "optimizer": Optimizer,
    "scheduler": Scheduler,
    "collector": Collector,
}
"""Groups whose choices are the variants of a part."""
SEVERAL: dict[str, type[Part]] = {"transforms": Transform, "logger": Logger}
"""Groups whose files name several variants, each by `schema@<name>: <the variant's name>`."""
CHOSEN: dict[str, tuple[type[Part], str]] = {"inputs": (Input, PIXELS)}
"""Groups of which several variants are chosen, each under its name, with the default one."""
_LARGEST_WHOLE = 10**15


def store_defaults(commands: Mapping[str, type[CommandSettings]]) -> None:
    """Give Hydra the defaults of commands, by their names with "_", and of all groups.

    Files of conf/ hold presets that differ from them. Parts and tasks of plugins are choices, too.
    """
    store = ConfigStore.instance().store
    for group, (settings, choice) in GROUPS.items():
        store(group=group, name=choice, node=settings().config())
    for name, task in TASKS.items():
        store(group="task", name=name, node=task().config())
    for group, part in {**PARTS, **SEVERAL}.items():
        for name, variant in part.registry.items():
            needs: Mapping[str, Part] = getattr(variant, "needs", {}) if part is Objective else {}
            chosen = [{f"override /{g}@_global_.{g}": need.name} for g, need in needs.items()]
            within = f"{group}/schema" if group in SEVERAL else group
            store(group=within, name=name, node={"defaults": chosen, **variant().config()})
    for group, (part, _) in CHOSEN.items():
        for name, variant in part.registry.items():
            store(group=group, name=name, node=variant().config(), package=f"{group}.{name}")
    for name, command in commands.items():
        groups, values = _defaults_of(command)
        has_file = (conf_dir() / f"{name}.yaml").is_file()  # which lists the groups
        listed = [{group: choice} for group, choice in groups.items()]
        defaults = [] if has_file else ["_self_", *listed, {"hydra": "default"}]
        store(name="base_" * has_file + name, node={"defaults": defaults, **values})


def _defaults_of(command: type[CommandSettings]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the choice of each group of a command, and its other values."""
    groups: dict[str, Any] = {}
    values: dict[str, Any] = {"plugins": []}
    for name, value in command():
        (kind, *_) = inner_types(hints_of(command)[name])
        if name in CHOSEN:
            groups[name] = [CHOSEN[name][1]]
        if name in GROUPS:
            groups[name] = GROUPS[name][1] if isinstance(value, Settings) else None
        if isinstance(kind, Changes):
            groups[name], values[name] = None, dict.fromkeys(kind.names)
        elif name in SEVERAL or name in CHOSEN:
            values[name] = {}  # without a choice, as in transforms=[], there are none
        elif groups.get(name) is None and name not in ("task", *PARTS):
            values[name] = plain(value)
    return groups, values


def import_plugins(overrides: Sequence[str]) -> list[str]:
    """Import what `plugins=[MODULE, FILE.py, ...]` names on a command line, and none from files.

    Returns:
        The command line with absolute paths, which other folders and processes can use.

    Raises:
        InputError: See `import_plugin`.
    """
    words = [*overrides]
    for i, word in enumerate(words):
        if re.match(r"\+{0,2}plugins=", word):
            override = OverridesParser.create().parse_override(word)
            if override.is_sweep_override():
                raise InputError(f"{word} is no list; give plugins=[MODULE,FILE.py]")
            value: Any = override.value()
            names = value if isinstance(value, list) else [value] if value else []
            plugins = [path_argument(Path(import_plugin(str(name)))) for name in names]
            words[i] = f"{word.partition('=')[0]}=[{','.join(plugins)}]"
    return words


def adding(words: Sequence[str]) -> list[str]:
    """Let words add entries to a task's mappings, such as rewards, which take any name."""
    mappings = tuple(
        f"task.{name}."
        for task in TASKS.values()
        for name, value in task()
        if isinstance(value, Mapping)
    )
    return [f"++{word}" if word.startswith(mappings) else word for word in words]


def run_command(name: str, command: type[CommandSettings], overrides: Sequence[str]) -> int:
    """Compose the settings of one command and run it; return the exit status.

    `name` is that of its file in conf/. `command.prepare` translates the overrides first.
    """
    is_help = bool({"--help", "-h"} & set(overrides))
    topics = [word for word in overrides if is_help and re.fullmatch(r"[A-Za-z_][\w.]*", word)]
    words = [word for word in overrides if word not in topics]
    with _explained(name, words):
        words = import_plugins(words)
    words = adding(spare_run(command.prepare(words)))
    words.sort(key=lambda word: word not in OPTIONS)  # Hydra needs options before settings
    store_defaults({name: command})
    check_words(name, words)
    if is_help:
        with _explained(name, words):
            show_help(name, words, command, topics)
        return 0
    statuses: list[int] = []
    job = _job(name, command, statuses, words)
    argv = sys.argv
    sys.argv = [f"drone-rl {name.replace('_', '-')}", *words]
    try:
        with _explained(name, words):
            if is_sweep(words) or not _run_once(name, job, words):
                hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name=name)(job)()
    finally:
        sys.argv = argv
    return max(statuses, default=0)


def _run_once(name: str, job: Callable[[DictConfig], object], words: Sequence[str]) -> bool:
    """Run a job as `hydra.main` does, which composes its settings twice.

    Return False, without a run, if the user's own files contain callbacks or select a sweep.
    """
    config = composed(name, words)
    if config.hydra.callbacks or config.hydra.mode not in (None, RunMode.RUN):
        return False
    unused: Any = Callback()  # a base class without actions
    context = HydraContext(config_loader=unused, callbacks=unused)
    done = run_job(job, config, "hydra.run.dir", None, context)
    _ = done.return_value  # raises the job's error
    return True


@contextlib.contextmanager
def _explained(name: str, words: Sequence[str]) -> Iterator[None]:
    """Raise an `InputError` for settings that Hydra, OmegaConf or PyYAML rejects."""
    try:
        yield
    except (HydraException, OmegaConfBaseException, YAMLError) as error:
        if input_error(error) is not None:
            raise
        raise explain(error, name, words) from error


def read_settings(cls: type[S], config: DictConfig) -> S:
    """Resolve composed settings and check them as those of a command."""
    values: Any = _whole_numbers(OmegaConf.to_container(config, resolve=True))
    values.pop("plugins", None)
    return cls.read(values)


def _whole_numbers(value: Any) -> Any:
    """Return values with numbers such as 1e5, which Hydra reads as floats, as whole ones."""
    if isinstance(value, dict):
        return {name: _whole_numbers(item) for name, item in value.items()}
    if isinstance(value, list):
        return [*map(_whole_numbers, value)]
    is_whole = isinstance(value, float) and value.is_integer() and abs(value) < _LARGEST_WHOLE
    return int(value) if is_whole else value


def _job(
    name: str, command: type[CommandSettings], statuses: list[int], overrides: Sequence[str] = ()
) -> Callable[[DictConfig], object]:
    """Return the function that Hydra calls for each run."""
    plugins = [o for o in overrides if o.lstrip("+").startswith("plugins=")]

    def job(config: DictConfig) -> object:
        try:
            with _explained(name, overrides):
                settings = read_settings(command, config)
            folder = Path(HydraConfig.get().runtime.output_dir)
            settings = settings.with_policy_of_now(folder)
            with Heartbeat() if settings.ends_alone() else contextlib.nullcontext():
                status, value = settings.run(folder)
            if status < 128 and sys.stdout.isatty():  # pipes get only the results
                print(next_steps(name.replace("_", "-"), settings.used_policy(folder), IMPORTED))
        except Exception as error:  # a failed run of a sweep does not stop the others
            status, value = USER_ERROR, None
            if isinstance(error, BrokenPipeError) and is_output_closed():
                status = OUTPUT_CLOSED  # Hydra would print an error that is raised again
            elif isinstance(error, InputError | OSError):
                print(f"error: {one_line(error)}", file=sys.stderr)
            elif plugins and line_of(error):
                print(f"error: {failure(plugins[-1], error)}", file=sys.stderr)
            else:
                raise
        statuses.append(status)
        if status > 128:  # a signal ends a whole sweep, not one run of it
            sys.exit(status)
        return value

    job.__module__ = f"drone_rl.cli.{name}"  # Hydra names the job by it
    vars(job)["statuses"] = statuses  # launchers append the statuses of other processes
    vars(job)["check"] = functools.partial(read_settings, command)  # they call it before any run
    return job
