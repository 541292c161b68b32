"""`python -m tools.mutants`: draws the sample, runs what has no result yet, keeps the list."""

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

from tools.mutants import forks, kept, worklist
from tools.mutants.targets import find_targets

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("drone_rl", "conf", "tests", "tools", "pyproject.toml", "README.md", "docs")
PATIENCE = 3.0
"""A mutant may take so many times the processor time of the tests without it, and START_S."""
START_S = 5.0
OUTCOMES = {"passed": "survived", "failed": "killed", "timeout": "timeout"}


def main() -> int:
    """Runs it; see `--help`."""
    options = _options()
    work = options.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    targets = find_targets(ROOT)
    if options.only:
        targets = {m: t for m, t in targets.items() if any(part in m for part in options.only)}
    head = _head(options, targets)
    tree = _copy(work)
    os.chdir(tree)
    with use_db(str(work / "session.sqlite"), WorkDB.Mode.create) as database:
        _prepare(database, work, tree, targets, head, options.again)
        sample, done, listed = worklist.sample_of(database, tree)
        _say(f"{len(sample)} mutants of {listed} in {len(targets)} modules, {len(done)} done")
        todo = [mutant for mutant in sample if mutant.job not in done]
        _run(database, todo, tree, work, targets, options.jobs)
        done = dict(database.results)
    reasons = kept.equivalents()
    rows = [kept.row(m, tree, done[m.job].output or "", reasons) for m in sample]
    if options.again:
        rows, first = kept.merge(options.again, head["modules"], rows)
        head["first_score"] = first
    kept.write(options.out, {**head, "listed": listed}, rows)
    _report(rows, reasons)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--sample", type=int, default=600, help="how many mutants")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    parser.add_argument("--only", nargs="*", default=[], help="modules, by a part of their path")
    parser.add_argument("--again", type=Path, help="a kept list: its survivors only, now")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "mutants.json")
    parser.add_argument("--work", type=Path, default=ROOT / "outputs" / "mutants")
    options = parser.parse_args()
    options.out = options.out.resolve()
    return options


def _head(options: argparse.Namespace, targets: dict[str, list[str]]) -> dict[str, Any]:
    tests = {test for named in targets.values() for test in named} | {"tests/conftest.py"}
    return {
        "seed": options.seed,
        "sample": options.sample,
        "revision": _revision(),
        "modules": kept.hashes(ROOT, sorted(targets)),
        "tests": kept.hashes(ROOT, sorted(tests)),
    }


def _revision() -> str | None:
    """Commit of the tree, with "-dirty" if it was changed since; None without git."""
    asked = (["rev-parse", "HEAD"], ["status", "--porcelain", "-uno"])
    try:
        commit, changes = (
            subprocess.run(
                ["git", "-C", str(ROOT), *args], check=True, capture_output=True, text=True
            ).stdout.strip()
            for args in asked
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return commit + ("-dirty" if changes else "")


def _prepare(
    database: WorkDB,
    work: Path,
    tree: Path,
    targets: dict[str, list[str]],
    head: dict[str, Any],
    again: Path | None,
) -> None:
    """Draws a new sample, unless the session is one of this very tree, which then goes on."""
    ids: list[str] = []
    if again is not None:
        rows = json.loads(again.read_text())["mutants"]
        ids = [row["id"] for row in rows if row["outcome"] == "survived"]
    plain = {name: value for name, value in head.items() if name != "revision"}
    key = {**plain, "again": ids, "tree": kept.hashes(tree, ["drone_rl", "tools"])}
    state = work / "session.json"
    if state.exists() and json.loads(state.read_text()) == key:
        return
    state.unlink(missing_ok=True)

    def choose(mutants: list[worklist.Mutant]) -> list[worklist.Mutant]:
        if again is not None:
            return [mutant for mutant in mutants if mutant.id in set(ids)]
        return worklist.draw(mutants, tree, head["sample"], head["seed"])

    worklist.fill(database, tree, list(targets), choose)
    state.write_text(json.dumps(key))


def _run(
    database: WorkDB,
    todo: list[worklist.Mutant],
    tree: Path,
    work: Path,
    targets: dict[str, list[str]],
    jobs: int,
) -> None:
    """Runs mutants, and first the tests of their modules without any.

    Raises:
        RuntimeError: Tests fail without a mutation.
    """
    forks.import_libraries()
    scratch = work / "scratch"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    modules = sorted({mutant.module for mutant in todo})
    plain = (forks.Run(f"plain{i}", targets[m], 600.0) for i, m in enumerate(modules))
    limits = {}
    for outcome in forks.run_all(plain, tree, scratch, jobs):
        module = modules[int(outcome.run.name.removeprefix("plain"))]
        if outcome.status != "passed":
            raise RuntimeError(f"tests of {module} fail without a mutation:\n{outcome.output}")
        limits[module] = START_S + PATIENCE * outcome.seconds
        _say(f"{outcome.seconds:5.1f} s for the tests of {module}")
    by_id = {mutant.id: mutant for mutant in todo}
    runs = (
        forks.Run(m.id, targets[m.module], limits[m.module], m.module, m.source(tree) or "")
        for m in todo
    )
    for count, outcome in enumerate(forks.run_all(runs, tree, scratch, jobs), 1):
        mutant = by_id[outcome.run.name]
        database.set_result(mutant.job, _result(outcome))
        if outcome.status == "passed" or count % 20 == 0:
            row = kept.row(mutant, tree, OUTCOMES[outcome.status], {})
            place = f"{row['module']}:{row['line']}"
            _say(f"{count}/{len(todo)} {row['outcome']} {row['id']} {place} {row['after']}")


def _result(outcome: forks.Outcome) -> WorkResult:
    survived = outcome.status == "passed"
    return WorkResult(
        worker_outcome=WorkerOutcome.NORMAL,
        test_outcome=TestOutcome.SURVIVED if survived else TestOutcome.KILLED,
        output=OUTCOMES[outcome.status],
    )


def _copy(work: Path) -> Path:
    """A copy of what the tests need, so that edits and mutations keep out of each other's way."""
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
        if row["id"] in reasons and row["outcome"] in ("killed", "timeout"):
            print(f"listed as equivalent, but killed: {row['id']}", file=sys.stderr)
    counts = Counter(row["outcome"] for row in rows)
    told = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
    print(f"mutation score {kept.score(rows):.3f}: {told}")


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
