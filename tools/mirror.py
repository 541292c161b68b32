"""Modules without a test of their own name."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PURE_DATA = {
    f"config/{name}": "values with bounds; cli/hydra/test_composition_schemas builds each"
    for name in ("networks", "transforms")
}
"""Modules that need no test of their own name, and the tests that cover them."""


def modules_without_test(root: Path = ROOT) -> list[str]:
    """Return the modules of drone_rl, such as "sim/rules", that lack a tests/sim/test_rules.py."""
    package = root / "drone_rl"
    names = [p.relative_to(package).with_suffix("") for p in sorted(package.rglob("*.py"))]
    return [
        name.as_posix()
        for name in names
        if name.name != "__init__"
        and name.as_posix() not in PURE_DATA
        and not (root / "tests" / name.parent / f"test_{name.name}.py").exists()
    ]


def count_lines(folder: Path) -> int:
    """Return the number of lines of all modules below a folder."""
    return sum(len(path.read_text().splitlines()) for path in folder.rglob("*.py"))
