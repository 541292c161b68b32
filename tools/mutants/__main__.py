"""`python -m tools.mutants`: sample mutants, run those without a result, write the list."""

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkResult

from tools.mutants import coverage, forks, results, targets, worklist

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("drone_rl", "conf", "tests", "tools", "pyproject.toml", "README.md", "docs")
OUTCOMES = {"passed": "survived", "failed": "killed", "timeout": "timeout"}


def main() -> int:
    """Run the command; see `--help`."""
    options = _options()
    work = options.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    modules = targets.modules(ROOT)
    if options.only:
        modules = [name for name in modules if any(part in name for part in options.only)]
    head = _head(options, modules)
    tree = _copy(work)
    os.chdir(tree)
    with use_db(str(work / "session.sqlite"), WorkDB.Mode.create) as database:
        _prepare(database, work, tree, modules, head, options.again)
        sample, done, listed = worklist.sample_of(database, tree)
        _print(f"{len(sample)} mutants of {listed} in {len(modules)} modules, {len(done)} done")
        todo = [mutant for mutant in sample if mutant.job not in done]
        tests = targets.test_files(tree)
        if options.only:
            own = {file for module in modules for file in targets.own_tests(module)}
            tests = [file for file in tests if file in own]
        _run(database, todo, tree, work, tests, options)
        done = {
            job: json.loads(result.output)
            for job, result in database.results
            if job in {mutant.job for mutant in sample}
        }
    reasons, harms = results.read_reasons("equivalents"), results.read_reasons("harms")
    rows = [results.row(m, tree, done[m.job], reasons, harms) for m in sample]
    if options.again:
        rows, first = results.merge(options.again, head["modules"], rows)
        head["first_score"] = first
    results.write(options.out, {**head, "listed": listed}, rows)
    _report(rows, reasons)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="seed of the sample")
    parser.add_argument("--sample", type=int, default=1000, help="number of mutants")
    parser.add_argument("--jobs", type=int, default=2, help="number of parallel processes")
    parser.add_argument(
        "--only",
        nargs="*",
        default=[],
        help="parts of module paths: mutate these and run only the tests of their own name",
    )
    parser.add_argument("--again", type=Path, help="an earlier list, to run its survivors only")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "mutants.json")
    parser.add_argument("--work", type=Path, default=ROOT / "outputs" / "mutants")
    options = parser.parse_args()
    options.out = options.out.resolve()
    return options


def _head(options: argparse.Namespace, modules: list[str]) -> dict[str, Any]:
    return {
        "seed": options.seed,
        "sample": options.sample,
        "revision": _revision(),
        "modules": results.hashes(ROOT, modules),
        "tests": results.digest(ROOT, ["tests"]),
    }


