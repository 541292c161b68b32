"""Record the blocks that each test executes, and its processor time, with a pytest plug-in."""

import builtins
import importlib.machinery
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tools.mutants.blocks import CALLBACK, instrument


class InstrumentingLoader(importlib.machinery.SourceFileLoader):
    """Load a module in instrumented form."""

    def get_code(self, fullname: str) -> Any:
        """Compile the instrumented syntax tree with the file's name and line numbers."""
        source = Path(self.path).read_text()
        return compile(instrument(source, fullname), self.path, "exec", dont_inherit=True)


class InstrumentingFinder:
    """Find the modules of one package and instrument them."""

    def __init__(self, package: str) -> None:
        self.package = package

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        """Return the spec of a module of the package, with the instrumenting loader."""
        if fullname.partition(".")[0] != self.package:
            return None
        found = importlib.machinery.PathFinder.find_spec(fullname, path)
        if found is not None and isinstance(found.loader, importlib.machinery.SourceFileLoader):
            found.loader = InstrumentingLoader(fullname, str(found.origin))
        return found


class Recorder:
    """A pytest plug-in that records every test of a run."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.hits: set[str] = set()
        self.shared: dict[Any, set[str]] = {}
        """Blocks that fixtures of several tests execute, by fixture."""
        self.shared_s = 0.0
        self.tests: list[dict[str, Any]] = []
        self.failed: set[str] = set()
        self.skipped: set[str] = set()
        setattr(builtins, CALLBACK, self.reached)

    def reached(self, name: str) -> None:
        """Record a block; instrumented code calls this."""
        self.hits.add(name)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        """Record one test."""
        self.hits = set()
        begin = time.process_time()
        result = yield
        hits = self.hits.union(*(self.shared.get(f, set()) for f in _fixtures(item)))
        seconds = time.process_time() - begin
        self.tests.append({"id": item.nodeid, "seconds": seconds, "hits": hits})
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        """Record separately the blocks of a fixture that several tests use."""
        if fixturedef.scope == "function":
            return (yield)
        before, self.hits = self.hits, set()
        begin = time.process_time()
        try:
            return (yield)
        finally:
            self.shared[fixturedef] = self.shared.get(fixturedef, set()) | self.hits
            self.shared_s += time.process_time() - begin
            self.hits = self.hits | before

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Record failures, including those of fixtures, and skipped tests."""
        if not report.passed:
            (self.failed if report.failed else self.skipped).add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        """Write the record."""
        tests = [t for t in self.tests if t["id"] not in self.failed | self.skipped]
        names = sorted(set().union(*(t["hits"] for t in tests)))
        indices = {name: index for index, name in enumerate(names)}
        rows = [
            [t["id"], round(t["seconds"], 3), sorted(indices[name] for name in t["hits"])]
            for t in tests
        ]
        content = {
            "wide_s": self.shared_s,
            "failed": sorted(self.failed),
            "blocks": names,
            "tests": rows,
        }
        self.path.write_text(json.dumps(content))


def record_launches(recorder: Recorder) -> None:
    """Record the function of each launched Warp kernel and the functions that it calls."""
    import warp

    launch, known = warp.launch, {}

    def record_and_launch(kernel: Any, *args: Any, **options: Any) -> Any:
        if kernel not in known:
            known[kernel] = set(_functions(kernel))
        recorder.hits |= known[kernel]
        return launch(kernel, *args, **options)

    warp.launch = record_and_launch


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
