"""Explain a command line that a command does not accept: the word, what is wrong, the remedy."""

import contextlib
import difflib
import re
import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import yaml
from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from drone_rl.config.configuration import read_other_names
from drone_rl.sweeps.manifest import is_sweep
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.settings import conf_dir

OTHER_NAMES = read_other_names()
OPTIONS = {"-m", "--multirun", "-h", "--help"}
"""Options of Hydra that are documented; all others are refused."""
_OVERRIDE = re.compile(r"\+{0,2}[A-Za-z][\w./@-]*=.*|~[A-Za-z][\w./@-]*(=.*)?", re.DOTALL)
_EMPTY_FOLDER = re.compile(r"\+{0,2}(hydra\.(run|sweep)\.dir|paths\.\w+)=")
_LIST = re.compile(r"\[([^\[\]]*)\]")
_FOR_SWEEPS = ("hydra/launcher", "hydra/sweeper")
_EXTENSIBLE = ("task", "network", "returns", "objective", "collector")
"""Groups for which modules of the user's register choices."""
_OWN_FOLDERS = "hydra.searchpath"
"""Setting that adds folders of the user, whose files are not known here."""


def composed(command: str, overrides: Sequence[str]) -> DictConfig:
    """Compose the settings of a command; its name is with "_" for "-"."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf_dir()), job_name=command, version_base="1.3"):
        return compose(command, [*overrides], return_hydra_config=True)


def choices(group: str) -> list[str]:
    """Return the choices of a group: names of its files, and what plugins register."""
    names = [path.name for path in (conf_dir() / group).glob("*.yaml")]
    with contextlib.suppress(OSError):  # nothing is stored in the group
        names += ConfigStore.instance().list(group)
    return sorted({name.removesuffix(".yaml") for name in names if name.endswith(".yaml")})


def flattened(values: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """Yield the dotted names of groups and settings."""
    for name, value in values.items():
        if not name.startswith("_"):
            yield prefix + name
            if isinstance(value, Mapping):
                yield from flattened(value, f"{prefix}{name}.")


def check_words(name: str, words: Sequence[str]) -> None:
    """Raise an `InputError` for the first word that Hydra ignores or would misunderstand.

    These are options, unknown choices of a group, empty names of
    folders, and what only sweeps use. All other mistakes are left to Hydra.
    """
    for word in words:
        if word not in OPTIONS and (problem := _problem(word, name, words)):
            raise InputError(f"{word}: {problem}")


def _problem(word: str, name: str, words: Sequence[str]) -> str | None:
    key, _, value = word.partition("=")
    if not _OVERRIDE.fullmatch(word):
        keys, has_dashes = _names(name, words), word.startswith("-")
        hint = "" if key in keys else _meant(key.lstrip("-"), keys)
        return f"settings are typed name=value{', without dashes' if has_dashes else ''}{hint}"
    if _EMPTY_FOLDER.fullmatch(word):
        return "it has no value; give a folder"
    if key in _FOR_SWEEPS and not is_sweep(words):
        return "it has no effect on a single run; add -m"
    group = key.lstrip("+").partition("@")[0]
    if not _is_group(group) or "(" in value or _has_own_folders(words):
        return None
    if value == "{}":
        return f"it changes nothing; {group} is one of {', '.join(choices(group))}, or [] for none"
    for one in _LIST.findall(value):
        listed = re.findall(r"[\w.-]+", one)
        if twice := [choice for choice in listed if listed.count(choice) > 1]:
            return (
                f"it has {twice[0]} twice; give the other one a name of its own, as in "
                f"+{group}@{group}.second={twice[0]}"
            )
    options = choices(group)
    unknown = {*re.findall(r"[\w.-]+", value)} - {*options}
    alternative = ", or your own with plugins=[MODULE]" if group in _EXTENSIBLE else ""
    meant = did_you_mean(min(unknown), options) if unknown else ""
    return f"{group} is one of {', '.join(options)}{alternative}{meant}" if unknown else None


def explain(error: Exception, name: str, words: Sequence[str]) -> InputError:
    """Return the error for a user whose settings Hydra or OmegaConf rejected."""
    keys = [] if _has_own_folders(words) else _names(name, words)
    command = f"drone-rl {name.replace('_', '-')}"
    for word in words:
        key = word.lstrip("~").partition("=")[0]
        if keys and key not in keys and not word.startswith(("-", "+")):
            remedy = _meant(key, keys) or _chosen(key)
            remedy = remedy or f"; {command} --help all lists the settings"
            return InputError(f"{word}: {command} has no setting {key}{remedy}")
    return InputError(" ".join(f"{error} {error.__cause__ or ''}".split()))


def _chosen(key: str) -> str:
    """Return a hint at the launcher or sweeper that has a setting of Hydra's; "" if none has."""
    for group in _FOR_SWEEPS:
        prefix = group.replace("/", ".") + "."
        for path in (conf_dir() / group).glob("*.yaml") if key.startswith(prefix) else ():
            if key.removeprefix(prefix) in yaml.safe_load(path.read_text(encoding="utf-8")):
                return f"; add {group}={path.stem}, which has it"
    return ""