def _revision() -> str | None:
    """Return the commit of the tree, with "-dirty" if it has changes; None without git."""
    commands = (["rev-parse", "HEAD"], ["status", "--porcelain", "-uno"])
    try:
        commit, changes = (
            subprocess.run(
                ["git", "-C", str(ROOT), *args], check=True, capture_output=True, text=True
            ).stdout.strip()
            for args in commands
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return commit + ("-dirty" if changes else "")


def _prepare(
    database: WorkDB,
    work: Path,
    tree: Path,
    modules: list[str],
    head: dict[str, Any],
    again: Path | None,
) -> None:
    """Draw a new sample, unless a session of this tree exists, which is then resumed."""
    ids: list[str] = []
    if again is not None:
        rows = json.loads(again.read_text())["mutants"]
        ids = [row["id"] for row in rows if row["outcome"] == "survived"]
    settings = {name: value for name, value in head.items() if name != "revision"}
    key = {**settings, "again": ids, "tree": results.hashes(tree, ["drone_rl", "tools"])}
    state = work / "session.json"
    if state.exists() and json.loads(state.read_text()) == key:
        return
    state.unlink(missing_ok=True)

    def choose(mutants: list[worklist.Mutant]) -> list[worklist.Mutant]:
        if again is not None:
            return [mutant for mutant in mutants if mutant.id in set(ids)]
        return worklist.draw(mutants, tree, head["sample"], head["seed"])

    worklist.fill(database, tree, modules, choose)
    state.write_text(json.dumps(key))


def _run(
    database: WorkDB,
    todo: list[worklist.Mutant],
    tree: Path,
    work: Path,
    tests: list[str],
    options: argparse.Namespace,
) -> None:
    """Record the coverage of each test, then run the tests that cover each mutant.

    The test that killed a mutant in an earlier run comes first.
    """
    memory = work / "killers.json"
    killers = results.read_killers(options.out, memory)
    forks.import_libraries(work / "kernels")
    shutil.rmtree(work / "scratch", ignore_errors=True)
    (work / "scratch").mkdir()
    for line in coverage.record(tree, work, tests, options.jobs):
        _print(line)
    covered = coverage.read(tree, work, tests)
    if covered.failed:
        _print(f"skipped, because they fail without a mutation: {', '.join(covered.failed)}")
    by_id = {mutant.id: mutant for mutant in todo}
    runs = (run for mutant in todo if (run := _make_run(mutant, tree, covered, killers)))
    for count, outcome in enumerate(forks.run_all(runs, tree, work / "scratch", options.jobs), 1):
        mutant = by_id.pop(outcome.run.name)
        result = {"outcome": OUTCOMES[outcome.status], "by": outcome.failing}
        database.set_result(mutant.job, _result(result))
        if outcome.failing:
            killers[mutant.id] = outcome.failing
            memory.write_text(json.dumps(killers))
        if outcome.status == "passed" or count % 20 == 0:
            _print(f"{count}/{len(todo)} {_line(mutant, tree, result)}")
    for mutant in by_id.values():
        result = {"outcome": "survived", "by": None}
        database.set_result(mutant.job, _result(result))
        _print(f"no test covers it: {_line(mutant, tree, result)}")


def _make_run(
    mutant: worklist.Mutant, tree: Path, covered: coverage.Coverage, killers: dict[str, str]
) -> forks.Run | None:
    tests = covered.tests_for(mutant)
    source = mutant.source(tree)
    if source is None or not (tests.own or tests.others):
        return None
    return forks.Run(
        mutant.id,
        tests.own,
        tests.limit_s,
        mutant.module,
        source,
        first=covered.again(killers.get(mutant.id)),
        then=tests.others,
        skip=covered.failed,
    )


def _line(mutant: worklist.Mutant, tree: Path, result: dict[str, Any]) -> str:
    row = results.row(mutant, tree, result, {}, {})
    return f"{row['outcome']} {row['id']} {row['module']}:{row['line']} {row['after']}"


def _result(result: dict[str, Any]) -> WorkResult:
    survived = result["outcome"] == "survived"
    return WorkResult(
        worker_outcome=WorkerOutcome.NORMAL,
        test_outcome=TestOutcome.SURVIVED if survived else TestOutcome.KILLED,
        output=json.dumps(result),
    )


def _copy(work: Path) -> Path:
    """Copy the files that the tests need, so that edits of the tree do not affect the run."""
    tree = work / "tree"
    ignore = shutil.ignore_patterns("__pycache__", ".*")
    for name in COPIED:
        target, source = tree / name, ROOT / name
        shutil.rmtree(target, ignore_errors=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=ignore)
        elif source.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
    return tree


def _report(rows: list[dict[str, Any]], reasons: dict[str, str]) -> None:
    for row in rows:
        if row["outcome"] == "survived":
            print(f"survived {row['id']} {row['module']}:{row['line']} {row['operator']}")
            print(f"    - {row['before']}\n    + {row['after']}")
            print(f"    {row['harm'] or 'no harm is listed in tools/mutants/harms.toml'}")
        if row["id"] in reasons and row["outcome"] in ("killed", "timeout"):
            print(f"listed as equivalent, but killed: {row['id']}", file=sys.stderr)
    counts = Counter(row["outcome"] for row in rows)
    summary = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
    print(f"mutation score {results.score(rows):.3f}: {summary}")


def _print(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
