"""Pages of HTML into which one string was put wherever a string from a file can reach.

A string takes two ways to a page. Files are changed and read again, and what their readers accept
is written into a page. And since readers refuse many strings, the templates are also called with
values that no reader has checked, so that each string does reach the page.
"""

import copy
import dataclasses
import functools
import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from markupsafe import Markup

from drone_rl.explanations.report import embedding
from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.explanations.report.page import Policy, render_page
from drone_rl.sim.vocabulary import ShownActions, TaskVocabulary
from drone_rl.sweeps.report import render_page as render_sweep
from drone_rl.utils.display import page, paragraph, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.text import say

Place = tuple[tuple[Any, ...], bool]
"""Keys that lead to an entry, and whether its name is meant and not its value."""
PIXEL = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAA="
_PROBE = "'\"<b x='>&"
"""Stands for all payloads where places for them are looked for."""
_LONG_PROBE = _PROBE.ljust(200, "x")
"""Longer than any payload: some texts, such as dates, can hold the short ones alone."""


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[Place]:
    """Return where plain data holds a text: as the name of an entry or as a value."""
    if isinstance(value, str):
        yield path, False
    items = value.items() if isinstance(value, Mapping) else ()
    for key, item in items if isinstance(value, Mapping) else enumerate(as_list(value)):
        if isinstance(value, Mapping):
            yield (*path, key), True
        yield from places(item, (*path, key))


def as_list(value: Any) -> list[Any]:
    """Return a list as it is, and an empty one of anything else."""
    return value if isinstance(value, list) else []


def put(value: Any, where: frozenset[Place], text: str, path: tuple[Any, ...] = ()) -> Any:
    """Return a copy of plain data with a text in these places; names stay different."""
    if isinstance(value, str):
        return text if (path, False) in where else value
    if isinstance(value, list):
        return [put(item, where, text, (*path, i)) for i, item in enumerate(value)]
    if not isinstance(value, Mapping):
        return value
    result = {}
    for number, (key, item) in enumerate(value.items()):
        name = f"{text}{number}" if ((*path, key), True) in where else key
        result[name] = put(item, where, text, (*path, key))
    return result


def accepted(
    value: Any,
    works: Callable[[Any], object],
    among: frozenset[Place] | None = None,
    probe: str = _PROBE,
) -> frozenset[Place]:
    """Return all places, together, in which a text is no error; entries of the whole keep names.

    Places that differ in the number of a list's item alone are tried together.

    Args:
        value: Plain data.
        works: Raises an error where a text is refused.
        among: Places to try; all by default.
        probe: The text that is tried.
    """

    def holds(where: frozenset[Place]) -> bool:
        try:
            works(put(value, where, probe))
        except Exception:  # whatever a reader or a template makes of nonsense
            return False
        return True

    alike: dict[Place, set[Place]] = {}
    for path, is_name in places(value):
        if (len(path) > 1 or not is_name) and (among is None or (path, is_name) in among):
            pattern = tuple("*" if isinstance(key, int) else key for key in path)
            alike.setdefault((pattern, is_name), set()).add((path, is_name))
    kept: frozenset[Place] = frozenset()
    waiting = [list(alike.values())]
    while waiting:
        part = waiting.pop()
        where = kept.union(*part)
        if holds(where):
            kept = where
        elif len(part) > 1:
            middle = len(part) // 2
            waiting += [part[middle:], part[:middle]]
    return kept


class _Drawn(dict[str, str]):
    """One pixel for each picture that a template asks for."""

    def __missing__(self, name: str) -> str:
        return PIXEL


class _Forged(Explanation):
    """An explanation whose terms and actions no reader has checked."""

    text: str = ""
    made: TaskVocabulary | None = None

    @property
    def name(self) -> str:
        """See `Explanation`."""
        return self.text or super().name

    @property
    def actions(self) -> ShownActions:
        """See `Explanation`."""
        known = super().actions
        names = tuple(f"{self.text}{name}" for name in known.names)
        return dataclasses.replace(known, names=names)

    @property
    def terms(self) -> TaskVocabulary:
        """See `Explanation`."""
        if self.made is None:
            known = super().terms.as_dict()
            kept = [place for place in places(known) if not (place[1] and len(place[0]) == 1)]
            self.made = TaskVocabulary(
                **put(known, frozenset(kept if self.text else ()), self.text)
            )
        return self.made


@dataclasses.dataclass(frozen=True)
class _ForgedPolicy(Policy):
    """Gives templates a text wherever they show one."""

    text: str = ""
    extras: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """What is known of a part by its title, and slow to make."""

    def show(self, part: Part) -> dict[str, Any]:
        """See `Policy`."""
        explanation = self.explanation
        extras = self.extras.get(part.title) or part.extras(explanation)
        sentences = {name: say(may, explanation.numbers) for name, may in part.text.items()}
        if self.text:
            plain = json.loads(json.dumps({k: v for k, v in extras.items() if k != "svg"}))
            extras = {**extras, **_everywhere(plain, self.text)}
            sentences = {name: f"{text} {self.text}" for name, text in sentences.items()}
        return {
            "name": explanation.name,
            "numbers": explanation.numbers,
            "actions": explanation.actions,
            "pictures": _Drawn({} if extras.get("rows") == [] else {"shown": PIXEL}),
            "text": sentences,
            "terms": explanation.terms,
            "extras": extras,
        }


