"""Which tests can notice a mutation: those that run the mutated block, as a recorded run has shown.

Every file of tests is run once, without any mutation, on a program that reports which of its
blocks run (`recording`). A record is kept until the program or the tests change.
"""

import ast
import dataclasses
import hashlib
import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tools.mutants import forks, kept, targets
from tools.mutants.blocks import block_at, blocks, module_name
from tools.mutants.worklist import Mutant

BUDGET_S = 20.0
"""Processor time that the tests of one stage may take without a mutation; quick ones come first."""
WHOLE_FILE_S = 3.0
"""A file of tests that takes less is run as a whole in the second stage."""
PATIENCE = 3.0
"""A mutant may take so many times the processor time of the tests without it, and START_S."""
START_S = 8.0
COMPILING_S = 120.0
"""More for a mutant of what Warp compiles."""
RECORD_S = 900.0


@dataclasses.dataclass(frozen=True)
class Chosen:
    """Tests to run on a mutant: files, or single tests of them; quick ones first."""

    own: tuple[str, ...]
    """Of the tests of the mutated module."""
    others: tuple[str, ...]
    """To run if those of its own have passed."""
    limit_s: float
    """Processor time for all of them."""


class Reach:
    """What a recorded run has shown of every test.

    Args:
        root: The tree.
        records: What `recording` has written, by file of tests.
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
        for test, seconds, places in record["tests"]:
            self._seconds[test] = seconds
            for place in places:
                self._of_block[record["blocks"][place]].append(test)
        for name in record["blocks"]:
            self._of_module[name.partition(":")[0]].add(file)

    def tests_for(self, mutant: Mutant) -> Chosen:
        """Chooses the tests of its module, and others that run its block; none if none does."""
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
        limit = START_S + PATIENCE * total + (COMPILING_S if is_compiled else 0.0)
        return Chosen(first, second, limit)

    def _of_import(self, module: str) -> list[str]:
        """Tests that may notice what runs at import: those of the module and of its importers."""
        name = module_name(module)
        files = set(self._of_module.get(name, ())) | set(targets.own_tests(module))
        files |= {targets.mirror(other) for other in self._importers[name]} | {targets.OF_ALL}
        return [test for file in sorted(files) for test in self._of_file.get(file, [])]

    def _chosen(self, files: list[str], tests: list[str], whole_s: float) -> tuple[str, ...]:
        """Whole files, of long ones only the given tests, up to the budget; one test at least."""
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
        """Order of files of tests: of all modules, of the same package, then quick ones."""
        folder = Path(own).parts[1]
        return lambda file: (
            file != targets.OF_ALL,
            Path(file).parts[1] != folder,
            self._seconds[file],
        )


def record(tree: Path, work: Path, files: list[str], jobs: int) -> Iterator[str]:
    """Records the files of tests that have changed since they were recorded.

    Args:
        tree: The copy of the project.
        work: Folder of records and of temporary files.
        files: Which tests.
        jobs: Processes at once.

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


def read(tree: Path, work: Path, files: list[str]) -> Reach:
    """Reads records; a file whose run left none (it was too long, or crashed) is left out."""
    paths = _records(tree, work, files)
    return Reach(tree, {f: json.loads(p.read_text()) for f, p in paths.items() if p.exists()})


def _records(tree: Path, work: Path, files: list[str]) -> dict[str, Path]:
    """Where the record of each file of tests is, by what it depends on."""
    helpers = [p for p in (tree / "tests").rglob("*.py") if not p.name.startswith("test_")]
    shared = kept.digest(tree, ["drone_rl", *(p.relative_to(tree).as_posix() for p in helpers)])
    return {
        file: work / "records" / f"{_short(shared + kept.digest(tree, [file]) + file)}.json"
        for file in files
    }


def _importers(root: Path) -> dict[str, set[str]]:
    """Paths of the modules that import each module, by its name, be it by way of its package."""
    found: dict[str, set[str]] = defaultdict(set)
    passed_on: dict[str, set[str]] = defaultdict(set)
    for path in targets.modules(root):
        for node in ast.walk(ast.parse((root / path).read_text())):
            if not isinstance(node, ast.ImportFrom) or not node.module:
                continue
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            for name in (node.module, *names):
                found[name].add(path)
            if path.endswith("__init__.py"):
                package = module_name(path)
                passed_on[node.module] |= {f"{package}.{alias.name}" for alias in node.names}
    for module, names in passed_on.items():
        found[module] = found[module].union(*(found[name] for name in names if name in found))
    return found


def _file(test: str) -> str:
    return test.partition("::")[0]


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
