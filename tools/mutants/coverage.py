"""Tests that can detect a mutation: those that execute the mutated block in a recorded run.

Every test file runs once on the instrumented program without a mutation (`recording`). Its record
is valid until the program or the tests change.
"""

import ast
import dataclasses
import hashlib
import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tools.mutants import forks, results, targets
from tools.mutants.blocks import block_at, blocks, module_name
from tools.mutants.worklist import Mutant

BUDGET_S = 20.0
"""Greatest processor time of the tests of one stage without a mutation; fast tests come first."""
WHOLE_FILE_S = 3.0
"""A test file that takes less is run as a whole in the second stage."""
TIME_FACTOR = 3.0
"""Limit of a mutant's processor time, relative to the tests without a mutation, plus START_S."""
START_S = 8.0
COMPILING_S = 120.0
"""Additional limit for a mutant of a Warp kernel."""
RECORD_S = 900.0


@dataclasses.dataclass(frozen=True)
class Chosen:
    """Test files or single tests to run on a mutant, fast ones first."""

    own: tuple[str, ...]
    """Tests of the mutated module."""
    others: tuple[str, ...]
    """Tests to run if `own` have passed."""
    limit_s: float
    """Limit of the processor time of all tests."""


class Coverage:
    """The blocks that every test executes, according to records.

    Args:
        root: The tree.
        records: The records by test file, as `recording` writes them.
    """

    def __init__(self, root: Path, records: dict[str, dict[str, Any]]) -> None:
        self.failed: list[str] = []
        """Tests that fail without a mutation."""
        self._root = root
        self._seconds: dict[str, float] = {}
        self._of_file: dict[str, list[str]] = {}
        self._of_block: dict[str, list[str]] = defaultdict(list)
        self._of_module: dict[str, set[str]] = defaultdict(set)
        for file, record in records.items():
            self._read(file, record)
        self._importers = _importers(root)

    def _read(self, file: str, record: dict[str, Any]) -> None:
        self.failed += record["failed"]
        self._of_file[file] = [test for test, _, _ in record["tests"]]
        self._seconds[file] = sum(seconds for _, seconds, _ in record["tests"])
        for test, seconds, indices in record["tests"]:
            self._seconds[test] = seconds
            for index in indices:
                self._of_block[record["blocks"][index]].append(test)
        for name in record["blocks"]:
            self._of_module[name.partition(":")[0]].add(file)

    def tests_for(self, mutant: Mutant) -> Chosen:
        """Choose the tests of the mutant's module and others that execute its block, if any."""
        module = module_name(mutant.module)
        tree = ast.parse((self._root / mutant.module).read_text())
        block = block_at(tree, module, mutant.spec.start_pos)
        if block is None:
            tests = self._of_import(mutant.module)
            is_compiled = any(other.is_kernel for other in blocks(tree, module))
        else:
            tests, is_compiled = self._of_block.get(block.name, []), block.is_kernel
        files, own = {_file(test) for test in tests}, targets.own_tests(mutant.module)
        first = self._chosen([file for file in own if file in files], tests, BUDGET_S)
        others = sorted(files - set(own), key=self._nearest_to(own[0]))
        second = self._chosen(others, tests, WHOLE_FILE_S)
        total = sum(self._seconds[test] for test in (*first, *second))
        limit = START_S + TIME_FACTOR * total + (COMPILING_S if is_compiled else 0.0)
        return Chosen(first, second, limit)

    def again(self, test: str | None) -> tuple[str, ...]:
        """Return what to run first for a test that killed a mutant before, if it still exists."""
        if test is None or test not in self._seconds or test in self.failed:
            return ()
        file = _file(test)
        return (file,) if self._seconds[file] <= WHOLE_FILE_S else (test,)

    def _of_import(self, module: str) -> list[str]:
        """Return the tests of a module and its importers, which cover code that runs at import."""
        name = module_name(module)
        files = set(self._of_module.get(name, ())) | set(targets.own_tests(module))
        files |= {targets.mirror(other) for other in self._importers[name]} | {
            targets.ALL_MODULES_TEST
        }
        return [test for file in sorted(files) for test in self._of_file.get(file, [])]

    def _chosen(self, files: list[str], tests: list[str], whole_s: float) -> tuple[str, ...]:
        """Choose files, or the given tests of slow files, up to the budget; at least one test."""
        chosen, total = [], 0.0
        for file in files:
            of_file = [test for test in tests if _file(test) == file]
            is_whole = self._seconds[file] <= whole_s
            for part in [file] if is_whole else sorted(of_file, key=self._seconds.__getitem__):
                if not chosen or total + self._seconds[part] <= BUDGET_S:
                    chosen.append(part)
                    total += self._seconds[part]
        return tuple(chosen)

    def _nearest_to(self, own: str) -> Any:
        """Return a sort key for test files: of all modules, of the same package, then by time."""
        folder = Path(own).parts[1]
        return lambda file: (
            file != targets.ALL_MODULES_TEST,
            Path(file).parts[1] != folder,
            self._seconds[file],
        )


def record(tree: Path, work: Path, files: list[str], jobs: int) -> Iterator[str]:
    """Record the test files that have no valid record.

    Args:
        tree: The copy of the project.
        work: Folder for records and temporary files.
        files: The test files.
        jobs: Number of parallel processes.

    Yields:
        A line about each file that was run.
    """
    (work / "records").mkdir(exist_ok=True)
    paths = _records(tree, work, files)
    missing = {file: path for file, path in paths.items() if not path.exists()}
    runs = (
        forks.Run(f"record{count}", [file], RECORD_S, record=path)
        for count, (file, path) in enumerate(missing.items())
    )
    for count, outcome in enumerate(forks.run_all(runs, tree, work / "scratch", jobs), 1):
        file = outcome.run.tests[0]
        yield f"{count}/{len(missing)} {outcome.status} {outcome.seconds:5.1f} s {file}"


def read(tree: Path, work: Path, files: list[str]) -> Coverage:
    """Read the records; a file without one, after a timeout or crash, is omitted."""
    paths = _records(tree, work, files)
    return Coverage(tree, {f: json.loads(p.read_text()) for f, p in paths.items() if p.exists()})


def _records(tree: Path, work: Path, files: list[str]) -> dict[str, Path]:
    """Return the path of each test file's record, which depends on program, helpers and file."""
    helpers = [p for p in (tree / "tests").rglob("*.py") if not p.name.startswith("test_")]
    shared = results.digest(tree, ["drone_rl", *(p.relative_to(tree).as_posix() for p in helpers)])
    return {
        file: work / "records" / f"{_short(shared + results.digest(tree, [file]) + file)}.json"
        for file in files
    }


def _importers(root: Path) -> dict[str, set[str]]:
    """Return the paths of the importers of each module, direct or through its package."""
    found: dict[str, set[str]] = defaultdict(set)
    reexported: dict[str, set[str]] = defaultdict(set)
    for path in targets.modules(root):
        for node in ast.walk(ast.parse((root / path).read_text())):
            if not isinstance(node, ast.ImportFrom) or not node.module:
                continue
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            for name in (node.module, *names):
                found[name].add(path)
            if path.endswith("__init__.py"):
                package = module_name(path)
                reexported[node.module] |= {f"{package}.{alias.name}" for alias in node.names}
    for module, names in reexported.items():
        found[module] = found[module].union(*(found[name] for name in names if name in found))
    return found


def _file(test: str) -> str:
    return test.partition("::")[0]


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
