"""`python -m tools.docs [--update | --time] [PAGE ...]`: see the package."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.docs.blocks import ROOT, find_pages, read_blocks

COPIED = ("drone_rl", "conf", "docs", "examples", "benchmarks", "tools", "README.md")
FLAGS = ("--update", "--time")


def main(arguments: Sequence[str], root: Path = ROOT) -> int:
    """Run pages and return the exit status."""
    all_pages = find_pages(root)
    pages = [word for word in arguments if word not in FLAGS]
    if unknown := sorted({*pages} - {*all_pages}):
        print(f"error: {', '.join(unknown)}: no such page; pages: {', '.join(all_pages)}")
        return 2
    flags = [word for word in arguments if word in FLAGS]
    return max(run_page(page, flags, root) for page in pages or all_pages)


def run_page(page: str, flags: Sequence[str], root: Path) -> int:
    """Run a page in a new copy of the checkout, in a process of its own; return its exit status.

    Args:
        page: Path of the page, relative to the checkout.
        flags: "--update" or "--time".
        root: Folder of the checkout.
    """
    if not read_blocks(page, root):
        return 0
    folder = root / "outputs" / "docs" / page.removesuffix(".md").replace("/", "_")
    shutil.rmtree(folder, ignore_errors=True)
    for name in COPIED:
        copy = shutil.copytree if (root / name).is_dir() else shutil.copy
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        copy(root / name, folder / name)
    programs = folder / ".bin"
    programs.mkdir()
    for name, words in {"drone-rl": "-m drone_rl.cli.main ", "python": ""}.items():
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {words}"$@"\n')
        (programs / name).chmod(0o755)
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(folder)}
    command = [sys.executable, "-m", "tools.docs.session", page, *flags]
    status = subprocess.run(command, cwd=folder, env=environment, check=False).returncode
    if "--update" in flags:
        shutil.copy(folder / page, root / page)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
