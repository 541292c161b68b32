"""`python -m tools.readme [keep | stale]`: see the package."""

import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from benchmarks.airsim import METHODS_1_8
from benchmarks.ledger import Ledger, digest_code
from benchmarks.registry import BENCHMARKS
from drone_rl.flight.airsim.methods import PARTLY, UNSUPPORTED
from tools.readme import rows, settings
from tools.readme.axes import list_axes
from tools.readme.notebook import make_notebook
from tools.readme.packages import list_contracts, list_packages, read_contracts
from tools.readme.tables import (
    list_origins,
    make_headlines,
    make_peers,
    make_robust,
    make_table,
)

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ROOT / "outputs" / "bench"
PLOTS = ("original.png", "peers.png", "scaling.png")
NOTEBOOK = "docs/tutorials/notebook"
"""The page that is also available as a notebook."""
_BLOCK = re.compile(r"(<!-- made: (\w+) -->\n).*?(<!-- /made -->)", re.DOTALL)


def make_blocks(root: Path) -> dict[str, str]:
    """Return the current content of every block by name."""
    ledger, contracts = Ledger(root / "docs" / "results.json"), read_contracts(root)
    figures = ledger.figures
    return {
        "headlines": make_headlines(rows.HEADLINES, figures),
        "main": make_table(rows.MAIN, figures),
        "adversarial": make_table(rows.ADVERSARIAL, figures),
        "verification": make_table(rows.VERIFICATION, figures),
        "flight": make_table(rows.FLIGHT, figures),
        "libraries": make_table(rows.LIBRARIES, figures),
        "tasks": make_table(rows.TASKS, figures),
        "inputs": make_table(rows.INPUTS, figures),
        "worlds": make_table(rows.WORLDS, figures),
        "peers": make_peers(figures),
        "robust": make_robust(figures),
        "origins": list_origins(ledger, BENCHMARKS),
        "axes": list_axes(),
        "packages": list_packages(root / "drone_rl"),
        "contracts": list_contracts(contracts),
        "choices": settings.list_choices(root / "conf"),
        "groups": settings.list_groups(),
        "terms": settings.list_terms(),
        "parts": settings.list_parts(),
        "commands": settings.list_commands(),
        "presets": settings.list_presets(root / "conf"),
        "run_onnx": show_file(root, "examples/run_onnx.py"),
        "recall": show_file(root, "examples/recall.py"),
        "airsim_methods": list_airsim_methods(),
    }


def show_file(root: Path, path: str) -> str:
    """Return a program as a code block with its path as the title."""
    return f'```python title="{path}"\n{(root / path).read_text()}```'


def list_airsim_methods() -> str:
    """Return a row for each method of AirSim's multirotor client 1.8.1: whether it works."""
    lines = ["| method | works |", "| --- | --- |"]
    for name in sorted(METHODS_1_8):
        works = f"partly: {PARTLY[name]}" if name in PARTLY else "yes"
        lines.append(
            f"| `{name}` | {f'no {UNSUPPORTED[name]}' if name in UNSUPPORTED else works} |"
        )
    return "\n".join(lines)


def replace_blocks(text: str, blocks: dict[str, str]) -> str:
    """Replace what is between `<!-- made: NAME -->` and `<!-- /made -->` by the block's content."""
    return _BLOCK.sub(lambda match: f"{match[1]}{blocks[match[2]].strip()}\n{match[3]}", text)


def make_files(root: Path) -> dict[Path, str]:
    """Return the current content of every file with generated content."""
    blocks = make_blocks(root)
    pages = {page: page.read_text() for page in [root / "README.md", *root.glob("docs/**/*.md")]}
    notebook = root / f"{NOTEBOOK}.ipynb"
    return {
        **{page: replace_blocks(text, blocks) for page, text in pages.items()},
        notebook: make_notebook(notebook.with_suffix(".md").read_text()),
    }


def keep(measured: Path, docs: Path) -> list[str]:
    """Copy new figures and plots of benchmarks; return the benchmarks and plots."""
    source, target = Ledger(measured / "results.json"), Ledger(docs / "results.json")
    for name, origin in source.origins.items():
        target.add(name, source.of(name), origin)
    plots = [name for name in PLOTS if (measured / name).exists()]
    for name in plots:
        shutil.copyfile(measured / name, docs / name)
    return [*source.origins, *plots]


def report_ages(ledger: Ledger, root: Path) -> Iterator[str]:
    """Yield a line for each benchmark: whether its code has changed since the measurement."""
    for name, benchmark in BENCHMARKS.items():
        origin = ledger.origins.get(name)
        if origin is None:
            yield f"{name}: never measured"
            continue
        is_current = origin.code == digest_code(benchmark.measures, root)
        age = "current" if is_current else "OUTDATED, its code has changed since"
        yield f"{name}: measured {origin.date} at {(origin.revision or 'unknown')[:12]}, {age}"


def main(arguments: list[str]) -> int:
    """Run the command and return the exit status."""
    match arguments:
        case ["stale"]:
            print(*report_ages(Ledger(ROOT / "docs" / "results.json"), ROOT), sep="\n")
            return 0
        case ["keep"]:
            print("kept:", ", ".join(keep(MEASURED, ROOT / "docs")))
        case []:
            pass
        case _:
            print(f"error: {' '.join(arguments)!r} is unknown; use keep or stale", file=sys.stderr)
            return 2
    for path, content in make_files(ROOT).items():
        path.write_text(content)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
