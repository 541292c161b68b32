"""HTML pages that run no script but their own and load nothing from elsewhere.

Pages show strings out of files that somebody else may have written. Two independent defences keep
these strings from being executed. Templates escape every value, so that a string reaches the page
as text. And the page's Content-Security-Policy allows exactly the page's own script and style, by
their hashes: neither an inline script, nor an event handler, nor a style attribute, nor a request
to another host is allowed.
"""

import base64
import hashlib
import urllib.parse
from collections.abc import Sequence

import jinja2
from markupsafe import Markup

_SOURCES = (
    "default-src 'none'",
    "base-uri 'none'",
    "form-action 'none'",
    "object-src 'none'",
    "img-src data:",
    "media-src data:",
)
"""What every page may load: images and films that are part of it."""
_TYPES = ("require-trusted-types-for 'script'", "trusted-types 'none'")
"""Makes it an error of the page's own script to turn text into markup or into code."""


def page_environment(*packages: str) -> jinja2.Environment:
    """Return an environment for the templates of a page; every value is escaped.

    It has the filters `folder_link`, a relative link to a folder by its name, and jinja's `tojson`,
    whose result can stand in a script element: no character of it ends that element.

    Args:
        packages: Each has a folder `templates`; earlier ones come first.
    """
    loaders = [jinja2.PackageLoader(package) for package in packages]
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(loaders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["folder_link"] = folder_link
    return environment


def static_text(environment: jinja2.Environment, names: Sequence[str]) -> Markup:
    """Return files of a page's style or script, joined, without any value put into them.

    Args:
        environment: From `page_environment`.
        names: Of files in a folder of templates.

    Raises:
        ValueError: A file would end the element that it stands in.
    """
    assert environment.loader is not None
    files = [environment.loader.get_source(environment, name)[0] for name in names]
    text = "\n".join(files).replace("\r\n", "\n")  # as browsers read it before they hash it
    if "</" in text or "<!--" in text:
        raise ValueError(f"{', '.join(names)} would end the element that holds them")
    return Markup(text)


def content_security_policy(style: str, script: str = "") -> str:
    """Return the policy of a page with one style element and at most one script element.

    Args:
        style: Text of the style element.
        script: Text of the script element; none is allowed if it is empty.
    """
    scripts = f"script-src {_hash(script)}" if script else "script-src 'none'"
    return "; ".join((*_SOURCES, f"style-src {_hash(style)}", scripts, *_TYPES))


def folder_link(name: str) -> str:
    """Return a link to a folder next to the page, whatever the folder is called."""
    return f"./{urllib.parse.quote(name, safe='')}/"


def _hash(text: str) -> str:
    """The source expression that allows an inline element with exactly this text."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"
