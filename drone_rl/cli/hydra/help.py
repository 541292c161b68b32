"""`drone-rl COMMAND --help`: print settings and examples."""

import re
import shlex
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from omegaconf import OmegaConf

from drone_rl.cli.commands import TABLE
from drone_rl.cli.hydra.names import closest, composed, flattened
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings, kinds_of

_SETTING = re.compile(r"(?P<indent> *)(?P<name>[A-Za-z_]\w*):(?= |$)")
_NOT_SHOWN = ("hydra", "paths")
"""Groups without choices for users."""
_WIDTH = 100
_LONGEST_VALUE = 60
_RUN_FOLDER = "Folder of this command's files; a new one under outputs/ by default."


def show_help(
    command: str,
    conf: Path,
    overrides: Sequence[str],
    settings: type[Settings],
    topics: Sequence[str] = (),
) -> None:
    """Print the most used settings of a command, or those that `topics` names, and examples.

    `command` is the name of its file in `conf`; `settings` is its class. "all" is all settings.

    Raises:
        InputError: There is no setting and no group of settings of a name.
    """
    typed = [o for o in overrides if "=" in o or o.startswith("~")]
    config = composed(command, conf, typed)
    choices = config.hydra.runtime.choices
    chosen = {k: v for k, v in choices.items() if "/" not in k and "@" not in k}
    values: Any = OmegaConf.to_container(config, resolve=False)
    del values["hydra"]
    meanings = comments(command, conf, chosen)
    groups = {g: sorted(p.stem for p in (conf / g).glob("*.yaml")) for g in chosen}
    groups = {g: names for g, names in groups.items() if names and g not in _NOT_SHOWN}
    name = command.replace("_", "-")
    print(f"drone-rl {name} [setting=value ...]\n")
    print((conf / f"{command}.yaml").read_text().split("\ndefaults:")[0], end="\n\n")
    if topics:
        if "all" not in topics:
            values = _chosen({g: chosen[g] for g in groups} | values, topics, f"drone-rl {name}")
            groups = {g: names for g, names in groups.items() if g in values}
        if groups:
            lines = [f"  {g}: {', '.join(names)}" for g, names in groups.items()]
            print("Groups, each chosen by the name of a file:", *lines, "", sep="\n")
        print("Settings, as they would be used now:")
        for line in explained(values, meanings):
            print(f"  {line}")
    else:
        print(f"Most used settings, with their values (drone-rl {name} --help all lists all):")
        meanings |= {g: f"One of: {', '.join(names)}." for g, names in groups.items()}
        meanings["hydra.run.dir"] = _RUN_FOLDER
        for key in TABLE[name]["settings"]:
            value = chosen[key] if key in chosen else OmegaConf.select(config, key)
            shown = "FOLDER" if key == "hydra.run.dir" else _value(value)
            unit = _unit(settings, key.split("."))
            shown = shown if len(shown) <= _LONGEST_VALUE else f"{shown[:_LONGEST_VALUE]}..."
            print(f"  {key}={shown}" + (f"  ({unit})" if unit else ""))
            text = " ".join(meanings.get(key, "").split())
            print(textwrap.indent(textwrap.fill(text, _WIDTH - 6), " " * 6))
    print("\nexamples")
    for line, purpose in TABLE[name]["examples"]:
        print(f"  {line:<55}  {purpose}")


def _chosen(values: Any, topics: Sequence[str], command: str) -> dict[str, Any]:
    """Return the settings, and groups of them, whose names are most like those of topics."""
    found: dict[str, Any] = {}
    for topic in topics:
        key = closest(topic, [*flattened(values)])
        if key is None or "=" in key:
            raise InputError(f"{command} has no setting {topic}; {command} --help all lists all")
        *groups, last = key.split(".")
        source, target = values, found
        for group in groups:
            source, target = source[group], target.setdefault(group, {})
        target[last] = source[last]
    return found


