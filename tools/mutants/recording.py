"""Which blocks of the program each test runs, and for how long: recorded in a fork, by pytest."""

import builtins
import importlib.machinery
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tools.mutants.blocks import CALLED, counted


class CountedLoader(importlib.machinery.SourceFileLoader):
    """Loads a module of the program so that its blocks report."""

    def get_code(self, fullname: str) -> Any:
        """Compiles the counted syntax tree, under the file's own name and lines."""
        source = Path(self.path).read_text()
        return compile(counted(source, fullname), self.path, "exec", dont_inherit=True)


class CountedFinder:
    """Finds the modules of one package, to be counted."""

    def __init__(self, package: str) -> None:
        self.package = package

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        """Gives a module of the package the other loader."""
        if fullname.partition(".")[0] != self.package:
            return None
        found = importlib.machinery.PathFinder.find_spec(fullname, path)
        if found is not None and isinstance(found.loader, importlib.machinery.SourceFileLoader):
            found.loader = CountedLoader(fullname, str(found.origin))
        return found


class Recorder:
    """A plug-in of pytest that writes down every test of a run."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.hits: set[str] = set()
        self.wide: dict[Any, set[str]] = {}
        """What fixtures run that serve more than one test."""
        self.wide_s = 0.0
        self.tests: list[dict[str, Any]] = []
        self.failed: set[str] = set()
        self.skipped: set[str] = set()
        setattr(builtins, CALLED, self.reached)

    def reached(self, name: str) -> None:
        """What counted code calls."""
        self.hits.add(name)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        """Records one test."""
        self.hits = set()
        begin = time.process_time()
        result = yield
        hits = self.hits.union(*(self.wide.get(f, set()) for f in _fixtures(item)))
        seconds = time.process_time() - begin
        self.tests.append({"id": item.nodeid, "seconds": seconds, "hits": hits})
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        """Keeps apart what a fixture runs that serves more than one test."""
        if fixturedef.scope == "function":
            return (yield)
        before, self.hits = self.hits, set()
        begin = time.process_time()
        try:
            return (yield)
        finally:
            self.wide[fixturedef] = self.wide.get(fixturedef, set()) | self.hits
            self.wide_s += time.process_time() - begin
            self.hits = self.hits | before

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Notes failures, those of fixtures too, and what is skipped, which notices nothing."""
        if not report.passed:
            (self.failed if report.failed else self.skipped).add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        """Writes the record."""
        tests = [t for t in self.tests if t["id"] not in self.failed | self.skipped]
        names = sorted(set().union(*(t["hits"] for t in tests)))
        place = {name: index for index, name in enumerate(names)}
        rows = [
            [t["id"], round(t["seconds"], 3), sorted(place[name] for name in t["hits"])]
            for t in tests
        ]
        kept = {
            "wide_s": self.wide_s,
            "failed": sorted(self.failed),
            "blocks": names,
            "tests": rows,
        }
        self.path.write_text(json.dumps(kept))


def record_launches(recorder: Recorder) -> None:
    """Reports the functions of a Warp kernel, and those that they call, when it is launched."""
    import warp

    launch, known = warp.launch, {}

    def launched(kernel: Any, *args: Any, **options: Any) -> Any:
        if kernel not in known:
            known[kernel] = set(_functions(kernel))
        recorder.hits |= known[kernel]
        return launch(kernel, *args, **options)

    warp.launch = launched


def _functions(kernel: Any) -> Iterator[str]:
    todo, seen = [kernel], set()
    while todo:
        part = todo.pop()
        function = part.func
        if function is None or part in seen:
            continue
        seen.add(part)
        yield f"{function.__module__}:{function.__qualname__.replace('.<locals>', '')}#0"
        if part.adj is not None and getattr(part, "native_snippet", None) is None:
            todo += part.adj.get_references()[2]


def _fixtures(item: Any) -> list[Any]:
    found = item._fixtureinfo.name2fixturedefs
    return [definition for definitions in found.values() for definition in definitions]
