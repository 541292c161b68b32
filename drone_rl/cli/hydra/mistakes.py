"""Explain why Hydra rejected settings: one line with the value and what to type instead.

Hydra's own messages are about its grammar and classes.
"""

import difflib
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException

from drone_rl.cli.hydra.names import Command, choices, is_group
from drone_rl.cli.hydra.values import TEXTS, in_quotes, several_values, wrong_type, wrong_value
from drone_rl.sweeps.manifest import is_sweep, quoted
from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import yaml_mistake

OWN_FOLDERS = "hydra.searchpath"
"""Setting that adds folders of the user, whose files are not known here."""
_IN_FILE = re.compile(r"In '(\S+/\S+)': \w+ raised while composing config:\n(.*)\n +full_key: (.*)")


def check_choices(overrides: Sequence[str], conf: Path, extensible: Collection[str] = ()) -> None:
    """Raise an `InputError` for the first unknown choice of a group.

    `extensible` are the groups for which modules of the user's register choices.
    """
    if any(override.startswith(OWN_FOLDERS) for override in overrides):
        return
    for override in overrides:
        key, _, value = override.partition("=")
        group = key.lstrip("+").partition("@")[0]
        if not is_group(conf, group) or not re.fullmatch(r"[\w\s,'\"\[\].-]*", value):
            continue
        offered = choices(conf, group)
        for name in re.split(r"[,\s'\"\[\]]+", value.strip("[] '\"")):
            if name == "null":
                raise InputError(f"{override}: leave it out, or give one of: {', '.join(offered)}")
            if name not in offered:
                near = difflib.get_close_matches(name.lower(), offered, 1, 0.7)
                meant = f"did you mean {group}={near[0]}? " if near else ""
                own = "; if a module of yours registers it, add plugins=[MODULE]"
                raise InputError(
                    f"{group}={name} is unknown; {meant}give one of: {', '.join(offered)}"
                    f"{own if group in extensible and not near else ''}"
                )


def check_launcher(command: str, overrides: Sequence[str]) -> None:
    """Raise an `InputError` for a launcher or sweeper that a single run ignores."""
    if is_sweep(overrides) or any(o.startswith(("resume=", "hydra.mode=")) for o in overrides):
        return
    for override in overrides:
        if override.startswith(("hydra/launcher=", "hydra/sweeper=")):
            line = f"drone-rl {command.replace('_', '-')} -m {override}"
            raise InputError(f"{override} has no effect on a single run; type {line}")


def repeated(overrides: Sequence[str]) -> list[str]:
    """Return the last one of each setting that is given several times: Hydra takes that one."""
    given: dict[str, list[str]] = {}
    for override in (o for o in overrides if "=" in o):
        given.setdefault(override.partition("=")[0].lstrip("+"), []).append(override)
    return [several[-1] for several in given.values() if len(several) > 1]


def explain(error: Exception, name: str, conf: Path, overrides: Sequence[str]) -> InputError:
    """Return the error for a user whose settings Hydra or OmegaConf rejected."""
    parsed: list[Override] = []
    for word in (o for o in overrides if not o.startswith("-") and ("=" in o or o[:1] == "~")):
        try:
            parsed.append(OverridesParser.create().parse_override(word))
        except HydraException:
            return _syntax(word)
    text = " ".join(str(error.__cause__ or error).split()).split(" full_key:")[0]
    if key := re.search(r"Interpolation key '([^']*)'", text):
        return InputError(f"${{{key[1]}}} refers to a setting that does not exist; give a value")
    if not any(o.startswith(OWN_FOLDERS) for o in overrides):
        groups = [o for o in parsed if is_group(conf, o.key_or_group)]
        if lacking := _lacking(name, conf, groups):
            return lacking
        alone = [f"{o.key_or_group}={o.value()}" for o in groups if isinstance(o.value(), str)]
        command = Command(name, conf, alone)
        for override in parsed:
            if found := _wrong(command, override, override in groups, is_sweep(overrides)):
                return found
        text = command.list_all
    return InputError(f"{' '.join(overrides)}: these settings can't be read; {text}")


def explain_file(error: Exception, name: str, conf: Path) -> InputError | None:
    """Return the error about a file of settings, or None; files of conf/ have none."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark:
        return InputError(yaml_mistake(error, error.problem_mark.name))
    if not (found := _IN_FILE.match(str(error))):
        return None
    file, reason, key = f"{found[1]}.yaml", found[2], found[3]
    if key == file.partition("/")[0]:
        return InputError(f"{file} sets more than {key}; write # @package _global_ as first line")
    command, value = Command(name, conf), re.match("Value '(.*)' of type", reason)
    if key and value:
        wrong = wrong_value(command.config, key, value[1], f"{key}={value[1]}", reason)
        return InputError(f"{file}: {wrong}")
    return command.unknown(file, key) if reason.startswith("Key ") else None


def _lacking(name: str, conf: Path, groups: Sequence[Override]) -> InputError | None:
    """Return the error about the first group of files that a command doesn't have, or None."""
    if not groups:
        return None
    own = Command(name, conf)
    absent = (o for o in groups if o.key_or_group not in own.groups)
    found = next(absent, None)
    return found and own.unknown(str(found.input_line), found.key_or_group)


def _syntax(word: str) -> InputError:
    """Return the error about a setting whose value has characters with a meaning of their own."""
    key, _, value = word.partition("=")
    if not TEXTS.match(word) and re.fullmatch(r"[A-Za-z_][\w.]*=[^=]*", value):
        return InputError(f"{word} has two equals signs; type {key}.{value}")
    if number := re.fullmatch(r"([\d.]+)[=)\]}].*", value):
        return InputError(f"{word} is not a number; type {key}={number[1]}")
    if value.startswith("="):
        return InputError(f"{word} has two equals signs; type {key}={value.lstrip('=')}")
    if re.search(r"\s[\w.]+=", value):
        return InputError(f"{word!r} holds two settings in one pair of quotes; type: {word}")
    if not re.fullmatch(r"(\+{0,2}|~)[A-Za-z_][\w./@-]*", key) or key.endswith("."):
        fixed = re.sub(r"[^\w./@]", "_", key.strip()).strip("._")
        return InputError(f"{word}: {key!r} is not a valid name; type {fixed}={value.strip()}")
    if value.startswith("~"):
        return InputError(f"{word}: the shell left ~ as it is; type {key}=$HOME{value[1:]}")
    if found := re.fullmatch(r"\((.*)\)", value):
        return InputError(f"{word}: lists have square brackets; type {key}=[{found[1]}]")
    closed = in_quotes(f"{key}={quoted(value)}")
    return InputError(f"{word}: {value!r} has special characters, which need quotes; type {closed}")


def _wrong(
    command: Command, override: Override, is_choice: bool, is_several: bool
) -> InputError | None:
    """Return the error about a setting that the command doesn't accept, or None."""
    key, text = override.key_or_group, str(override.input_line)
    is_unknown = key not in command.keys and not key.startswith("hydra.")
    if is_unknown and not is_choice and not text.startswith("+"):
        return command.unknown(text, key)
    if override.is_sweep_override() and (not is_several or override.is_interval_sweep()):
        return several_values(command, override, text)
    if text.startswith("+") and not override.is_force_add() and not is_unknown:
        return InputError(f"{text}: {key} exists already; type {text.lstrip('+')}")
    value: Any = override.value()
    if is_choice and isinstance(value, list):
        return InputError(f"{text}: {key} is one choice; type {key}={value[0]}")
    return None if is_choice or override.is_delete() else wrong_type(command, override)
