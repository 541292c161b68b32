"""Reject words on a command line that are not settings, before Hydra reads it."""

import difflib
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from omegaconf import OmegaConf

from drone_rl.cli.hydra.names import OTHER_NAMES, Command, choices
from drone_rl.cli.hydra.values import in_quotes
from drone_rl.utils.errors import InputError

_SWEEP_FLAGS = {"-m", "--multirun"}
_OPTIONS = {*_SWEEP_FLAGS, "-h", "--help"}
"""Options of Hydra that are documented; all others are refused."""
_SPACED = re.compile(r"(?:^|\s)([\w.]+)(?: =|= | = )([^\s=]\S*)")
"""A setting with spaces around its equals sign."""
_DASHES = "-\N{EN DASH}\N{EM DASH}\N{MINUS SIGN}"
_PAIRS = {"[": "]", "(": ")", "{": "}"}
_EMPTY_FOLDER = re.compile(r"\+{0,2}(hydra\.(run|sweep)\.dir|paths\.\w+)=")
_MAIN = ("policy", "certificate", "explanations", "policies", "folder")
"""Settings that a word without a name may be meant for, in this order."""
_CHOICES = ("experiment", "objective", "network", "appearance", "dynamics", "task", "logger")
"""Groups that such a word may be a choice of."""


def check_words(name: str, conf: Path, words: Sequence[str]) -> None:
    """Raise an `InputError` for the first word that is not a setting."""
    _check_resume(words)
    for position, word in enumerate(words):
        if word in _OPTIONS:
            continue
        if word.startswith(tuple(_DASHES)):
            raise _dashed(Command(name, conf), word, words[position + 1 :])
        if _EMPTY_FOLDER.fullmatch(word):
            raise InputError(f"{word} has no value; type a folder, such as {word}outputs")
        if "=" in word[1:]:
            _check_brackets(word, words[position + 1 :])
        elif not (word.startswith("~") and len(word) > 1):
            raise _bare(Command(name, conf), words, position)


def sweep_flag_first(words: Sequence[str]) -> list[str]:
    """Put -m before the settings: Hydra's parser rejects settings on both sides of it."""
    return sorted(words, key=lambda word: word not in _SWEEP_FLAGS)


def _check_resume(words: Sequence[str]) -> None:
    if _SWEEP_FLAGS & {*words} and any(word.startswith("resume=") for word in words):
        raise InputError(
            "resume= continues one run, not with -m; to continue a sweep, repeat its command"
        )


def _dashed(command: Command, word: str, following: Sequence[str]) -> InputError:
    name, is_given, value = word.lstrip(_DASHES).partition("=")
    if not is_given:
        is_value = following and "=" not in following[0] and not following[0].startswith("--")
        value = following[0] if is_value else ""
        word = f"{word} {value}" if is_value else word
    if ours := command.instead(name, value):
        if isinstance(OmegaConf.select(command.config, ours.removesuffix("=VALUE")), bool):
            ours = ours.replace("=VALUE", "=true")
        return InputError(f"{word}: settings have no dashes; type {ours}")
    return InputError(
        f"{word}: drone-rl {command.name} has no such option; settings are typed name=value, "
        f"without dashes ({command.list_all})"
    )


def _check_brackets(word: str, following: Sequence[str]) -> None:
    """Check that each bracket and quote of a setting is closed."""
    open_ = _unclosed(word)
    if open_ is None:
        return
    joined = word
    for more in following:
        gap = "," if _unclosed(joined) == "]" else " "
        joined += more if joined.endswith(("[", ",", "(", "{")) else f"{gap}{more}"
        if _unclosed(joined) is None:
            raise InputError(
                f"{word}: the shell ends a setting at a space; type it without spaces or in "
                f"quotes: {in_quotes(joined)}"
            )
    raise InputError(f"{word} has no closing {open_}; type {in_quotes(word + open_)}")


def _unclosed(text: str) -> str | None:
    """Return the character that would close the last open bracket or quote, or None."""
    open_: list[str] = []
    for char in re.sub(r"\\.", "", text):
        if open_ and char == open_[-1]:
            open_.pop()
        elif not (open_ and open_[-1] in "'\"") and (char in _PAIRS or char in "'\""):
            open_.append(_PAIRS.get(char, char))
    return open_[-1] if open_ else None


def _bare(command: Command, words: Sequence[str], position: int) -> InputError:
    """Return the error about a word without an equals sign."""
    word, after = words[position] or "''", [*words[position + 1 :], ""]
    if spaced := _SPACED.search(" ".join(words[max(0, position - 1) : position + 3])):
        name, value = spaced.groups()
        return InputError(f"{name} = {value}: no spaces around =; type {name}={value}")
    key, is_colon, value = word.partition(":")
    if is_colon and (ours := command.instead(key, value or after[0])):
        return InputError(f"{word} has a colon instead of an equals sign; type {ours}")
    if word in command.keys or word in OTHER_NAMES["settings"]:
        ours = command.instead(word, "" if "=" in after[0] else after[0])
        return InputError(f"{word} has no =; type {ours or 'NAME=VALUE'}")
    named = [g for g in _CHOICES if g in command.groups and word in choices(command.conf, g)]
    is_policy = Path(word).suffix in ("", ".pt", ".safetensors")
    is_policy &= not (Path(word) / "certificate.json").is_file()
    main = _MAIN if is_policy else ("certificate", *_MAIN)
    named += [key for key in main if key in command.keys]
    if named:
        return InputError(f"{word} has no name before it; type {named[0]}={word}")
    return InputError(
        f"{word} has no =; settings are typed name=value, as in seed=1 ({command.list_all})"
    )


def no_command(word: str, following: Sequence[str], known: Sequence[str]) -> str:
    """Return the message about an unknown command."""
    if "=" in word or word.startswith(tuple(_DASHES)):
        command = next((w for w in following if w in known), None)
        if command is None and word.startswith("--"):
            return (
                f"{word}: the command comes first, then settings as name=value without dashes, as "
                "in drone-rl train seed=1"
            )
        command = command or "train"
        others = [re.sub(r"^--(?=\w+=)", "", w) for w in (word, *following) if w != command]
        return f"{word}: the command comes first; type drone-rl {shlex.join([command, *others])}"
    near = difflib.get_close_matches(word.lower(), known, 1)
    meant = OTHER_NAMES["commands"].get(word.lower()) or (near and near[0])
    if meant:
        return (
            f"command {word!r} is unknown; did you mean drone-rl {meant}? drone-rl --help lists all"
        )
    return f"command {word!r} is unknown; use one of: {', '.join(known)}"
