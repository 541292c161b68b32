"""Explain a command line that a command does not accept: what is wrong, and what to type instead.

One mechanism for all mistakes: `CommandLine.problem` says why a word is refused, and
`CommandLine.repair` tries what may be meant: how the words are spelled, then the name, then the
value. It returns the first override without a problem.
"""

import contextlib
import difflib
import re
import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
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

from drone_rl.config.configuration import read_other_names
from drone_rl.sweeps.manifest import is_sweep, quoted
from drone_rl.utils.errors import InputError

OTHER_NAMES = read_other_names()
SCHEMA = "base_"
"""Prefix of schemas' names, see `drone_rl.cli.hydra.composition`."""
OPTIONS = {"-m", "--multirun", "-h", "--help"}
"""Options of Hydra that are documented; all others are refused."""
_DASHES = "-\N{EN DASH}\N{EM DASH}\N{MINUS SIGN}"
_OVERRIDE = re.compile(r"\+{0,2}[A-Za-z][\w./@-]*=.*|~[A-Za-z][\w./@-]*(=.*)?", re.DOTALL)
_EMPTY_FOLDER = re.compile(r"\+{0,2}(hydra\.(run|sweep)\.dir|paths\.\w+)=")
_FOR_SWEEPS = ("hydra/launcher", "hydra/sweeper")
_OWN_FOLDERS = "hydra.searchpath"
"""Setting that adds folders of the user, whose files are not known here."""
_EXTENSIBLE = ("task", "network", "returns", "objective", "collector")
"""Groups for which modules of the user's register choices."""
_MAIN = ("policy", "certificate", "explanations", "policies", "folder")
"""Settings that a word without a name may be meant for, in this order."""
_ANY = "VALUE"
"""Placeholder of a value in a suggestion."""
_SEVERAL_VALUES = "it gives several values"
_NO_EFFECT = "it has no effect on a single run"
_MAGNITUDES = {"k": 10**3, "m": 10**6, "g": 10**9}
_TYPES = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    ListConfig: "a list",
}
"""Values that a setting accepts, by the type of its present value."""


