"""Run pages, each in a copy of the checkout, and count their blocks."""

import collections
import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tools.docs.blocks import ROOT, find_pages, read_blocks
from tools.docs.rules import read_rules, rules_for
from tools.docs.session import FAILED, NOT_RUN, OTHER_NUMBERS, SMALLER, Outcome

COPIED = ("drone_rl", "conf", "docs", "examples", "benchmarks", "tools", "README.md")
RESULTS = ROOT / "outputs" / "docs"
"""Outcomes of each page, so that a run that was stopped continues."""
PROGRAM = "drone_rl.cli.main"


def run_page(page: str, results: Path = RESULTS, root: Path = ROOT) -> list[Outcome]:
    """Run a page, or return the outcomes of an earlier run of the same page and code.

    Args:
        page: Path of the page, relative to the checkout.
        results: Folder of the outcomes.
        root: Folder of the checkout.

    Raises:
        RuntimeError: The page could not be run at all.
    """
    if not read_blocks(page, root):
        return []
    name = page.removesuffix(".md").replace("/", "_")
    kept, digest = results / f"{name}.json", _digest(page, root)
    if kept.exists():
        content = json.loads(kept.read_text())
        if content["digest"] == digest:
            return [Outcome(**outcome) for outcome in content["outcomes"]]
    outcomes = _run_in_copy(page, results / name, root)
    if not any(outcome.status == FAILED for outcome in outcomes):
        text = json.dumps({"digest": digest, "outcomes": [vars(o) for o in outcomes]}, indent=1)
        kept.write_text(text)
    return outcomes


def measure(pages: Iterable[str] = ()) -> dict[str, Any]:
    """Run pages and return the counts of `drone-rl bench docs`.

    Args:
        pages: Paths of pages, relative to the checkout; if empty, all.

    Raises:
        RuntimeError: A block failed.
    """
    outcomes = {page: run_page(page) for page in pages or find_pages()}
    failures = describe_failures(outcomes)
    if failures:
        raise RuntimeError("; ".join(failures))
    every = [outcome for found in outcomes.values() for outcome in found]
    count = collections.Counter(outcome.status for outcome in every)
    return {
        "docs_blocks": len(every),
        "docs_blocks_run": len(every) - count[NOT_RUN],
        "docs_blocks_smaller": count[SMALLER],
        "docs_blocks_other_numbers": count[OTHER_NUMBERS],
        "docs_pages": len(outcomes),
    }


def describe_failures(outcomes: dict[str, list[Outcome]]) -> list[str]:
    """Return page, line, code and reason of each block that failed."""
    return [
        f"{page}:{outcome.line}: {outcome.code}: {outcome.why}"
        for page, found in outcomes.items()
        for outcome in found
        if outcome.status == FAILED
    ]


def copy_checkout(folder: Path, root: Path = ROOT) -> dict[str, str]:
    """Copy the checkout to a folder; return the environment in which `drone-rl` is that of it."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in COPIED:
        source, target = root / name, folder / name
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, target)
    programs = folder / ".bin"
    programs.mkdir()
    for name, words in {"drone-rl": f"-m {PROGRAM} ", "python": ""}.items():
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {words}"$@"\n')
        (programs / name).chmod(0o755)
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "PYTHONPATH": str(folder)}


def _run_in_copy(page: str, folder: Path, root: Path) -> list[Outcome]:
    """Run a page in a new copy of the checkout, in a process of its own."""
    environment = copy_checkout(folder, root)
    command = [sys.executable, "-m", "tools.docs.session", page, "outcomes.json"]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{page}: {done.stderr.strip()[-1000:]}")
    return [Outcome(**entry) for entry in json.loads((folder / "outcomes.json").read_text())]


def _digest(page: str, root: Path) -> str:
    """Return a digest of the page's blocks, its rules and the code that they run."""
    digest = hashlib.sha256(repr((read_blocks(page, root), rules_for(page, read_rules()))).encode())
    files = [*(root / "drone_rl").rglob("*.py"), *(root / "conf").rglob("*.yaml")]
    for file in sorted(files):
        digest.update(file.read_bytes())
    return digest.hexdigest()