def next_steps(name: str, policy: str, folder: Path, plugins: Sequence[str] = ()) -> str:
    """Return the lines about the policy that a command used, and what a user may do next."""
    quoted = {"policy": shlex.quote(policy), "folder": shlex.quote(str(folder))}
    files = re.compile(r"\{folder\}/([\w.]+)")
    every = TABLE[name]["next"]
    known = [line for line in every if all((folder / f).exists() for f in files.findall(line))]
    named = shlex.quote(f"plugins=[{','.join(dict.fromkeys(plugins))}]") if plugins else ""
    more = [f" {named}" if named and "{policy}" in line else "" for line in known]
    steps = [f"  {line.format(**quoted)}{end}" for line, end in zip(known, more, strict=True)]
    is_used = any("{policy}" in line for line in known)
    lines = [f"policy: {policy}"] if is_used else []
    return "\n".join([*lines, *(["next:", *steps] if steps else [])])


def _value(value: Any) -> str:
    """Return a value as YAML on one line."""
    plain = OmegaConf.to_container(value) if OmegaConf.is_config(value) else value
    return yaml.safe_dump(plain, default_flow_style=True, width=1000).splitlines()[0]


def _unit(settings: Any, path: Sequence[str]) -> str:
    """Return the unit of a setting, empty if it has none."""
    kind: Any = kinds_of(settings).get(path[0])
    if path[1:]:
        inside = getattr(kind, "of", None)
        is_settings = isinstance(inside, type) and issubclass(inside, Settings)
        return _unit(inside, path[1:]) if is_settings else ""
    return getattr(getattr(kind, "kind", kind), "unit", "")


def explained(values: Any, meanings: dict[str, str], prefix: str = "") -> Iterator[str]:
    """Yield settings as lines of YAML, each below its comment."""
    indent = "  " * prefix.count(".")
    for name, value in values.items():
        if name == "_target_":
            continue
        meaning = meanings.get(prefix + name)
        if meaning:
            yield from (f"{indent}# {line}" for line in meaning.splitlines())
        if isinstance(value, dict) and value:
            yield f"{indent}{name}:"
            yield from explained(value, meanings, f"{prefix}{name}.")
        else:
            yield f"{indent}{name}: {_value(value)}"


def comments(command: str, conf: Path, chosen: dict[str, str | None]) -> dict[str, str]:
    """Return the comment of each setting of a command by its dotted name.

    `command` is the name of its file in `conf`, `chosen` the file of each group.
    """
    found = {"plugins": "Modules that register parts of your own: networks, transforms and so on."}
    dynamics = read_comments(conf / "dynamics" / "computer_vision.yaml")
    found |= {f"dynamics.{key}": text for key, text in dynamics.items()}
    tasks = conf / "task"
    for path in [*sorted(tasks.glob("*.yaml")), tasks / "collect_cubes.yaml"]:  # the last one wins
        found |= {f"task.{key}": text for key, text in read_comments(path).items()}
    for group, name in chosen.items():
        for path in _with_parents(conf / group / f"{name}.yaml"):
            found |= {f"{group}.{key}": text for key, text in read_comments(path).items()}
    return found | read_comments(conf / f"{command}.yaml")


def read_comments(path: Path) -> dict[str, str]:
    """Return the comment above each setting of one file by its dotted name."""
    found, above, where = {}, [], []
    for line in path.read_text().splitlines():
        setting = _SETTING.match(line)
        if line.lstrip().startswith("#"):
            above.append(line.strip().lstrip("#").strip())
        elif setting and setting["name"] != "defaults":
            where = [*where[: len(setting["indent"]) // 2], setting["name"]]
            if above:
                found[".".join(where)] = "\n".join(above)
            above = []
        else:
            above = []
    return found


def _with_parents(path: Path) -> Iterator[Path]:
    """Yield the files in a file's defaults list, recursively, then the file itself."""
    if not path.is_file():
        return
    for entry in (yaml.safe_load(path.read_text()) or {}).get("defaults", ()):
        if isinstance(entry, str) and entry != "_self_":
            yield from _with_parents(path.with_name(f"{entry}.yaml"))
    yield path
