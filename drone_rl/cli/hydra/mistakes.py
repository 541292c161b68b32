"""Explain why Hydra rejected settings: one line with the value and what to type instead.

Hydra's own messages are about its grammar and classes.
"""

import contextlib
import difflib
import re
import shlex
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from drone_rl.sweeps.manifest import is_sweep, quoted
from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import yaml_mistake

OTHER_NAMES = tomllib.loads(Path(__file__).parent.with_name("names.toml").read_text("utf-8"))
"""Names of other projects' settings and commands, with ours."""
OWN_FOLDERS = ("--config-dir", "-cd", "hydra.searchpath")
"""Options that add folders of the user, whose files are not known here."""
SCHEMA = "base_"
"""Prefix of schemas' names, see `drone_rl.cli.hydra.composition`."""

_HYDRAS_OWN = ("hydra.run.dir", "hydra.sweep.dir", "hydra.launcher.num_jobs", "hydra.verbose")
_EXPECTED = {
    **dict.fromkeys(("integer", "int"), "a whole number"),
    "float": "a number",
    **dict.fromkeys(("boolean", "bool"), "true or false"),
    **dict.fromkeys(("string", "str"), "a text"),
}
_TYPE = re.compile(r"(?:converted to|convert \S+ to|field of type|a valid) '?(?:Optional\[)?(\w+)")
"""The type that a setting needs, in OmegaConf's messages."""
_RANGE = re.compile(r"([\w.]+)=(\d+)(?:\.\.|-|:)(\d+)")
"""Several whole numbers, as other programs write them."""
_MAGNITUDES = {"k": 10**3, "m": 10**6, "g": 10**9}
_TEXTS = re.compile(
    r"[+~]*(hydra|paths|policy|policies|resume|certificate|explanations|folder|name|shifts|require|"
    r"demonstrations)(?=[=.@/]|$)"
)
"""Settings whose values are names and paths."""
_IN_FILE = re.compile(r"In '(\S+/\S+)': \w+ raised while composing config:\n(.*)\n +full_key: (.*)")
_EXPONENT = re.compile(r"(?<=[=,\[(\s])(\d+(?:\.\d+)?[eE]\+?\d+)(?=[,\])]|$)")
_LARGEST_WHOLE = 10**15


def composed(command: str, conf: Path, typed: Sequence[str]) -> DictConfig:
    """Compose the settings of a command; its name is that of a file in `conf`."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf), version_base="1.3"):
        return compose(command, [*typed], return_hydra_config=True)


def whole_numbers(override: str) -> str:
    """Write whole numbers such as 1e5 without an exponent, as whole-number settings need them."""

    def plain(found: re.Match[str]) -> str:
        value = float(found[1])
        return str(int(value)) if value.is_integer() and value < _LARGEST_WHOLE else found[1]

    return override if _TEXTS.match(override) else _EXPONENT.sub(plain, override)


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


def check_choices(overrides: Sequence[str], conf: Path) -> None:
    """Raise an `InputError` for the first unknown choice of a group."""
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
                near = difflib.get_close_matches(name.lower(), offered, 1)
                meant = f"did you mean {group}={near[0]}? " if near else ""
                raise InputError(
                    f"{group}={name} is unknown; {meant}give one of: {', '.join(offered)}"
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
    if last.isdigit():  # the index of a list
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
        value = override.partition("=")[2]
        text = f"{override}: drone-rl {self.name} has no setting {name}; "
        group, first = name.rpartition(".")[0], name.partition(".")[0]
        if is_group(self.conf, first) and first not in ("hydra", *self.groups, *self.keys):
            return InputError(
                f"{override}: drone-rl {self.name} can't change {first}; {self.list_all}"
            )
        if group in self.groups and self.config[group] is None:
            offered = ", ".join(choices(self.conf, group))
            why = f"{group} is null, which has no settings; type {group}=NAME {override}"
            return InputError(f"{override}: {why} with one of the names {offered}")
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
            return InputError(f"{text}did you mean {ours}? ({self.list_all})")
        inside = [k.removeprefix(f"{group}.") for k in self.keys if k.startswith(f"{group}.")]
        listed = f"{group} has: {', '.join(inside[:40])}" if inside else self.list_all
        return InputError(text + listed)

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
        wrong = _wrong_value(command.config, key, value[1], f"{key}={value[1]}", reason)
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
    if not _TEXTS.match(word) and re.fullmatch(r"[A-Za-z_][\w.]*=[^=]*", value):
        return InputError(f"{word} has two equals signs; type {key}.{value}")
    if number := re.fullmatch(r"([\d.]+)[=)\]}].*", value):
        return InputError(f"{word} is not a number; type {key}={number[1]}")
    if value.startswith("="):
        return InputError(f"{word} has two equals signs; type {key}={value.lstrip('=')}")
    if re.search(r"\s[\w.]+=", value):
        return InputError(f"{word!r} holds two settings in one pair of quotes; type: {word}")
    if not re.fullmatch(r"(\+{0,2}|~)[A-Za-z_][\w./@-]*", key) or key.endswith("."):
        fixed = re.sub(r"[^\w./@]", "_", key.strip()).strip("._")
        return InputError(f"{word}: {key!r} is not a valid name; type {fixed}={value}")
    if value.startswith("~"):
        return InputError(f"{word}: the shell left ~ as it is; type {key}=$HOME{value[1:]}")
    if found := re.fullmatch(r"\((.*)\)", value):
        return InputError(f"{word}: lists have square brackets; type {key}=[{found[1]}]")
    closed = in_quotes(f"{key}={quoted(value)}")
    return InputError(f"{word}: {value!r} has special characters, which need quotes; type {closed}")


def in_quotes(text: str) -> str:
    """Quote a text for a shell, in double quotes if that is easier to read."""
    is_simple = "'" in text and not {*text} & {*'"$`\\!'}
    return f'"{text}"' if is_simple else shlex.quote(text)


def _wrong(
    command: Command, override: Override, is_choice: bool, is_several: bool
) -> InputError | None:
    """Return the error about a setting that the command doesn't accept, or None."""
    key, text = override.key_or_group, str(override.input_line)
    is_unknown = key not in command.keys and not key.startswith("hydra.")
    if is_unknown and not is_choice and not text.startswith("+"):
        return command.unknown(text, key)
    if override.is_sweep_override() and (not is_several or override.is_interval_sweep()):
        return _several(command, override, text)
    if text.startswith("+") and not override.is_force_add() and not is_unknown:
        return InputError(f"{text}: {key} exists already; type {text.lstrip('+')}")
    value: Any = override.value()
    if is_choice and isinstance(value, list):
        return InputError(f"{text}: {key} is one choice; type {key}={value[0]}")
    return None if is_choice or override.is_delete() else _wrong_type(command, override)


