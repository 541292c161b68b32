"""The values of settings: how whole numbers may be written, and why a value does not fit."""

import contextlib
import re
import shlex
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from drone_rl.cli.hydra.names import Command
from drone_rl.utils.errors import InputError

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
TEXTS = re.compile(
    r"[+~]*(hydra|paths|policy|policies|resume|certificate|explanations|folder|name|shifts|require|"
    r"demonstrations)(?=[=.@/]|$)"
)
"""Settings whose values are names and paths."""
_EXPONENT = re.compile(r"(?<=[=,\[(\s])(\d+(?:\.\d+)?[eE]\+?\d+)(?=[,\])]|$)")
_LARGEST_WHOLE = 10**15


def whole_numbers(override: str) -> str:
    """Write whole numbers such as 1e5 without an exponent, as whole-number settings need them."""

    def plain(found: re.Match[str]) -> str:
        value = float(found[1])
        return str(int(value)) if value.is_integer() and value < _LARGEST_WHOLE else found[1]

    return override if TEXTS.match(override) else _EXPONENT.sub(plain, override)


def in_quotes(text: str) -> str:
    """Quote a text for a shell, in double quotes if that is easier to read."""
    is_simple = "'" in text and not {*text} & {*'"$`\\!'}
    return f'"{text}"' if is_simple else shlex.quote(text)


def wrong_type(command: Command, override: Override) -> InputError | None:
    """Return the error about a value that a setting doesn't accept, or None."""
    key, text = override.key_or_group, str(override.input_line)
    for value in _values(override):
        try:
            OmegaConf.update(command.config, key, value, force_add=text.startswith("+"))
        except (AttributeError, KeyError):  # from OmegaConf, for a name that it does not know
            return command.unknown(text, key)
        except OmegaConfBaseException as error:
            reason = str(error).splitlines()[0]
            found = wrong_value(command.config, key, value, text, reason)
            if sweep := _RANGE.fullmatch(text):
                several = f"{sweep[1]}=range({sweep[2]},{int(sweep[3]) + 1})"
                return InputError(f"{found}; for one run with each, type -m {shlex.quote(several)}")
            return found
    return None


def _values(override: Override) -> list[Any]:
    """Return the values of an override: several for a sweep."""
    if not override.is_sweep_override():
        return [override.value()]
    parser = OverridesParser.create()
    return [parser.parse_override(f"x={v}").value() for v in override.sweep_string_iterator()]


def several_values(command: Command, override: Override, text: str) -> InputError:
    """Return the error about several values of one setting in one run."""
    key, _, value = text.partition("=")
    if override.is_interval_sweep():
        return InputError(f"{text}: only a search tries an interval; add -m hydra/sweeper=optuna")
    point = value.replace(",", ".")
    is_decimal = re.fullmatch(r"0,\d{3,}", value) is not None
    if is_decimal and not wrong_type(
        command, OverridesParser.create().parse_override(f"{key}={point}")
    ):
        return InputError(f"{text}: commas separate values; type {key}={point}")
    if re.fullmatch(r"[1-9]\d{0,2}(,\d{3})+", value):
        return InputError(f"{text}: commas separate values; type {key}={value.replace(',', '')}")
    line = f"drone-rl {command.name} -m {in_quotes(text) if '(' in text else text}"
    listed = OverridesParser.create().parse_override(f"{key}=[{value}]")
    if key in command.groups or "(" in value or wrong_type(command, listed):
        return InputError(f"{text} gives several values; for one run with each, type {line}")
    return InputError(
        f"{text} gives several values; for a list, type {key}=[{value}]; for one run with each, "
        f"type {line}"
    )


def wrong_value(config: DictConfig, key: str, value: Any, text: str, reason: str) -> InputError:
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
