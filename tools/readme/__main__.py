"""`python -m tools.readme [keep | stale]`: see the package."""

import shutil
import sys
from pathlib import Path

from benchmarks.ledger import Ledger
from benchmarks.registry import BENCHMARKS
from tools.readme.airsim_methods import list_airsim_methods
from tools.readme.axes import list_axes
from tools.readme.blocks import replace_blocks
from tools.readme.flight_rows import FLIGHT
from tools.readme.headlines import HEADLINES, make_headlines
from tools.readme.library_rows import LIBRARIES
from tools.readme.notebook import make_notebook
from tools.readme.packages import list_contracts, list_packages, read_contracts
from tools.readme.peers import make_peers
from tools.readme.robust import make_robust
from tools.readme.rows import MAIN, PROOF, TRUTH
from tools.readme.settings import (
    list_choices,
    list_commands,
    list_groups,
    list_parts,
    list_presets,
)
from tools.readme.stale import report_ages
from tools.readme.tables import list_figures, list_origins, make_table

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ROOT / "outputs" / "bench" / "results.json"
PLOTS = ("original.png", "peers.png", "scaling.png")
PAGES = (
    "README.md",
    "docs/airsim.md",
    "docs/design.md",
    "docs/learners.md",
    "docs/onnx.md",
    "docs/results.md",
    "docs/robustness.md",
    "docs/settings.md",
    "docs/tutorials/memory.md",
)
"""Pages with generated blocks."""
NOTEBOOK = "docs/tutorials/notebook"
"""The page that is also available as a notebook."""


def make_blocks(root: Path) -> dict[str, str]:
    """Return the current content of every block by name."""
    ledger = Ledger(root / "docs" / "results.json")
    contracts = read_contracts(root)
    tables = {
        "main": MAIN,
        "flight": FLIGHT,
        "adversarial": TRUTH,
        "verification": PROOF,
        "libraries": LIBRARIES,
    }
    return {
        **{name: make_table(rows, ledger.figures) for name, rows in tables.items()},
        "headlines": make_headlines(HEADLINES, ledger.figures),
        "peers": make_peers(ledger.figures),
        "axes": list_axes(),
        "robust": make_robust(ledger.figures),
        "figures": list_figures(ledger),
        "origins": list_origins(ledger, BENCHMARKS),
        "packages": list_packages(root / "drone_rl"),
        "contracts": list_contracts(contracts),
        "choices": list_choices(root / "conf"),
        "groups": list_groups(),
        "parts": list_parts(),
        "commands": list_commands(),
        "presets": list_presets(root / "conf"),
        "run_onnx": show_file(root, "examples/run_onnx.py"),
        "recall": show_file(root, "examples/recall.py"),
        "airsim_methods": list_airsim_methods(),
    }


def show_file(root: Path, path: str) -> str:
    """Return a program as a code block with its path as the title."""
    return f'```python title="{path}"\n{(root / path).read_text()}```'


def make_files(root: Path) -> dict[str, str]:
    """Return the current content of every file with generated content by path."""
    blocks = make_blocks(root)
    files = {path: replace_blocks((root / path).read_text(), blocks) for path in PAGES}
    page = (root / f"{NOTEBOOK}.md").read_text()
    return {**files, f"{NOTEBOOK}.ipynb": make_notebook(page)}


def keep(source: Path, target: Path) -> list[str]:
    """Replace the figures of each measured benchmark; return the names of the benchmarks."""
    measured, kept = Ledger(source), Ledger(target)
    for name, origin in measured.origins.items():
        kept.add(name, measured.of(name), origin)
    return list(measured.origins)


def keep_plots(source: Path, target: Path) -> list[str]:
    """Copy the plots of benchmarks that the documentation shows; return their names."""
    found = [name for name in PLOTS if (source / name).exists()]
    for name in found:
        shutil.copyfile(source / name, target / name)
    return found


def main(arguments: list[str]) -> int:
    """Run the command and return the exit status."""
    if arguments == ["stale"]:
        ledger = Ledger(ROOT / "docs" / "results.json")
        print(*report_ages(BENCHMARKS, ledger, ROOT), sep="\n")
        return 0
    if arguments not in ([], ["keep"]):
        given = " ".join(arguments)
        print(f"error: {given!r} is unknown; use keep, stale or no argument", file=sys.stderr)
        return 2
    if arguments:
        kept = keep(MEASURED, ROOT / "docs" / "results.json")
        print("kept:", ", ".join([*kept, *keep_plots(MEASURED.parent, ROOT / "docs")]))
    for path, content in make_files(ROOT).items():
        (ROOT / path).write_text(content)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