def _everywhere(extras: Mapping[str, Any], text: str) -> dict[str, Any]:
    """A text as each value that is a text, but for a picture; and as frames' steps and episodes."""
    where = {place for place in places(extras) if not place[1] and "sprite" not in place[0]}
    forged = put(extras, frozenset(where), text)
    if "points" in forged:
        count = len(forged["points"]["step"])
        forged["points"] |= {"step": [text] * count, "last": [text] * count}
        forged["points"]["event"] = [text] * count
    return forged


_OPEN = {"ends", "baselines", "terms", "provenance", "versions", "settings", "seconds", "shares"}
"""Mappings of which pages show the names of all entries."""


@functools.cache
def _sources() -> frozenset[str]:
    """All words of the code that makes reports; an entry that it asks for must keep its name."""
    root = resources.files("drone_rl")
    files = [
        file
        for folder in (
            *("evaluation", "robustness", "verification", "utils", "sim", "evaluation/plots"),
            *("explanations/report", "explanations/report/templates/sections"),
        )
        for file in root.joinpath(folder).iterdir()
        if file.is_file()
    ]
    return frozenset(re.findall(r"\w+", " ".join(file.read_text() for file in files)))


def _is_tried(place: Place, names: bool) -> bool:
    path, is_name = place
    if not is_name:
        return True
    return names and (path[-1] not in _sources() or bool(_OPEN.intersection(path[:-1])))


_MORE = {"left_out": {"embedding": "why"}, "shifts": {"refused": "why"}, "other": {"name": "text"}}
"""Parts of the page that not every explanation has."""


class Pages:
    """Makes pages out of an explanation and a summary of a sweep."""

    def __init__(
        self, explanation: Path, summary: Mapping[str, Any], folder: Path, *, names: bool = True
    ) -> None:
        """Looks for all places in which a text is accepted.

        Args:
            explanation: Folder of one.
            summary: As `sweeps.summary.summarise_sweep` makes it.
            folder: For files; made if need be.
            names: Whether names of entries are replaced, too, which takes half a minute to find.
        """
        (folder / "figures").mkdir(parents=True, exist_ok=True)
        self._folder, self._source = folder, explanation
        self._known = Explanation.load(explanation)
        self._known.numbers = {**_MORE, **self._known.numbers}
        self._summary = dict(summary)
        self._extras = {embedding.PART.title: embedding.PART.extras(self._known)}
        self._sections = 0
        self._sections = self._report(self._known.numbers, "").count("<section")
        numbers = self._known.numbers
        among = frozenset(place for place in places(numbers) if _is_tried(place, names))
        self.of_templates = accepted(numbers, lambda n: self._report(n, ""), among)
        self.of_files = accepted(numbers, self._read, self.of_templates)
        self.of_long = accepted(numbers, self._read, self.of_files, _LONG_PROBE)
        self.of_sweeps = accepted(self._summary, lambda s: render_sweep("x", s, []))

    def made(self, text: str) -> dict[str, str]:
        """Return the pages that hold a text, by name."""
        numbers = self._known.numbers
        picture = {"title": text, "text": text, "light": PIXEL, "dark": PIXEL}
        other = {text: {text: text}}
        forged = self._report({**put(numbers, self.of_templates, text), **other}, text)
        try:
            read = self._read({**put(numbers, self.of_files, text), **other})
        except InputError:  # too long for one of the places
            read = self._read({**put(numbers, self.of_long, text), **other})
        sweep = render_sweep(text, put(self._summary, self.of_sweeps, text), [picture])
        return {
            "report": forged,
            "report_of_files": self._report(read, ""),
            "report_without_policy": without_policy(forged),
            "sweep": sweep,
            "sweep_without_policy": without_policy(sweep),
            "notebook": _BARE.format(table([text], [[text]]) + paragraph(text) + page(forged)),
        }

    def _report(self, numbers: dict[str, Any], text: str) -> str:
        known = self._known
        forged = _Forged(numbers, known.arrays, known.data, text or known.source)
        forged.text = text
        figures = self._folder / "figures"
        made = render_page([_ForgedPolicy(forged, figures, "x", text, self._extras)])
        if made.count("<section") < self._sections:
            raise InputError("a part of the page is missing")
        return made

    def _read(self, numbers: dict[str, Any]) -> dict[str, Any]:
        """What the reader of files makes of the numbers.

        Raises:
            InputError: It refuses them.
        """
        target = self._folder / "changed"
        if not target.exists():
            shutil.copytree(self._source, target)
        (target / "explanation.json").write_text(json.dumps(numbers))
        return copy.deepcopy(Explanation.load(target).numbers)


_BARE = "<!doctype html><html><head><title>notebook</title></head><body>{}</body></html>"


def without_policy(html: str) -> str:
    """Return a page without its Content-Security-Policy: escaping alone has to hold."""
    start = html.index("<meta http-equiv")
    return html[:start] + html[html.index(">", start) + 1 :]


def with_markup(html: str, text: str) -> str:
    """Return a page that holds a text as markup: the policy alone has to hold."""
    return html.replace("</nav>", f"</nav>{Markup(text)}", 1)
