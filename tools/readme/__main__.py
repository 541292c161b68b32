"""`python -m tools.readme [keep | stale]`: see the package."""

import sys
from pathlib import Path

from drone_rl.bench.ledger import Ledger
from tools.readme.blocks import replace_blocks
from tools.readme.layers import draw_layers, list_packages, read_contracts
from tools.readme.stale import tell_ages
from tools.readme.tables import MAIN, PROOF, TRUTH, make_table

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ROOT / "outputs" / "bench" / "results.json"


def make_readme(root: Path) -> str:
    """README.md as it should be."""
    figures = Ledger(root / "docs" / "results.json").figures
    contracts = read_contracts(root)
    blocks = {
        "truth": make_table(TRUTH, figures),
        "proof": make_table(PROOF, figures),
        "main": make_table(MAIN, figures),
        "packages": list_packages(contracts, root / "drone_rl"),
        "layers": draw_layers(contracts),
    }
    return replace_blocks((root / "README.md").read_text(), blocks)


def keep(source: Path, target: Path) -> list[str]:
    """Takes figures over, each benchmark's in place of its older ones; returns their names."""
    measured, kept = Ledger(source), Ledger(target)
    for name, origin in measured.origins.items():
        kept.add(name, measured.of(name), origin)
    return list(measured.origins)


def main(words: list[str]) -> int:
    """Returns the exit status."""
    if words == ["stale"]:
        from drone_rl.bench.registry import BENCHMARKS  # slow; nothing else needs it

        ledger = Ledger(ROOT / "docs" / "results.json")
        print(*tell_ages(BENCHMARKS, ledger, ROOT / "drone_rl"), sep="\n")
        return 0
    if words not in ([], ["keep"]):
        print(f"error: {' '.join(words)!r} is unknown; use keep, stale or nothing", file=sys.stderr)
        return 2
    if words:
        print("kept:", ", ".join(keep(MEASURED, ROOT / "docs" / "results.json")))
    (ROOT / "README.md").write_text(make_readme(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