def composed(command: str, conf: Path, overrides: Sequence[str]) -> DictConfig:
    """Compose the settings of a command; its name is that of a file in `conf`."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf), version_base="1.3"):
        return compose(command, [*overrides], return_hydra_config=True)


def choices(conf: Path, group: str) -> list[str]:
    """Return the choices of a group: names of its files, and what plugins register."""
    names = [path.name for path in (conf / group).glob("*.yaml")]
    with contextlib.suppress(OSError):  # nothing is stored in the group
        names += ConfigStore.instance().list(group)
    names = {n.removesuffix(".yaml") for n in names if n.endswith(".yaml")}
    return sorted(name for name in names if not name.startswith(SCHEMA))


def flattened(values: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """Yield the dotted names of groups and settings."""
    for name, value in values.items():
        if not name.startswith("_"):
            yield prefix + name
            if isinstance(value, Mapping):
                yield from flattened(value, f"{prefix}{name}.")


def check_words(name: str, conf: Path, words: Sequence[str]) -> None:
    """Raise an `InputError` for the first word that Hydra ignores or would misunderstand.

    These are options, unknown choices of a group (schemas are choices for Hydra), empty names of
    folders, and what only sweeps use. All other mistakes are left to Hydra.
    """
    for position, word in enumerate(words):
        key, _, value = word.partition("=")
        is_refused = not _OVERRIDE.fullmatch(word) or bool(_EMPTY_FOLDER.fullmatch(word))
        if key in _FOR_SWEEPS:
            is_refused |= not is_sweep(words)
        group = key.lstrip("+").partition("@")[0]
        if _is_group(conf, group) and not any(w.startswith(_OWN_FOLDERS) for w in words):
            names = re.findall(r"[\w.-]+", value)
            is_refused |= not {*names} <= {*choices(conf, group)} and "(" not in value
        if is_refused and word not in OPTIONS:
            raise CommandLine(name, conf, words).mistake(position)


def explain(error: Exception, name: str, conf: Path, words: Sequence[str]) -> InputError:
    """Return the error for a user whose settings Hydra or OmegaConf rejected."""
    if not any(word.startswith(_OWN_FOLDERS) for word in words):
        command = CommandLine(name, conf, words)
        for position, word in enumerate(words):
            if word not in OPTIONS and command.problem(word) is not None:
                return command.mistake(position)
    return InputError(" ".join(str(error.__cause__ or error).split()))


def _is_group(conf: Path, name: str) -> bool:
    return bool(name) and not name.startswith((".", "/")) and (conf / name).is_dir()


class CommandLine:
    """A command and the words after its name."""

    def __init__(self, name: str, conf: Path, words: Sequence[str]) -> None:
        self.name, self.conf, self.words = name.replace("_", "-"), conf, words
        self._parser = OverridesParser.create()
        self._read(composed(name, conf, ()))
        selected = [w for w in words if w.partition("=")[0] in self.groups and not self.problem(w)]
        if selected and not is_sweep(words):
            self._read(composed(name, conf, selected))

    def _read(self, config: DictConfig) -> None:
        """Take the settings, which the choices of groups determine."""
        self.config = config
        groups = [g for g in config.hydra.runtime.choices if "@" not in g and g != "hydra"]
        self.groups = [group for group in groups if (self.conf / group).is_dir()]
        values: Any = OmegaConf.to_container(config, resolve=False)
        values["hydra"] = values.pop("hydra")  # a user means other settings first
        self.keys = [*flattened(values), *self.groups]

    def mistake(self, position: int) -> InputError:
        """Return the error about one of the words."""
        word = self.words[position]
        problem, meant = self.problem(word), self.repair(position)
        remedy = f"type {meant}" if meant else f"drone-rl {self.name} --help all lists the settings"
        return InputError(f"{word}: {problem}; {remedy}")

    def problem(self, word: str) -> str | None:
        """Return why the command does not accept a word, or None."""
        if not _OVERRIDE.fullmatch(word):
            return "settings are typed name=value, without dashes"
        override = self._parsed(word)
        if override is None:
            return "its value has special characters, which need quotes"
        key, exists = override.key_or_group, override.key_or_group in self.keys
        is_added = word.startswith("+")
        if not exists and not is_added:
            return f"drone-rl {self.name} has no setting {key}"
        if exists and is_added and not override.is_force_add():
            return f"{key} exists already"
        if not is_sweep(self.words):
            if key in _FOR_SWEEPS:
                return _NO_EFFECT
            if override.is_sweep_override():
                return _SEVERAL_VALUES
        return self._problem_of_value(word, override)

    def _parsed(self, word: str) -> Override | None:
        with contextlib.suppress(HydraException):
            return self._parser.parse_override(word)

    def _problem_of_value(self, word: str, override: Override) -> str | None:
        if _EMPTY_FOLDER.fullmatch(word):
            return "it has no value"
        if override.is_delete() or _ANY in word:
            return None
        key = override.key_or_group
        for value in self._values(override):
            if key in self.groups:
                names = choices(self.conf, key)
                if value not in names:
                    own = ", or a part of your own with plugins=[MODULE]"
                    return f"{key} is one of {', '.join(names)}{own if key in _EXTENSIBLE else ''}"
                continue
            try:
                OmegaConf.update(self.config, key, value, force_add=override.is_add())
            except (OmegaConfBaseException, AttributeError, KeyError):
                now = OmegaConf.select(self.config, key)
                if isinstance(now, DictConfig):
                    return f"{key} is a group of settings, as in {key}.NAME=VALUE"
                example = "" if now is None else f", such as {key}={_text(now)}"
                return f"it needs {_TYPES.get(type(now), 'another value')}{example}"
        return None

    def _values(self, override: Override) -> Iterator[Any]:
        """Yield the values of an override: several for a sweep."""
        if not override.is_sweep_override():
            yield override.value()
        elif not override.is_interval_sweep():
            for text in override.sweep_string_iterator():
                yield self._parser.parse_override(f"x={text}").value()

    def repair(self, position: int) -> str | None:
        """Return what was most likely meant by a word, quoted for a shell, or None."""
        for text in self._spellings(position):
            for override in self._meant(text):
                if self.problem(override) is None:
                    return _in_quotes(override)
                if choice := self._choice_with(override.partition("=")[0]):
                    return f"{choice} {_in_quotes(override)}"
        word = self.words[position]
        if self.problem(word) in (_SEVERAL_VALUES, _NO_EFFECT):
            return f"drone-rl {self.name} -m {_in_quotes(word)}"
        return None

    def _spellings(self, position: int) -> Iterator[str]:
        """Yield the overrides that a word may be, alone or with the words next to it."""
        word, bare = self.words[position], self.words[position].lstrip(_DASHES)
        before, after = ("", *self.words)[position], [*self.words[position + 1 :], "", ""]
        if "=" in bare[:-1] or ":" in bare:
            yield bare.replace(":", "=", "=" not in bare)
        if _OVERRIDE.fullmatch(word):
            return
        if word.startswith("=") or before.endswith("=") or before.count("[") > before.count("]"):
            gap = "" if before.endswith(("=", "[", ",")) or word.startswith("=") else ","
            yield f"{before}{gap}{word}"  # a list with spaces
        elif after[0].startswith("="):  # spaces around the equals sign
            yield word + after[0] + (after[1] if after[0] == "=" else "")
        if after[0] and "=" not in after[0]:
            yield f"{bare}={after[0]}"
        if isinstance(OmegaConf.select(self.config, bare.replace("-", "_")), bool):
            yield f"{bare}=true"
        if bare == word:  # the name may be missing
            yield from (f"{g}={word}" for g in self.groups if word in choices(self.conf, g))
            is_proof = (Path(word) / "certificate.json").is_file()
            is_policy = Path(word).suffix in ("", ".pt", ".safetensors") and not is_proof
            main = _MAIN if is_policy else ("certificate", *_MAIN)
            yield from (f"{key}={word}" for key in main if key in self.keys)
        yield f"{bare}={_ANY}"

    def _meant(self, text: str) -> Iterator[str]:
        """Yield the overrides that may be meant by one."""
        name, _, value = text.partition("=")
        exists = name.lstrip("+") in self.keys
        yield f"{name}.{value}" if "=" in value else text
        names = [name.lstrip("+")] if exists else [*similar(name, self.keys)]
        for meant in names:
            if "=" in meant:
                yield meant
                continue
            is_choice = meant in self.groups and "," not in value
            offered = choices(self.conf, meant) if is_choice else ()
            for variant in (*_variants(value), *difflib.get_close_matches(value, offered, 1)):
                yield f"{meant}={variant}"
            if self._parsed(text) is None:
                yield f"{meant}={quoted(value)}"
        if not exists:
            yield from (f"{meant}={_ANY}" for meant in names)

    def _choice_with(self, key: str) -> str | None:
        """Return the first other choice of a group whose file has a setting, as an override."""
        group = key.partition(".")[0]
        if group not in self.groups or key in self.keys:
            return None
        for path in sorted((self.conf / group).glob("*.yaml")):
            if key in flattened({group: yaml.safe_load(path.read_text()) or {}}):
                return f"{group}={path.stem}"
        return None


def similar(name: str, keys: Collection[str]) -> Iterator[str]:
    """Yield the names, or overrides, that a name may be meant for, the most likely first."""
    word = name.strip().lstrip("+~").replace("-", "_").lower()
    group, _, last = word.rpartition(".")
    by_last: dict[str, list[str]] = {}
    for key in keys:
        by_last.setdefault(key.rpartition(".")[2], []).append(key)

    def alike(part: str) -> list[str]:
        names = [*OTHER_NAMES["settings"].get(part, ()), *by_last.get(part, ())]
        return sorted(names, key=lambda n: not n.startswith(f"{group}."))

    if word in keys:
        yield word
    yield from alike(word)
    yield from (key for key in keys if group and key.startswith(word))
    yield from alike(last)
    yield from difflib.get_close_matches(word, [k for k in keys if k not in group], 1, 0.8)
    for part in difflib.get_close_matches(last, [*by_last, *OTHER_NAMES["settings"]], 1, 0.8):
        yield from alike(part)


def _variants(value: str) -> Iterator[str]:
    """Yield a value as Hydra may need it: as it is, then with the habits of others undone."""
    yield value or _ANY
    if value.lower() == "none":
        yield "null"
    yield f"[{value.strip('()[]')}]"
    yield value.lstrip("=")
    if re.fullmatch(r"[1-9]\d{0,2}(,\d{3})+", value):
        yield value.replace(",", "")
    if re.fullmatch(r"\d+,\d+", value):
        yield value.replace(",", ".")
    if written := re.fullmatch(r"(\d+(?:\.\d+)?)([kKmMgG])", value):
        yield f"{float(written[1]) * _MAGNITUDES[written[2].lower()]:.0f}"
    yield value.removesuffix(".0")


def _text(value: Any) -> str:
    """Return a value in Hydra's grammar."""
    plain = [*value] if isinstance(value, ListConfig) else value
    text = str(plain).replace(" ", "").replace("'", "")
    return text.lower() if isinstance(value, bool) else text


def _in_quotes(text: str) -> str:
    """Quote a text for a shell, in double quotes if that is easier to read."""
    is_simple = "'" in text and not {*text} & {*'"$`\\!'}
    return f'"{text}"' if is_simple else shlex.quote(text)


def no_command(word: str, following: Sequence[str], commands: Sequence[str]) -> str:
    """Return the message about an unknown command."""
    if "=" in word or word.startswith(tuple(_DASHES)):
        command = next((w for w in following if w in commands), "train")
        line = shlex.join([command, *(w for w in (word, *following) if w != command)])
        return f"{word}: the command comes first, as in drone-rl {line}"
    near = difflib.get_close_matches(word.lower(), commands, 1)
    meant = OTHER_NAMES["commands"].get(word.lower()) or (near and near[0])
    if meant:
        return f"command {word!r} is unknown; did you mean drone-rl {meant}?"
    return f"command {word!r} is unknown; use one of: {', '.join(commands)}"
