"""XML elements that remember their file and line: read within limits, and written."""

import dataclasses
import xml.parsers.expat
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from drone_rl.utils.errors import InputError

_MOST_DEPTH = 100
_MOST_ELEMENTS = 50_000


@dataclasses.dataclass(eq=False)
class Element:
    """An XML element with attributes and children, which is all that MJCF has."""

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    children: list["Element"] = dataclasses.field(default_factory=list)

    def get(self, name: str, default: str = "") -> str:
        """Return an attribute."""
        return self.attributes.get(name, default)

    def every(self, *tags: str) -> Iterator["Element"]:
        """Yield the elements below it in the file's order, those with some tags only if given."""
        for child in self.children:
            if not tags or child.tag in tags:
                yield child
            yield from child.every(*tags)

    def __str__(self) -> str:
        name = self.get("name") or self.get("file")
        named = f"{self.tag} {name[:60]!r}" if name else self.tag
        return f"line {self.line} of {self.file.name}, {named}"


def parse(content: bytes, file: Path) -> Element:
    """Return the root of an XML file.

    Raises:
        InputError: It is no XML, has a DTD (entities), or too many or too deep elements.
    """
    stack, roots, count = [], [], 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > _MOST_ELEMENTS or len(stack) > _MOST_DEPTH:
            most = f"at most {_MOST_ELEMENTS} elements, {_MOST_DEPTH} deep"
            raise InputError(f"{file.name} has too many elements; give a file of {most}")
        element = Element(tag, attributes, file, parser.CurrentLineNumber)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def refuse(*_: Any) -> None:
        raise InputError(f"{file.name} has a DTD (<!DOCTYPE ...>); remove it")

    parser = xml.parsers.expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, lambda _: stack.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(_without_comments(content), True)
    except (xml.parsers.expat.ExpatError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{file.name} is no XML ({error}); correct it") from None
    return roots[0]


def _without_comments(content: bytes) -> bytes:
    """Return XML without comments, on the same lines: MuJoCo accepts -- in them, XML does not."""
    parts, at = [], 0
    while (begin := content.find(b"<!--", at)) >= 0:
        end = content.find(b"-->", begin)
        if end < 0:
            break
        parts += [content[at:begin], b"\n" * content.count(b"\n", begin, end)]
        at = end + 3
    return b"".join([*parts, content[at:]])


def write(root: Element) -> tuple[str, list[Element]]:
    """Return the text of an element, one element a line, and the element of each line."""
    lines: list[str] = []
    of_line: list[Element] = []

    def add(element: Element) -> None:
        attributes = "".join(f" {n}={quoteattr(v)}" for n, v in element.attributes.items())
        lines.append(f"<{element.tag}{attributes}{'' if element.children else '/'}>")
        of_line.append(element)
        for child in element.children:
            add(child)
        if element.children:
            lines.append(f"</{element.tag}>")
            of_line.append(element)

    add(root)
    return "\n".join(lines), of_line
