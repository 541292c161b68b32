"""`drone-rl COMMAND --help`, and the choices of configuration groups."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from drone_rl.utils.errors import InputError

_KNOB = re.compile(r"(?P<indent> *)(?P<name>[A-Za-z_]\w*):(?= |$)")
_NOT_SHOWN = ("hydra", "paths")
"""Groups without choices for users."""
_EXAMPLES = """\
examples
  drone-rl train seed=1 optimizer.lr=2e-3        change settings
  drone-rl train experiment=smoke                a ready-made set of settings
  drone-rl train -m seed=0,1,2                   several runs, side by side
  drone-rl evaluate policy=latest                evaluate the newest policy"""


def show_help(command: str, conf: Path, overrides: Sequence[str]) -> None:
    """Print the settings of a command, the name of a file in `conf`, with their values."""
    typed = [o for o in overrides if not o.startswith("-")]
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf), version_base="1.3"):
        config = compose(command, typed, return_hydra_config=True)
    choices = config.hydra.runtime.choices
    chosen = {k: v for k, v in choices.items() if "/" not in k and "@" not in k}
    values: Any = OmegaConf.to_container(config, resolve=False)
    del values["hydra"]
    print(f"drone-rl {command.replace('_', '-')} [setting=value ...]\n")
    print((conf / f"{command}.yaml").read_text().split("\ndefaults:")[0], end="\n\n")
    groups = {g: sorted(p.stem for p in (conf / g).glob("*.yaml")) for g in chosen}
    lines = [f"  {g}: {', '.join(f)}" for g, f in groups.items() if f and g not in _NOT_SHOWN]
    if lines:
        print("Groups, each chosen by the name of a file:", *lines, "", sep="\n")
    print("Settings, as they would be used now:")
    for line in explained(values, comments(command, conf, chosen)):
        print(f"  {line}")
    print(f"\n{_EXAMPLES}")


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
            shown = yaml.safe_dump(value, default_flow_style=True, width=1000)
            yield f"{indent}{name}: {shown.splitlines()[0]}"


def comments(command: str, conf: Path, chosen: dict[str, str | None]) -> dict[str, str]:
    """Return the comment of each setting of a command by its dotted name.

    `command` is the name of its file in `conf`, `chosen` the file of each group.
    """
    found = {"plugins": "Modules that register parts of your own: networks, transforms and so on."}
    moved = read_comments(conf / "dynamics" / "computer_vision.yaml")
    found |= {f"dynamics.{key}": text for key, text in moved.items()}
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
        knob = _KNOB.match(line)
        if line.lstrip().startswith("#"):
            above.append(line.strip().lstrip("#").strip())
        elif knob and knob["name"] != "defaults":
            where = [*where[: len(knob["indent"]) // 2], knob["name"]]
            if above:
                found[".".join(where)] = "\n".join(above)
            above = []
        else:
            above = []
    return found


def _with_parents(path: Path) -> Iterator[Path]:
    """The files of its defaults list, recursively, and the file."""
    if not path.is_file():
        return
    for entry in (yaml.safe_load(path.read_text()) or {}).get("defaults", ()):
        if isinstance(entry, str) and entry != "_self_":
            yield from _with_parents(path.with_name(f"{entry}.yaml"))
    yield path


SCHEMA = "base_"
"""Prefix of schemas' names, see `drone_rl.cli.hydra.composition`."""
_NOT_FOUND = re.compile(
    r"Could not find '(?P<what>[^']+)' Available options in '[^']+': (?P<all>.*)"
)
_SEARCH_PATH = re.compile(r" ?Config search path: .*")
_OWN_FOLDERS = ("--config-dir", "-cd", "hydra.searchpath")
"""Options that add folders of the user."""


def check_choices(overrides: Sequence[str], conf: Path) -> None:
    """Raise an `InputError` for a schema or unknown sweep as a choice, which Hydra accepts."""
    has_own = any(override.startswith(_OWN_FOLDERS) for override in overrides)
    for override in overrides:
        key, _, value = override.partition("=")
        group = key.lstrip("+").partition("@")[0]
        if not (conf / group).is_dir() or group.startswith((".", "/")) or not group:
            continue
        names = [name.strip() for name in value.split(",")]
        wrong = [name for name in names if name.startswith(SCHEMA)]
        if group == "sweep" and not has_own:
            wrong += [
                n for n in names if n != "null" and not (conf / group / f"{n}.yaml").is_file()
            ]
        if wrong:
            offered = sorted(path.stem for path in (conf / group).glob("*.yaml"))
            raise InputError(_message(f"{group}/{wrong[0]}", offered))


def without_schemas(text: str) -> str:
    """Remove schemas and the search path from a message of Hydra."""
    text = _SEARCH_PATH.sub("", text)
    found = _NOT_FOUND.search(text)
    if found is None:
        return text
    offered = [name for name in found["all"].split() if not name.startswith(SCHEMA)]
    return _message(found["what"], offered)


def _message(what: str, offered: Sequence[str]) -> str:
    group, _, name = what.rpartition("/")
    return f"could not find {what} ({group}={name}); give one of: {', '.join(offered)}"
