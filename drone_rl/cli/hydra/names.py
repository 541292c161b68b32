"""The names of a command's settings: which there are, and which one was meant."""

import contextlib
import difflib
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from drone_rl.config.configuration import read_other_names
from drone_rl.utils.errors import InputError

OTHER_NAMES = read_other_names()
SCHEMA = "base_"
"""Prefix of schemas' names, see `drone_rl.cli.hydra.composition`."""
_HYDRAS_OWN = ("hydra.run.dir", "hydra.sweep.dir", "hydra.launcher.num_jobs", "hydra.verbose")


def composed(command: str, conf: Path, typed: Sequence[str]) -> DictConfig:
    """Compose the settings of a command; its name is that of a file in `conf`."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf), version_base="1.3"):
        return compose(command, [*typed], return_hydra_config=True)


def is_group(conf: Path, name: str) -> bool:
    """Return whether a name is that of a folder of choices."""
    return bool(name) and not name.startswith((".", "/")) and (conf / name).is_dir()


def choices(conf: Path, group: str) -> list[str]:
    """Return the choices of a group: names of its files, and what plugins register."""
    names = [path.name for path in (conf / group).glob("*.yaml")]
    with contextlib.suppress(OSError):  # nothing is stored in the group
        names += ConfigStore.instance().list(group)
    names = {n.removesuffix(".yaml") for n in names if n.endswith(".yaml")}
    return sorted(name for name in names if not name.startswith(SCHEMA))


def closest(name: str, known: Sequence[str]) -> str | None:
    """Return the known name that was most likely meant, or None."""
    word = name.strip().lstrip("+~").replace("-", "_").lower()
    last = word.rpartition(".")[2]
    group = word.rpartition(".")[0]

    def is_elsewhere(name: str) -> bool:
        return not name.startswith(f"{group}.")

    others = {
        other: next((n for n in sorted(names, key=is_elsewhere) if _key(n) in known), None)
        for other, names in OTHER_NAMES["settings"].items()
    }
    by_last = {key.rpartition(".")[2]: key for key in reversed(known)}
    for meant in (
        word if word in known else None,
        others.get(word),
        others.get(last),
        by_last.get(last),
    ):
        if meant:
            return meant
    if last.isdigit() or last in others:  # an index, or a name for what is absent here
        return None
    others_than_group = [key for key in known if not word.startswith(f"{key}.")]
    if near := difflib.get_close_matches(word, others_than_group, 1, 0.8):
        return near[0]
    by_last = {**{other: ours for other, ours in others.items() if ours}, **by_last}
    near = difflib.get_close_matches(last, by_last, 1, 0.75)
    return by_last[near[0]] if near else None


def _key(override: str) -> str:
    return override.partition("=")[0]


class Command:
    """A command's settings, composed when a mistake has to be explained."""

    def __init__(self, name: str, conf: Path, groups: Sequence[str] = ()) -> None:
        self.name, self.conf = name.replace("_", "-"), conf
        self.config = composed(name, conf, groups)
        chosen = self.config.hydra.runtime.choices
        self.groups = [g for g in chosen if "@" not in g and (conf / g).is_dir() and g != "hydra"]
        own: Any = OmegaConf.to_container(self.config, resolve=False)
        del own["hydra"]
        self.keys = [*flattened(own), *self.groups, *_HYDRAS_OWN]
        self.list_all = f"drone-rl {self.name} --help all lists the settings"

    def instead(self, name: str, value: str) -> str | None:
        """Return the override that was most likely meant."""
        ours = closest(name, self.keys)
        if ours is None or "=" in ours:
            return ours
        is_unknown = ours in self.groups and value not in ("", *choices(self.conf, ours))
        return None if is_unknown else f"{ours}={value or 'VALUE'}"

    def unknown(self, override: str, name: str) -> InputError:
        """Return the error about a name that this command doesn't have."""
        typed, name = name, self._of_another_choice(name) or name
        override = override.replace(typed, name, 1)
        value = override.partition("=")[2]
        text = f"{override}: drone-rl {self.name} has no setting {name}; "
        group, first = name.rpartition(".")[0], name.partition(".")[0]
        if is_group(self.conf, first) and first not in ("hydra", *self.groups, *self.keys):
            return InputError(
                f"{override}: drone-rl {self.name} can't change {first}; {self.list_all}"
            )
        if group in self.groups and self.config[group] is None:
            offered = choices(self.conf, group)
            typed = self._with_choice(group, offered, override, name)
            why = f"{group} is null, which has no settings; type {typed}"
            return InputError(f"{override}: {why} ({group} is one of {', '.join(offered)})")
        if first in self.groups and (others := self._choices_with(first, name)):
            return InputError(
                f"{override} needs {' or '.join(others)}; type {others[0]} {override}"
            )
        longer = [key for key in self.keys if key.startswith(name)] if "." in name else []
        if len(longer) > 1:
            return InputError(f"{text}did you mean one of {', '.join(longer)}? ({self.list_all})")
        ours = f"{longer[0]}={value or 'VALUE'}" if longer else self.instead(name, value)
        if ours == override or ((ours or "").startswith("task=") and "task" not in self.groups):
            return InputError(
                f"{override}: drone-rl {self.name} runs a policy in its own task; change single "
                f"settings of it, such as task.num_cubes=5 ({self.list_all})"
            )
        if ours:
            others = "" if ours.startswith(f"{group}.") else self._inside(group)
            return InputError(f"{text}did you mean {ours}? ({others or self.list_all})")
        meant = closest(name, self.keys)
        if meant is not None and meant in self.groups:
            offered = ", ".join(choices(self.conf, meant))
            return InputError(f"{text}type {meant}=NAME, one of {offered} ({self.list_all})")
        return InputError(text + (self._inside(group) or self.list_all))

    def _of_another_choice(self, name: str) -> str | None:
        """Return the setting meant by another project's name if only another choice has it."""
        meant = [_key(ours) for ours in OTHER_NAMES["settings"].get(name, ())]
        if closest(name, self.keys) is not None:
            return None
        groups = {key: key.partition(".")[0] for key in meant}
        found = (k for k, g in groups.items() if g in self.groups and self._choices_with(g, k))
        return next(found, None)

    def _with_choice(self, group: str, offered: Sequence[str], override: str, name: str) -> str:
        """Return what to type instead of a setting of a group that is null."""
        if "minimal" not in offered:
            return f"{group}=NAME {override}"
        chosen = f"{group}=minimal"
        within = Command(self.name, self.conf, [chosen])
        meant = within.instead(name, override.partition("=")[2]) or override
        return f"{chosen} {override if name in within.keys else shlex.quote(meant)}"

    def _inside(self, group: str) -> str:
        """Return the names of the settings of a group; empty if there are none."""
        inside = [k.removeprefix(f"{group}.") for k in self.keys if k.startswith(f"{group}.")]
        return f"{group} has: {', '.join(inside[:40])}" if inside else ""

    def _choices_with(self, group: str, name: str) -> list[str]:
        """Return the choices of a group, as overrides, whose files have a setting."""
        texts = {p.stem: p.read_text() for p in sorted((self.conf / group).glob("*.yaml"))}
        found = (n for n, t in texts.items() if name in flattened({group: yaml.safe_load(t) or {}}))
        return [f"{group}={n}" for n in found]


def flattened(values: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """Yield the dotted names of groups and settings."""
    for name, value in values.items():
        if not name.startswith("_"):
            yield prefix + name
            if isinstance(value, Mapping):
                yield from flattened(value, f"{prefix}{name}.")