def _wrong_type(command: Command, override: Override) -> InputError | None:
    """Return the error about a value that a setting doesn't accept, or None."""
    key, text = override.key_or_group, str(override.input_line)
    for value in _values(override):
        try:
            OmegaConf.update(command.config, key, value, force_add=text.startswith("+"))
        except (AttributeError, KeyError):  # from OmegaConf, for a name that it does not know
            return command.unknown(text, key)
        except OmegaConfBaseException as error:
            reason = str(error).splitlines()[0]
            found = _wrong_value(command.config, key, value, text, reason)
            if sweep := _RANGE.fullmatch(text):
                several = f"{sweep[1]}=range({sweep[2]},{int(sweep[3]) + 1})"
                return InputError(f"{found}; for one run with each, add -m {shlex.quote(several)}")
            return found
    return None


def _values(override: Override) -> list[Any]:
    """Return the values of an override: several for a sweep."""
    if not override.is_sweep_override():
        return [override.value()]
    parser = OverridesParser.create()
    return [parser.parse_override(f"x={v}").value() for v in override.sweep_string_iterator()]


def _several(command: Command, override: Override, text: str) -> InputError:
    """Return the error about several values of one setting in one run."""
    key, _, value = text.partition("=")
    if override.is_interval_sweep():
        return InputError(f"{text}: only a search tries an interval; add -m hydra/sweeper=optuna")
    if re.fullmatch(r"\d{1,3}(,\d{3})+", value):
        return InputError(f"{text}: commas separate values; type {key}={value.replace(',', '')}")
    line = f"drone-rl {command.name} -m {in_quotes(text) if '(' in text else text}"
    listed = OverridesParser.create().parse_override(f"{key}=[{value}]")
    if key in command.groups or "(" in value or _wrong_type(command, listed):
        return InputError(f"{text} gives several values; for one run with each, type {line}")
    return InputError(
        f"{text} gives several values; for a list, type {key}=[{value}]; for one run with each, "
        f"type {line}"
    )


def _wrong_value(config: DictConfig, key: str, value: Any, text: str, reason: str) -> InputError:
    """Return the error about a value of the wrong type, for OmegaConf's `reason`."""
    name, now = text.partition("=")[0], OmegaConf.select(config, key)
    if str(value).lower() == "none":
        with contextlib.suppress(OmegaConfBaseException):
            OmegaConf.update(config, key, None)  # fails unless the setting may be null
            return InputError(f"{text} does not fit; type {name}=null")
    found = _TYPE.search(reason)
    expected = _EXPECTED.get(found[1].lower(), "") if found else ""
    if isinstance(now, DictConfig):
        return InputError(f"{text}: {key} is a group of settings; type {key}.NAME=VALUE")
    if isinstance(now, ListConfig):
        listed = [value, *now[1:]] if isinstance(value, int | float) else ([*now] or [value])
        listed = str(listed).replace(" ", "").replace("'", "")
        return InputError(f"{text} has the wrong type; type a list such as {name}={listed}")
    if now is None:
        with contextlib.suppress(OmegaConfBaseException):
            OmegaConf.update(config, key, [value])  # fails unless the setting may be a list
            rest = ",0,0" if key in ("dynamics.wind", "dynamics.camera_offset") else ""
            listed = f"{name}=[{value}{rest}]"
            return InputError(f"{text} has the wrong type; type a list such as {listed}")
    written = re.fullmatch(r"(\d+(?:\.\d+)?)([kKmMgG])", str(value))
    if written and "number" in expected:
        now = f"{float(written[1]) * _MAGNITUDES[written[2].lower()]:.0f}"
    elif whole := re.fullmatch(r"(-?\d+)\.0", str(value)):
        now = whole[1]
    expected = expected or "another value"
    example = "" if now is None else f", such as {name}={str(now).lower()}"
    return InputError(f"{text} does not fit; type {expected}{example}")
