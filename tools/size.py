"""`make count`: print the size of the package as JSON, including phrases to rewrite.

`python -m tools.size PATH...` prints each phrase to rewrite below the paths, and the replacement.
"""

import ast
import io
import json
import re
import sys
import tokenize
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tools.mirror import ROOT, modules_without_test

SMALL = 60
"""Modules with fewer lines and a single importer count as `single_use_modules`."""
PROSE = ("drone_rl", "docs", "conf", "README.md", "AGENTS.md", "tools", "examples")
"""Paths whose phrases are counted; those that do not exist are ignored."""
_TASK = re.compile(r'^```python title="post.py"\n(.*?)^```$', re.DOTALL | re.MULTILINE)
_SUFFIXES = (".py", ".md", ".yaml", ".html", ".j2")
_SUPPRESSION = re.compile(r"^# pyright: (?!reportUnnec)", re.M)
_ASIDE = "(?:draws|flies|makes|asks|learns|knows|has|does|wants|waits|keeps|can)"
PHRASES = {
    r"\b(?:is|are|was|be|been|not)\stold\b|\btells?\s(?:what|whether|how|of|it|that)\b"
    r"|\bto\sbe\stold\b": "log, report, return or document",
    rf"\bwhoever\b|\bwho\s{_ASIDE}\b": "the agent's name",
    r"\bsuch\sas\s(?:it|the\skernel|this|they)\sknows?\b|\bare\ssuch\sas\b": "supported by",
    r"\bbeside\b": "next to, compared with, in addition to",
    r"\banew\b": "again, re-run",
    r"\bof\sold\b": "previous",
    r"\bdearer\b": "slower, more expensive",
    r"^(?:#\s*|\"\"\")?What\s(?:is|are|was|has|can|makes?|goes|stands|a|the|it)\b": "a noun phrase",
    r"\bthe\sway\s(?:there|back)\b|\bways?\sthrough\b": "forward pass, backward pass, path",
    r"\b(?:is|are|was)\slooked\s(?:at|for)\b|\bworth\sa\slook\b": "inspected, searched",
    r"\bstands?\s(?:once|in|there|beside|still|alone|for\sitself)\b": "is defined in",
    r"\bby\s(?:itself|themselves)\b": "automatically",
    r"\b(?:of|by|from|for|with)\sothers\b|\bprograms\sof\sothers\b": "third-party, baselines",
    r"\bgiven\sback\b|\bgives?\sback\b": "release, return",
    r"\bis\smade\sof\b|\bwhat\s\w+\s(?:made|make|makes)\sof\b": "built from",
    r"\bat\shand\b": "available",
    r"\bas\s(?:this\smethod|it)\shas\sit\b": "as defined",
    r"\bin\searnest\b": "in full",
    r"\b\w+\salone\b": "only",
    r"\b(?:is|are|was)\sasked\b": "evaluated, called",
    r"\bwork(?:s|ed)?\sout\b": "compute",
    r"\bpictures?\b": "image, frame, observation",
}
"""Phrases to avoid, as regular expressions, and their replacements."""
_PHRASES = [(re.compile(pattern, re.I | re.M), advice) for pattern, advice in PHRASES.items()]


class Phrase(NamedTuple):
    """A phrase to rewrite."""

    path: Path
    line: int
    text: str
    advice: str


