"""HTML pages with one string at all places that a string of a file can reach.

There are two kinds of pages. For one, files are changed and read again, and the page shows what
the readers accept. Readers refuse many strings, so for the other kind the templates get values that
no reader has checked.
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
from drone_rl.utils.text import said

Place = tuple[tuple[Any, ...], bool]
"""Path of keys to an entry, and whether the place is its name (else its value)."""
PIXEL = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAA="
_PROBE = "'\"<b x='>&"
"""A string like the payloads, with which places are tested."""
_LONG_PROBE = _PROBE.ljust(200, "x")
"""A string longer than any payload; some texts, such as dates, accept short payloads only."""


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[Place]:
    """Yield the places of texts in plain data: names of entries and values."""
    if isinstance(value, str):
        yield path, False
    items = value.items() if isinstance(value, Mapping) else ()
    for key, item in items if isinstance(value, Mapping) else enumerate(as_list(value)):
        if isinstance(value, Mapping):
            yield (*path, key), True
        yield from places(item, (*path, key))


def as_list(value: Any) -> list[Any]:
    """Return the argument if it is a list, else an empty list."""
    return value if isinstance(value, list) else []


def put(value: Any, where: frozenset[Place], text: str, path: tuple[Any, ...] = ()) -> Any:
    """Return a copy of plain data with a text at some places; names stay unique."""
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
    """Return the places that accept a text at the same time. Top-level names are kept.

    Places that differ only in the index of a list's item are tested together.

    Args:
        value: Plain data.
        works: Raises an error if a text is refused.
        among: Places to test; all by default.
        probe: Text to test.
    """

    def holds(where: frozenset[Place]) -> bool:
        try:
            works(put(value, where, probe))
        except Exception:  # readers and templates can raise any error
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


class _PixelImages(dict[str, str]):
    """An image of one pixel under every name, as well as several with the payload as caption."""

    text: str = ""

    def __missing__(self, name: str) -> str:
        pixel = _Pixel(PIXEL)
        pixel.caption = self.text
        return pixel


class _Pixel(str):
    """A data URI that is also a mapping of one."""

    caption: str = ""

    def items(self) -> list[tuple[str, str]]:
        """Return caption and data URI."""
        return [(self.caption, PIXEL)]


class _Forged(Explanation):
    """An explanation with unchecked terms and action names."""

    text: str = ""
    forged_terms: TaskVocabulary | None = None

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
        if self.forged_terms is None:
            known = super().terms.as_dict()
            kept = [place for place in places(known) if not (place[1] and len(place[0]) == 1)]
            self.forged_terms = TaskVocabulary(
                **put(known, frozenset(kept if self.text else ()), self.text)
            )
        return self.forged_terms


@dataclasses.dataclass(frozen=True)
class _ForgedPolicy(Policy):
    """A policy that gives templates the payload for every text."""

    text: str = ""
    extras: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Extras of parts that are slow to compute, by title."""

    def show(self, part: Part) -> dict[str, Any]:
        """See `Policy`."""
        explanation = self.explanation
        extras = self.extras.get(part.title) or part.extras(explanation)
        found = {n: [*said(may, explanation.numbers).values()] for n, may in part.text.items()}
        if self.text:
            plain = json.loads(json.dumps({k: v for k, v in extras.items() if k != "svg"}))
            extras = {**extras, **_everywhere(plain, self.text)}
            found = {name: [*claims, self.text] for name, claims in found.items()}
        pictures = _PixelImages({} if extras.get("rows") == [] else {"shown": PIXEL})
        pictures.text = self.text
        return {
            "name": explanation.name,
            "numbers": explanation.numbers,
            "actions": explanation.actions,
            "pictures": pictures,
            "text": {name: " ".join(claims) for name, claims in found.items()},
            "found": found,
            "terms": explanation.terms,
            "extras": extras,
        }


def _everywhere(extras: Mapping[str, Any], text: str) -> dict[str, Any]:
    """Replace all texts but images by the payload, and the steps and episodes of frames."""
    where = {place for place in places(extras) if not place[1] and "sprite" not in place[0]}
    forged = put(extras, frozenset(where), text)
    if "points" in forged:
        count = len(forged["points"]["step"])
        forged["points"] |= {"step": [text] * count, "last": [text] * count}
        forged["points"]["event"] = [text] * count
    return forged


_OPEN = {"ends", "baselines", "terms", "provenance", "versions", "settings", "seconds", "shares"}
"""Mappings whose keys are shown on pages."""


@functools.cache
def _sources() -> frozenset[str]:
    """Return all words in the source of reports; entries with such a name must keep it."""
    root = resources.files("drone_rl")
    files = [
        file
        for folder in (
            *("trust", "verification", "utils", "sim", "trust/plots"),
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
"""Optional parts of an explanation."""


class Pages:
    """Pages of an explanation and a sweep with an inserted text."""

    def __init__(
        self, explanation: Path, summary: Mapping[str, Any], folder: Path, *, names: bool = True
    ) -> None:
        """Find all places that accept a text.

        Args:
            explanation: Folder of an explanation.
            summary: Result of `sweeps.summary.summarise_sweep`.
            folder: Folder of the files; created if missing.
            names: Whether to replace names of entries, too; finding them takes half a minute.
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

    def inject(self, text: str) -> dict[str, str]:
        """Return the pages with a text at all places, by name."""
        numbers = self._known.numbers
        picture = {"title": text, "text": text, "light": PIXEL, "dark": PIXEL}
        other = {text: {text: text}}
        forged = self._report({**put(numbers, self.of_templates, text), **other}, text)
        try:
            read = self._read({**put(numbers, self.of_files, text), **other})
        except InputError:  # too long for one place
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
        html = render_page([_ForgedPolicy(forged, figures, "x", text, self._extras)])
        if html.count("<section") < self._sections:
            raise InputError("a section of the page is missing")
        return html

    def _read(self, numbers: dict[str, Any]) -> dict[str, Any]:
        """Write the numbers to a file and return what the reader accepts.

        Raises:
            InputError: The reader refuses them.
        """
        target = self._folder / "changed"
        if not target.exists():
            shutil.copytree(self._source, target)
        (target / "explanation.json").write_text(json.dumps(numbers))
        return copy.deepcopy(Explanation.load(target).numbers)


_BARE = "<!doctype html><html><head><title>notebook</title></head><body>{}</body></html>"


def without_policy(html: str) -> str:
    """Return a page without its content security policy, to test escaping alone."""
    start = html.index("<meta http-equiv")
    return html[:start] + html[html.index(">", start) + 1 :]


def with_markup(html: str, text: str) -> str:
    """Return a page with a text as markup, to test the content security policy alone."""
    return html.replace("</nav>", f"</nav>{Markup(text)}", 1)
