"""Tables of all settings in Markdown: allowed values, unit, default and meaning."""

import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from drone_rl.cli.hydra.composition import CHOSEN, GROUPS, PARTS, SEVERAL
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.config import TASKS, BaseTaskSettings
from drone_rl.config.appearance import ByName
from drone_rl.config.configuration import Changes
from drone_rl.config.parts import Part
from drone_rl.config.reach import ReachStartSettings
from drone_rl.config.terms import ALL_TERMS
from drone_rl.sim.tasks import shipped_terms_kernel as shipped
from drone_rl.utils.schema import OneOf, Several, Span
from drone_rl.utils.settings import (
    Settings,
    about,
    hints_of,
    inner_types,
    meanings,
    plain,
    unit_of,
)

BAR = "&#124;"
"""A bar within a cell."""
_TASK = "task"
_NESTED = (ReachStartSettings,)
"""Settings inside of others, whose tables contain them."""
_HEAD = "| setting | values | unit | default | meaning |\n| --- | --- | --- | --- | --- |"


_VARIANTS = {**PARTS, **SEVERAL, **{group: part for group, (part, _) in CHOSEN.items()}}
"""Groups whose choices are variants of a part."""


def list_groups() -> str:
    """Return a table for each group of settings, such as task and camera."""
    return "\n\n".join(
        [
            f"### {_TASK}",
            about(BaseTaskSettings),
            *(f"**`{n}`** {about(cls)}\n\n{make_table(cls, 'task.')}" for n, cls in TASKS.items()),
            *(
                f"### {group}\n\n{about(cls)}\n\n{make_table(cls, f'{group}.')}"
                for group, (cls, _) in GROUPS.items()
            ),
        ]
    )


def list_terms() -> str:
    """Return a table of the terms that any task can name."""
    rows = ["| kind | term | numbers, with their defaults | meaning |", "| --- | --- | --- | --- |"]
    for terms in ALL_TERMS.values():
        for name, term in terms.by_name.items():
            if getattr(term.function, "__module__", "") == shipped.__name__:
                numbers = ", ".join(f"`{n}={value:g}`" for n, value in term.settings())
                rows.append(f"| {terms.kind} | `{name}` | {numbers} | {term.meaning} |")
    return "\n".join(rows)


def list_parts() -> str:
    """Return the parts of a training that have variants, with a table for each variant."""
    return "\n\n".join(_part(group, part) for group, part in _VARIANTS.items())


def list_commands() -> str:
    """Return a table of the settings of each command."""
    lines = []
    for name in COMMANDS:
        lines += [f"### drone-rl {name}", make_table(find_command(name))]
    return "\n\n".join(lines)


def list_choices(conf: Path) -> str:
    """Return a table of the groups and their choices: files of conf/, and registered names."""
    folders = {path.parent for path in conf.glob("**/*.yaml")} - {conf, conf / "hydra"}
    registered: dict[str, list[str]] = {group: [choice] for group, (_, choice) in GROUPS.items()}
    registered |= {
        group: [*part.registry] for group, part in _VARIANTS.items() if group not in SEVERAL
    } | {_TASK: [*TASKS]}
    names = {
        str(folder.relative_to(conf)): [p.stem for p in folder.glob("*.yaml")] for folder in folders
    }
    rows = ["| group | choices |", "| --- | --- |"]
    for group in sorted({*names, *registered}):
        choices = sorted([*names.get(group, ()), *registered.get(group, ())])
        rows.append(f"| `{group}` | {', '.join(f'`{name}`' for name in choices)} |")
    return "\n".join(rows)


def list_presets(conf: Path) -> str:
    """Return a table of the ready-made sets, described by the first comment of their files."""
    rows = ["| command | description |", "| --- | --- |"]
    for group in ("experiment", "sweep"):
        for path in sorted((conf / group).glob("*.yaml")):
            _, _, words = first_comment(path).partition(": ")
            rows.append(f"| `drone-rl train {group}={path.stem}` | {words} |")
    return "\n".join(rows)


def make_table(cls: type[Settings], prefix: str = "") -> str:
    """Return a table of the settings of a class.

    Args:
        cls: The class.
        prefix: Before the name of each, such as "task.".
    """
    return "\n".join([_HEAD, *_rows(cls(), prefix)])


def _rows(defaults: Settings, prefix: str) -> Iterator[str]:
    words = meanings(type(defaults))
    for name, hint in hints_of(type(defaults)).items():
        value = getattr(defaults, name)
        inner = {name: value} if isinstance(value, Settings) else value
        if typing.get_origin(hint) is dict or type(value) in _NESTED:
            for inside, settings in inner.items():
                path = inside if inside == name else f"{name}.{inside}"
                yield from _rows(settings, f"{prefix}{path}.")
        else:
            meaning = words[name].replace("|", BAR)
            range_of = f"{_may_be(hint)} | {unit_of(hint)} | {_shown(value)}"
            yield f"| `{prefix}{name}` | {range_of} | {meaning} |"
            (kind, *_) = inner_types(hint)
            if isinstance(kind, ByName):
                yield from _rows(kind.inside(), f"{prefix}{name}.NAME.")


def first_comment(path: Path) -> str:
    """Return the first comment of a file of settings, without directives to Hydra."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("# @package")]
    count = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return " ".join(line.removeprefix("#").strip() for line in lines[:count])


def _part(group: str, part: type[Part]) -> str:
    lines = [f"### {group}", about(part)]
    for name, variant in part.registry.items():
        lines.append(f"**`{name}`** {about(variant)}")
        if variant.model_fields:
            inside = f"{name}." if group in (*SEVERAL, *CHOSEN) else ""
            lines.append(make_table(variant, f"{group}.{inside}"))
    return "\n\n".join(lines)


def _may_be(hint: Any) -> str:
    """The allowed values of an annotation, or of a kind, in words."""
    (kind, *_) = inner_types(hint)
    if type(None) in typing.get_args(hint):
        return f"{_may_be(kind)}; or null"
    of = getattr(kind, "of", kind)
    if isinstance(kind, Changes):
        return f"changes to the policy's {_link(kind.of or BaseTaskSettings)}"
    if isinstance(of, type) and issubclass(of, Settings):
        return _link(of)
    match kind:
        case Span():
            return f"{_may_be(kind.kind)}, or a range [LOW,HIGH] of such values"
        case Several(least=least, most=most):
            count = most if least == most else f"{least} to {most}"
            return f"{count} values, each {_may_be(kind.kind)}"
        case OneOf():
            return " or ".join(f"`{name}`" for name in kind.names)
    if typing.get_origin(kind) is typing.Literal:
        return " or ".join(f"`{name}`" for name in typing.get_args(kind))
    return "true or false" if kind is bool else getattr(kind, "words", "") or "a text"


def _link(cls: type) -> str:
    """A link to the settings of a group."""
    groups = {
        BaseTaskSettings: _TASK,
        **{c: g for g, (c, _) in GROUPS.items()},
        **{c: g for g, c in _VARIANTS.items()},
    }
    return f"[{groups[cls]}](#{groups[cls]})"


def _shown(value: Any) -> str:
    """A default as typed on the command line; for parts their names."""
    several = value if isinstance(value, tuple) else (value,)
    if several and all(isinstance(one, Part) for one in several):
        return ", ".join(f"`{one.name}`" for one in several)
    if isinstance(value, Settings):
        return ""
    text = yaml.safe_dump(plain(value), default_flow_style=True, width=1000).splitlines()[0]
    return f"`{text}`"