def measure(root: Path = ROOT) -> dict[str, Any]:
    """Measure the size and structure of a checkout.

    Args:
        root: Folder with `drone_rl`, `benchmarks`, `tests`, README.md and the tutorial of tasks.

    Returns:
        The counts. "training_file_lines" are those of training/train.py, "minimal_task_lines" those
        of the tutorial's task; "longest_module" is a number of lines and a path.

    Raises:
        ValueError: The tutorial contains no or several tasks.
    """
    package = _read(root, "drone_rl")
    lines = {path: text.count("\n") for path, text in package.items()}
    importers = find_importers(root)
    single = [
        path
        for path in package
        if path.name != "__init__.py"
        and len(importers[_module(root, path)]) == 1
        and lines[path] < SMALL
    ]
    suppressions = [  # Warp checks the types in kernels
        len(_SUPPRESSION.findall(text)) for p, text in package.items() if "kernel" not in p.stem
    ]
    tests = sum(text.count("\n") for text in _read(root, "tests").values())
    readme = (root / "README.md").read_text()
    training = package[root / "drone_rl" / "training" / "train.py"]
    (task,) = _TASK.findall((root / "docs" / "tutorials" / "task.md").read_text())
    longest = max(package, key=lambda path: (lines[path], path))
    return {
        "package_lines": sum(lines.values()),
        "package_modules": len(package),
        "packages": len({p.relative_to(root).parts[1] for p in package if _depth(root, p) > 2}),
        "single_use_modules": len(single),
        "type_suppressions": sum(suppressions),
        "flagged_phrases": sum(1 for _ in find_phrases(root / name for name in PROSE)),
        "readme_lines": readme.count("\n"),
        "readme_words": len(readme.split()),
        "training_file_lines": len(training.splitlines()),
        "minimal_task_lines": len(task.splitlines()),
        "test_lines_per_line": round(tests / max(1, sum(lines.values())), 2),
        "longest_module": [lines[longest], longest.relative_to(root).as_posix()],
        "modules_without_test": modules_without_test(root),
    }


def find_importers(root: Path) -> defaultdict[str, set[str]]:
    """Return the importers, in package and benchmarks, of each module of the package."""
    known = {_module(root, path) for path in _read(root, "drone_rl")}
    importers = defaultdict(set)
    for path, text in (_read(root, "drone_rl") | _read(root, "benchmarks")).items():
        importer = _module(root, path)
        for name in _imported(ast.parse(text), importer, is_package=path.name == "__init__.py"):
            if name in known and name != importer:
                importers[name].add(importer)
    return importers


def find_phrases(paths: Iterable[Path]) -> Iterator[Phrase]:
    """Yield the phrases to rewrite in files and in all files below folders."""
    for root in paths:
        for path in [root] if root.is_file() else sorted(root.rglob("*")):
            if path.suffix not in _SUFFIXES:
                continue
            for number, line in _prose(path):
                for pattern, advice in _PHRASES:
                    for match in pattern.finditer(line):
                        yield Phrase(path, number, match.group(), advice)


def _prose(path: Path) -> Iterator[tuple[int, str]]:
    """Yield numbered lines; of Python only comments and strings with a space."""
    text = path.read_text(errors="replace")
    if path.suffix != ".py":
        yield from enumerate(text.splitlines(), 1)
        return
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        is_text = token.type == tokenize.STRING and " " in token.string
        if is_text or token.type == tokenize.COMMENT:
            for i, line in enumerate(token.string.splitlines()):
                yield token.start[0] + i, line.strip()


def _imported(tree: ast.Module, importer: str, *, is_package: bool) -> Iterator[str]:
    """Yield the names of imported modules and of the names imported from them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = [] if not node.level else importer.split(".")
            up = node.level - is_package
            parts = parts[: len(parts) - up] if up > 0 else parts
            base = ".".join([*parts, *filter(None, [node.module])])
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names)


def _read(root: Path, folder: str) -> dict[Path, str]:
    return {path: path.read_text() for path in sorted((root / folder).rglob("*.py"))}


def _module(root: Path, path: Path) -> str:
    name = ".".join(path.relative_to(root).with_suffix("").parts)
    return name.removesuffix(".__init__")


def _depth(root: Path, path: Path) -> int:
    return len(path.relative_to(root).parts)


def main(paths: list[str]) -> None:
    """Print the counts, or the phrases below paths."""
    if not paths:
        print(json.dumps(measure(), indent=1))
    for found in find_phrases(map(Path, paths)):
        print(f"{found.path}:{found.line}: {found.text!r}: write {found.advice}")


if __name__ == "__main__":
    main(sys.argv[1:])
