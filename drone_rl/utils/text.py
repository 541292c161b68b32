"""Text for reports: numbers, lists, and templates whose sentences stand below conditions."""

import functools
import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2

    from drone_rl.utils.intervals import Mean, Share

ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")
_ENDINGS = {1: "st", 2: "nd", 3: "rd"}


def render(package: str, template: str, **values: Any) -> str:
    """Return the text of a template in a package's folder `templates`.

    Spaces and line breaks of templates of sentences (.j2) are one space each; those of Markdown
    (.md.j2) stay. Templates have the functions of this module as filters.
    """
    text = _environment(package).get_template(template).render(**values)
    return text if template.endswith(".md.j2") else " ".join(text.split())


@functools.cache
def _environment(package: str) -> "jinja2.Environment":
    import jinja2  # most users of this module need no template

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= FILTERS
    return environment


def count(number: int) -> str:
    """Return a count with commas at thousands."""
    return f"{number:,}"


def setting(value: Any) -> str:
    """Return a value as one types it in a setting."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(setting, value))}]"
    if isinstance(value, float):
        return f"{value:.12g}"  # without ".0"
    return value if isinstance(value, str) else json.dumps(value)


def listed(parts: Sequence[str], last: str = "and") -> str:
    """Return a list in a sentence."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {last} {parts[-1]}"


def plural(count: int, noun: str, several: str = "") -> str:
    """Return a count with its noun; `several` is the plural if it is not regular."""
    return f"{count} {noun}" if count == 1 else f"{count} {several or f'{noun}s'}"


def ordinal(number: int) -> str:
    """Return the ordinal of an index from 0."""
    if number < len(ORDINALS):
        return ORDINALS[number]
    place = number + 1
    is_teen = place % 100 in (11, 12, 13)
    return f"{place}{'th' if is_teen else _ENDINGS.get(place % 10, 'th')}"


def percent(share: float, digits: int = 1) -> str:
    """Return a rate in percent with so many decimals; 0% and 100% only if it is exactly 0 or 1."""
    if share in (0, 1):
        return f"{share:.0%}"
    text, step = f"{100 * share:.{digits}f}%", 10.0**-digits
    if float(text[:-1]) >= 100:
        return f">{100 - step:g}%"
    return f"<{step:g}%" if share >= 0 and float(text[:-1]) <= 0 else text


def at_most(share: float, digits: int = 1) -> str:
    """Return an upper bound of a rate in percent with so many decimals, rounded up."""
    steps = 10.0 ** (digits + 2)
    return percent(min(math.ceil(round(share * steps, 6)) / steps, 1.0), digits)


exact_percent = functools.partial(percent, digits=2)
"""Returns a known fraction in percent with two decimals."""


def interval(figure: "Share | Mean") -> str:
    """Return the 95% confidence interval of a rate."""
    ends = dict(figure)
    return f"{percent(ends['lower95'])} to {percent(ends['upper95'])}"


def rate(figure: "Share | Mean", label: str = "95% CI ") -> str:
    """Return a rate with its 95% confidence interval, which the label precedes.

    A rate of None is "not offered".
    """
    of = dict(figure)
    share = of["share"] if "share" in of else of["mean"]
    return "not offered" if share is None else f"{percent(share)} ({label}{interval(figure)})"


FILTERS = {
    f.__name__: f for f in (percent, at_most, interval, rate, listed, plural, count, setting)
}
"""Filters of templates, also of pages."""
