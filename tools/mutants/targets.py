"""Which modules are mutated, and which files of tests may notice."""

from pathlib import Path

NOT_RUN = ("docs", "examples", "tools", "test_wheel.py", "test_architecture.py")
"""Tests of other things; those of pages and examples start processes, which see no mutation."""

ALSO = {
    "drone_rl/config/": "tests/cli/hydra/test_composition_schemas.py",
}
"""Tests of whole packages: those that hold settings in code and in files together."""
OF_ALL = "tests/test_data.py"
"""Looks at what all modules define when they are imported."""


def modules(root: Path) -> list[str]:
    """Paths of the modules of drone_rl that are mutated, below the tree.

    Raises:
        ValueError: There are none.
    """
    package = root / "drone_rl"
    found = [path.relative_to(root).as_posix() for path in sorted(package.rglob("*.py"))]
    if not found:
        raise ValueError(f"{package} has no modules")
    return found


def test_files(root: Path) -> list[str]:
    """Paths of the files of tests that are run, below the tree."""
    return [
        path.relative_to(root).as_posix()
        for path in sorted((root / "tests").rglob("test_*.py"))
        if path.relative_to(root / "tests").parts[0] not in NOT_RUN
    ]


def own_tests(module: str) -> list[str]:
    """Files of the tests of a module: its mirror, and what its package is tested by."""
    also = [file for package, file in ALSO.items() if module.startswith(package)]
    return [mirror(module), *also]


def mirror(module: str) -> str:
    """Where the tests of a module are: tests/x/test_y.py for drone_rl/x/y.py."""
    path = Path(module)
    folder = Path("tests", *path.parts[1:-1])
    name = path.parent.name if path.stem == "__init__" else path.stem
    return (folder / f"test_{name}.py").as_posix()