def _has_own_folders(words: Sequence[str]) -> bool:
    return any(word.startswith(_OWN_FOLDERS) for word in words)


def _is_group(name: str) -> bool:
    return bool(name) and not name.startswith((".", "/")) and bool(choices(name))


def _names(name: str, words: Sequence[str]) -> list[str]:
    """Return the settings and groups that a command has with the groups' choices in its words."""
    groups = [w for w in words if _is_group(w.lstrip("+").partition("=")[0].partition("@")[0])]
    selected = [w for w in groups if "," not in _LIST.sub("", w)]
    try:
        config = composed(name, selected)
    except (HydraException, OmegaConfBaseException):
        config = composed(name, ())
    values: Any = OmegaConf.to_container(config, resolve=False)
    groups = [group for group in config.hydra.runtime.choices if "@" not in group]
    values["hydra"] = values.pop("hydra")  # a user means other settings first
    return [*flattened(values), *groups]


def _meant(name: str, keys: Collection[str]) -> str:
    """Return a hint at the setting that is like a name, or the choice of a group that has it."""
    group = name.partition(".")[0]
    is_choice = group in keys and name not in keys and group != "hydra"
    for choice in choices(group) if is_choice else ():
        with contextlib.suppress(OSError):  # a file
            values: Any = ConfigStore.instance().load(f"{group}/{choice}.yaml").node
            if name in flattened({group: values}):
                return f"; {group}={choice} has it"
            if name in flattened({group: {choice: values}}):
                return f"; {group}=[{choice}] has it"
    return next((f"; did you mean {meant}?" for meant in similar(name, keys)), "")


def similar(name: str, keys: Collection[str]) -> Iterator[str]:
    """Yield the names, or overrides, that a name may be meant for, the most likely first."""
    word = name.strip().replace("-", "_").lower()
    if word in keys:
        yield word
    group, _, last = word.rpartition(".")
    ends: dict[str, list[str]] = {end: [*names] for end, names in OTHER_NAMES["settings"].items()}
    for key in keys:
        ends.setdefault(key.rpartition(".")[2], []).append(key)
    near = difflib.get_close_matches(last, ends, 1, 0.7)
    for key in difflib.get_close_matches(word, keys, 1, 0.85):
        yield key
    for end in dict.fromkeys((word, last, *near)):
        matches = [key for key in ends.get(end, ()) if key.partition("=")[0] in keys]
        yield from sorted(matches, key=lambda key: not key.startswith(f"{group}."))


def no_command(word: str, following: Sequence[str], commands: Sequence[str]) -> str:
    """Return the message about an unknown command."""
    if "=" in word or word.startswith("-"):
        command = next((w for w in following if w in commands), "train")
        line = shlex.join([command, *(w for w in (word, *following) if w != command)])
        return f"{word}: the command comes first, as in drone-rl {line}"
    near = difflib.get_close_matches(word.lower(), commands, 1)
    meant = OTHER_NAMES["commands"].get(word.lower()) or (near and near[0])
    if meant:
        return f"command {word!r} is unknown; did you mean drone-rl {meant}?"
    return f"command {word!r} is unknown; use one of: {', '.join(commands)}"
