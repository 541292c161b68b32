"""`drone-rl COMMAND --help`: print settings and examples."""

import shlex
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from omegaconf import OmegaConf

from drone_rl.cli.commands import TABLE
from drone_rl.cli.hydra.mistakes import choices, composed, flattened, similar
from drone_rl.cli.settings import CommandSettings
from drone_rl.config import TASKS
from drone_rl.config.configuration import Changes
from drone_rl.config.inputs import InputsByName
from drone_rl.config.parts import Named, Parts
from drone_rl.config.terms import Terms
from drone_rl.sweeps.manifest import path_argument
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import (
    Settings,
    about,
    hints_of,
    inner_types,
    meanings,
    unit_of,
)

_WIDTH = 100
_LONGEST_VALUE = 60
_PLUGINS = "Modules and Python files with parts of your own: networks, transforms and so on."
_RUN_FOLDER = "Folder of this command's files; a new one under outputs/ by default."


def show_help(
    command: str,
    overrides: Sequence[str],
    settings: type[CommandSettings],
    topics: Sequence[str] = (),
) -> None:
    """Print the settings and groups of a command, or what `topics` names, and examples.

    `command` is its name with "_", `settings` its class. The topic "all" is all settings.

    Raises:
        InputError: There is no setting and no group of settings of a name.
    """
    typed = [o for o in overrides if "=" in o or o.startswith("~")]
    config = composed(command, typed)
    values: Any = OmegaConf.to_container(config, resolve=False)
    del values["hydra"]
    selected = {g: c for g, c in config.hydra.runtime.choices.items() if "@" not in g}
    names = {g: [n for n in choices(g) if n != "basic"] for g in selected}
    groups = {g: names[g] for g in names if len(names[g]) > 1 and g != "hydra"}
    keys = [*flattened(values), *(g for g in groups if g not in values), "hydra.run.dir"]
    described = {key: (text, unit) for key, text, unit in _described(settings, values)}
    described |= {g: (f"One of: {', '.join(names)}.", "") for g, names in groups.items()}
    described |= {"hydra.run.dir": (_RUN_FOLDER, ""), "plugins": (_PLUGINS, "")}
    name = command.replace("_", "-")
    print(f"drone-rl {name} [setting=value ...]\n\n{settings.description()}\n")
    if not topics:
        print(f"Settings, with their values; drone-rl {name} --help GROUP lists those of a group:")
        keys = [key for key in keys if "." not in key or key == "hydra.run.dir"]
    else:
        print("Settings, as they would be used now:")
        if "all" not in topics:
            keys = [key for topic in topics for key in _about(topic, keys, f"drone-rl {name}")]
    for key in keys:
        value = selected[key] if key in groups else _inside(values, key)
        meaning, unit = described.get(key, ("", ""))
        if not isinstance(value, dict) or not value:
            text = "FOLDER" if key == "hydra.run.dir" else _value(value)
            text = text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."
            print(f"  {key}={text}" + (f"  ({unit})" if unit else ""))
        elif meaning:
            print(f"  {key}")
        print(
            textwrap.indent(textwrap.fill(meaning, _WIDTH - 6), " " * 6), end="\n" * bool(meaning)
        )
    print("\nexamples")
    for line, purpose in TABLE[name]["examples"]:
        print(f"  {line:<55}  {purpose}")


def _about(topic: str, keys: Sequence[str], command: str) -> list[str]:
    """Return the setting that is most like a topic, and the settings inside it."""
    setting = next((name for name in similar(topic, keys) if name in keys), None)
    if setting is None:
        raise InputError(f"{command} has no setting {topic}; {command} --help all lists all")
    return [key for key in keys if f"{key}.".startswith(f"{setting}.")]


def next_steps(name: str, policy: str, plugins: Sequence[str] = ()) -> str:
    """Return the lines about the policy that a command used, and what a user may do next."""
    words = [f"policy={policy}"]
    if plugins:
        words.append(f"plugins=[{','.join(path_argument(Path(plugin)) for plugin in plugins)}]")
    following = TABLE[name].get("next", ())
    lines = [f"  {shlex.join(['drone-rl', command, *words])}" for command in following]
    return "\n".join([f"policy: {policy}", "next:", *lines]) if lines else ""


def _inside(values: Any, key: str) -> Any:
    """Return the value of a dotted name; None if there is none."""
    for name in key.split("."):
        values = (values or {}).get(name)
    return values


def _value(value: Any) -> str:
    """Return a value as YAML on one line."""
    return yaml.safe_dump(value, default_flow_style=True, width=1000).splitlines()[0]


def _described(
    cls: type[Settings], values: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, str, str]]:
    """Yield the dotted name, description and unit of each setting of a class and its groups.

    `values` are composed ones, which name the variants of parts.
    """
    texts = meanings(cls)
    for name, hint in hints_of(cls).items():
        key, inside = prefix + name, values.get(name)
        yield key, texts.get(name, ""), unit_of(hint)
        if inner_types(hint)[0] == Changes():
            yield f"{key}.name", "Name of the task in which a baseline is judged.", ""
        for of, part, below in _inner(
            inner_types(hint)[0], inside if isinstance(inside, Mapping) else {}
        ):
            yield f"{key}{part}", about(of) if part else texts.get(name, ""), ""
            yield from _described(of, below, f"{key}{part}.")


def _inner(kind: Any, values: Mapping[str, Any]) -> Iterator[tuple[Any, str, Any]]:
    """Yield the classes of the settings inside one, each with its key and values."""
    if isinstance(kind, Changes):
        for of in (kind.of,) if kind.of else reversed(TASKS.values()):  # the default one wins
            yield of, "", {}
    elif isinstance(kind, Parts | Terms | InputsByName):
        by_target = isinstance(kind, InputsByName)
        of = kind.of.registry if by_target else kind.registry
        names = {name: below["_target_"] if by_target else name for name, below in values.items()}
        yield from ((of[n], f".{name}", values[name]) for name, n in names.items() if n in of)
    elif isinstance(kind, type) and issubclass(kind, Named):
        name = values.get("name", kind.default_name)
        yield from (
            (of, "", values)
            for choice, of in kind.registry.items()
            if choice == name or getattr(of, "target", None) == values.get("_target_", "")
        )
    elif isinstance(kind, type) and issubclass(kind, Settings):
        yield kind, "", values
