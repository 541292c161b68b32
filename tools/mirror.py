"""`make count`: lines of test for a line of code, and modules without a test of their own name."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PURE_DATA = {
    **{
        f"config/{name}": "values with bounds; cli/hydra/test_schemas reads and builds each"
        for name in ("networks", "transforms")
    },
}
"""Modules that need no test of their own, and why: what they hold is tried by others' tests."""


def modules_without_test(root: Path = ROOT) -> list[str]:
    """Modules of drone_rl, as "sim/rules", that no tests/sim/test_rules.py mirrors."""
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
    """Lines of all modules of a folder."""
    return sum(len(path.read_text().splitlines()) for path in folder.rglob("*.py"))


def main() -> None:
    """Prints both."""
    code, tests = count_lines(ROOT / "drone_rl"), count_lines(ROOT / "tests")
    print(f"{tests:,} lines of test for {code:,} of code: {tests / code:.2f}")
    missing = modules_without_test()
    print(f"{len(missing)} modules without a test of their own name", *missing, sep="\n  ")


if __name__ == "__main__":
    main()
