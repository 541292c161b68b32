"""Tables of all settings in Markdown: allowed values, unit, default and meaning."""

import ast
import dataclasses
import functools
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from drone_rl.cli.hydra.composition import GROUPS, PARTS, SEVERAL
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.config import TASKS, BaseTaskSettings
from drone_rl.config.configuration import Changes, Variant
from drone_rl.utils.schema import Flag, Instance, Kind, Maybe, OneOf, Several, Span
from drone_rl.utils.settings import Settings, kinds_of, plain

BAR = "&#124;"
"""A bar within a cell."""
_TASK = "task"
_OR = {Maybe: "; or null", Span: ", or a range [LOW,HIGH] of such values"}
_HEAD = "| setting | values | unit | default | meaning |\n| --- | --- | --- | --- | --- |"


def list_groups() -> str:
    """Return a table for each group of settings, such as task and camera."""
    return "\n\n".join(
        [
            f"### {_TASK}",
            about(BaseTaskSettings),
            *(f"**`{n}`** {about(cls)}\n\n{make_table(cls, 'task.')}" for n, cls in TASKS.items()),
            *(
                f"### {group}\n\n{about(cls)}\n\n{make_table(cls, f'{group}.')}"
                for group, cls in GROUPS.items()
            ),
        ]
    )


def list_parts() -> str:
    """Return the parts of a training that have variants, with a table for each variant."""
    return "\n\n".join(_part(group, part) for group, part in {**PARTS, **SEVERAL}.items())


def list_commands() -> str:
    """Return a table of the settings of each command."""
    lines = []
    for name in COMMANDS:
        lines += [f"### drone-rl {name}", make_table(find_command(name))]
    return "\n\n".join(lines)


def list_choices(conf: Path) -> str:
    """Return a table of the groups of conf/ and their choices, the names of their files."""
    folders = {path.parent for path in conf.glob("**/*.yaml")} - {conf, conf / "hydra"}
    rows = ["| group | choices |", "| --- | --- |"]
    for folder in sorted(folders, key=str):
        names = ", ".join(f"`{path.stem}`" for path in sorted(folder.glob("*.yaml")))
        rows.append(f"| `{folder.relative_to(conf)}` | {names} |")
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
    defaults, words = cls(), meanings(cls)
    rows = [
        f"| `{prefix}{name}` | {_may_be(kind)} | {_unit(kind)} | "
        f"{_shown(getattr(defaults, name))} | {words[name].replace('|', BAR)} |"
        for name, kind in kinds_of(cls).items()
    ]
    return "\n".join([_HEAD, *rows])


@functools.cache
def meanings(cls: type) -> Mapping[str, str]:
    """Return the docstring of each field of a class, inherited fields included."""
    found: dict[str, str] = {}
    for part in reversed(cls.__mro__):
        if dataclasses.is_dataclass(part):
            (body,) = ast.parse(textwrap.dedent(inspect.getsource(part))).body
            found |= dict(_documented(body))
    return found


def first_comment(path: Path) -> str:
    """Return the first comment of a file of settings, without directives to Hydra."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("# @package")]
    count = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return " ".join(line.removeprefix("#").strip() for line in lines[:count])


def _part(group: str, part: type[Variant]) -> str:
    lines = [f"### {group}", about(part)]
    for variant in part.variants():
        name = variant.registered_name()
        lines.append(f"**`{name}`** {about(variant)}")
        if kinds_of(variant):
            inside = f"{name}." if group in SEVERAL else ""
            lines.append(make_table(variant, f"{group}.{inside}"))
    return "\n\n".join(lines)


def _documented(body: Any) -> Iterator[tuple[str, str]]:
    """The fields of a class's source, each with the text below it."""
    for field, below in zip(body.body, body.body[1:], strict=False):
        is_text = isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and is_text:
            yield field.target.id, " ".join(below.value.value.split())


def about(cls: type) -> str:
    """Return the first paragraph of a class's docstring."""
    return (inspect.getdoc(cls) or "").partition("\n\n")[0].replace("\n", " ")


def _may_be(kind: Kind) -> str:
    """The allowed values of a kind, in words."""
    match kind:
        case Maybe() | Span():
            return f"{_may_be(kind.kind)}{_OR[type(kind)]}"
        case Several(kind=Instance(of=cls)) | Instance(of=cls):
            return _link(cls)
        case Several():
            count = kind.most if kind.least == kind.most else f"{kind.least} to {kind.most}"
            return f"{count} values, each {_may_be(kind.kind)}"
        case Changes():
            return f"changes to the policy's {_link(kind.of or BaseTaskSettings)}"
        case OneOf():
            return " or ".join(f"`{name}`" for name in kind.names)
        case Flag():
            return "true or false"
    return getattr(kind, "words", "a text")


def _link(cls: type) -> str:
    """A link to the settings of a group."""
    groups = {
        BaseTaskSettings: _TASK,
        **{c: g for g, c in GROUPS.items()},
        **{c: g for g, c in {**PARTS, **SEVERAL}.items()},
    }
    return f"[{groups[cls]}](#{groups[cls]})"


def _unit(kind: Kind) -> str:
    inner = getattr(kind, "kind", kind)
    return getattr(getattr(inner, "kind", inner), "unit", "")


def _shown(value: Any) -> str:
    """A default as typed on the command line; for parts their names."""
    several = value if isinstance(value, tuple) else (value,)
    if several and all(isinstance(one, Variant) for one in several):
        return ", ".join(f"`{one.name}`" for one in several)
    if isinstance(value, Settings):
        return ""
    text = yaml.safe_dump(plain(value), default_flow_style=True, width=1000).splitlines()[0]
    return f"`{text}`"
