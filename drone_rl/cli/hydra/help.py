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
from drone_rl.cli.hydra.mistakes import composed, flattened, similar
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
    values: Any = OmegaConf.to_container(config, resolve=False)
    del values["hydra"]
    selected = {g: c for g, c in config.hydra.runtime.choices.items() if "@" not in g}
    files = {g: sorted(path.stem for path in (conf / g).glob("*.yaml")) for g in selected}
    groups = {g: names for g, names in files.items() if names and g not in _NOT_SHOWN}
    keys = [*(group for group in groups if group not in values), *flattened(values)]
    meanings = comments(command, conf, {g: c for g, c in selected.items() if "/" not in g})
    meanings |= {g: f"One of: {', '.join(names)}." for g, names in groups.items()}
    meanings["hydra.run.dir"] = _RUN_FOLDER
    name = command.replace("_", "-")
    print(f"drone-rl {name} [setting=value ...]\n")
    print((conf / f"{command}.yaml").read_text().split("\ndefaults:")[0], end="\n\n")
    if not topics:
        print(f"Most used settings, with their values (drone-rl {name} --help all lists all):")
        keys = TABLE[name]["settings"]
    else:
        print("Settings, as they would be used now:")
        if "all" not in topics:
            keys = [key for topic in topics for key in _about(topic, keys, f"drone-rl {name}")]
    for key in keys:
        value = selected[key] if key in groups else _inside(values, key)
        meaning = " ".join(meanings.get(key, "").split())
        if not isinstance(value, dict) or not value:
            text = "FOLDER" if key == "hydra.run.dir" else _value(value)
            text = text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."
            unit = _unit(settings, key.split("."))
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


def next_steps(name: str, policy: str, folder: Path, plugins: Sequence[str] = ()) -> str:
    """Return the lines about the policy that a command used, and what a user may do next."""
    quoted = {"policy": shlex.quote(policy), "folder": shlex.quote(str(folder))}
    files = re.compile(r"\{folder\}/([\w.]+)")
    if plugins:
        override = f"plugins=[{','.join(dict.fromkeys(plugins))}]"
        quoted["policy"] += f" {shlex.quote(override)}"
    possible = [
        line
        for line in TABLE[name]["next"]
        if all((folder / f).exists() for f in files.findall(line))
    ]
    lines = ["next:", *(f"  {line.format(**quoted)}" for line in possible)] if possible else []
    if any("{policy}" in line for line in possible):
        lines.insert(0, f"policy: {policy}")
    return "\n".join(lines)


def _inside(values: Any, key: str) -> Any:
    """Return the value of a dotted name; None if there is none."""
    for name in key.split("."):
        values = (values or {}).get(name)
    return values


def _value(value: Any) -> str:
    """Return a value as YAML on one line."""
    return yaml.safe_dump(value, default_flow_style=True, width=1000).splitlines()[0]


def _unit(settings: Any, path: Sequence[str]) -> str:
    """Return the unit of a setting, empty if it has none."""
    kind: Any = kinds_of(settings).get(path[0])
    if path[1:]:
        inside = getattr(kind, "of", None)
        is_settings = isinstance(inside, type) and issubclass(inside, Settings)
        return _unit(inside, path[1:]) if is_settings else ""
    return getattr(getattr(kind, "kind", kind), "unit", "")


def comments(command: str, conf: Path, selected: dict[str, str | None]) -> dict[str, str]:
    """Return the comment of each setting of a command by its dotted name.

    `command` is the name of its file in `conf`, `selected` the file of each group.
    """
    texts = {"plugins": "Modules that register parts of your own: networks, transforms and so on."}
    dynamics = read_comments(conf / "dynamics" / "computer_vision.yaml")
    texts |= {f"dynamics.{key}": text for key, text in dynamics.items()}
    tasks = conf / "task"
    for path in [*sorted(tasks.glob("*.yaml")), tasks / "collect_cubes.yaml"]:  # the last one wins
        texts |= {f"task.{key}": text for key, text in read_comments(path).items()}
    for group, name in selected.items():
        for path in _with_parents(conf / group / f"{name}.yaml"):
            texts |= {f"{group}.{key}": text for key, text in read_comments(path).items()}
    return texts | read_comments(conf / f"{command}.yaml")


def read_comments(path: Path) -> dict[str, str]:
    """Return the comment above each setting of one file by its dotted name."""
    texts, above, where = {}, [], []
    for line in path.read_text().splitlines():
        setting = _SETTING.match(line)
        if line.lstrip().startswith("#"):
            above.append(line.strip().lstrip("#").strip())
        elif setting and setting["name"] != "defaults":
            where = [*where[: len(setting["indent"]) // 2], setting["name"]]
            if above:
                texts[".".join(where)] = "\n".join(above)
            above = []
        else:
            above = []
    return texts


def _with_parents(path: Path) -> Iterator[Path]:
    """Yield the files in a file's defaults list, recursively, then the file itself."""
    if not path.is_file():
        return
    for entry in (yaml.safe_load(path.read_text()) or {}).get("defaults", ()):
        if isinstance(entry, str) and entry != "_self_":
            yield from _with_parents(path.with_name(f"{entry}.yaml"))
    yield path
