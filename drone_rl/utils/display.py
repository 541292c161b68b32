"""Texts, tables, figures and HTML pages of results.

Pages show strings from files of unknown origin. Two defences keep them from execution. Templates
escape every value. And the page's Content-Security-Policy allows exactly the page's script and
style, by their hashes: no inline script, event handler, style attribute or request to another host.
"""

import base64
import hashlib
import html
import io
import urllib.parse
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    import jinja2
    from markupsafe import Markup
    from matplotlib.figure import Figure
    from PIL.Image import Image


class Result:
    """Base of the results of analyses: their `repr` is the text that `print` shows."""

    __slots__ = ()

    def __init_subclass__(cls) -> None:
        """Set `__repr__` before `dataclasses.dataclass` would add one of all fields."""
        super().__init_subclass__()
        cls.__repr__ = Result.__repr__

    def __str__(self) -> str:
        """Return the text for a terminal."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return str(self)


class TableResult(Result):
    """A result that is shown as a table, with notes below it and perhaps a figure."""

    __slots__ = ()
    are_numbers: ClassVar[bool] = False
    """Whether all columns but the first are aligned to the right."""

    def rows(self) -> list[list[str]]:
        """Return a table of texts: a header, then one row each."""
        raise NotImplementedError

    def notes(self) -> Sequence[str]:
        """Return the lines below the table."""
        return ()

    def figure(self) -> "Figure | Image | None":
        """Return what notebooks show below the notes, if anything."""

    def __str__(self) -> str:
        """Return the table for a terminal, and the notes."""
        return "\n".join([aligned(self.rows(), are_numbers=self.are_numbers), *self.notes()])

    def _repr_html_(self) -> str:
        head, *rows = self.rows()
        figure = self.figure()
        return table(head, rows, self.notes()) + ("" if figure is None else picture(figure))


def aligned(rows: Sequence[Sequence[str]], *, are_numbers: bool = False) -> str:
    """Return rows of texts as a table with aligned columns.

    `are_numbers` aligns all columns but the first to the right.
    """
    rest = str.rjust if are_numbers else str.ljust
    first, *others = (2 + max(map(len, column)) for column in zip(*rows, strict=True))
    lines = (row[0].ljust(first) + "".join(map(rest, row[1:], others)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """Return rows of texts, one for each column, as an HTML table, with a paragraph for each note.

    Every text is escaped.
    """
    cells = "".join(f"<th>{html.escape(text)}</th>" for text in head)
    lines = "".join(
        f"<tr>{''.join(f'<td>{html.escape(text)}</td>' for text in row)}</tr>" for row in rows
    )
    below = "".join(map(paragraph, notes))
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{lines}</tbody></table>{below}"


def paragraph(text: str) -> str:
    """Return a text as an HTML paragraph, escaped."""
    return f"<p>{html.escape(text)}</p>"


def picture(figure: "Figure | Image") -> str:
    """Return a figure or image as an embedded image."""
    from PIL.Image import Image as PilImage  # not at the start of every program

    buffer = io.BytesIO()
    if isinstance(figure, PilImage):
        figure.save(buffer, "png")
    else:
        figure.savefig(buffer, format="png", dpi=90)
    return f'<img src="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}">'


def page(document: str, height: int = 800) -> str:
    """Return an HTML page as an element of a notebook, which its scripts can't access."""
    return (
        f'<iframe sandbox="allow-scripts" srcdoc="{html.escape(document)}" '
        f'style="width: 100%; height: {height}px; border: 0"></iframe>'
    )


_SOURCES = (
    "default-src 'none'",
    "base-uri 'none'",
    "form-action 'none'",
    "object-src 'none'",
    "img-src data:",
    "media-src data:",
)
"""Sources of every page: embedded images and videos."""
_TYPES = ("require-trusted-types-for 'script'", "trusted-types 'none'")
"""Forbid the page's own script to turn text into markup or code."""


def page_environment(*packages: str) -> "jinja2.Environment":
    """Return an environment for the templates in packages, earlier ones first; values are escaped.

    It has the filters `folder_link`, a relative link to a folder by its path, and jinja's `tojson`,
    whose result can stand in a script element: no character of it ends that element.
    """
    import jinja2  # most users of this module need no template

    loaders = [jinja2.PackageLoader(package) for package in packages]
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(loaders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["folder_link"] = folder_link
    return environment


def static_text(environment: "jinja2.Environment", names: Sequence[str]) -> "Markup":
    """Return files of a page's style or script, joined, without any value put into them.

    Raises:
        ValueError: A file would end the element that it stands in.
    """
    assert environment.loader is not None
    files = [environment.loader.get_source(environment, name)[0] for name in names]
    text = "\n".join(files).replace("\r\n", "\n")  # as browsers read it before they hash it
    if "</" in text or "<!--" in text:
        raise ValueError(f"{', '.join(names)} would end the element that holds them")
    from markupsafe import Markup

    return Markup(text)


def content_security_policy(style: str, script: str = "") -> str:
    """Return the policy of a page with one style element and one script element.

    No script is allowed if the text of the script is empty.
    """
    scripts = f"script-src {_hash(script)}" if script else "script-src 'none'"
    return "; ".join((*_SOURCES, f"style-src {_hash(style)}", scripts, *_TYPES))


def folder_link(name: str) -> str:
    """Return a link to a folder below that of the page, whatever the folder is called."""
    return f"./{urllib.parse.quote(name)}/"


def _hash(text: str) -> str:
    """Return the source expression that allows an inline element with exactly this text."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"
