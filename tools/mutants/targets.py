"""Modules to mutate, and test files that can detect the mutations."""

from pathlib import Path

EXCLUDED = ("docs", "examples", "tools", "test_wheel.py", "test_architecture.py")
"""Tests of other code; those of pages and examples start processes without the mutation."""

PACKAGE_TESTS = {
    "drone_rl/config/": "tests/cli/hydra/test_composition_schemas.py",
}
"""Tests of whole packages: this one compares settings in code with those in files."""
ALL_MODULES_TEST = "tests/test_data.py"
"""Checks what all modules define at import."""


def modules(root: Path) -> list[str]:
    """Return the paths of the modules to mutate, relative to the tree.

    Raises:
        ValueError: The tree has no modules.
    """
    package = root / "drone_rl"
    found = [path.relative_to(root).as_posix() for path in sorted(package.rglob("*.py"))]
    if not found:
        raise ValueError(f"{package} has no modules")
    return found


def test_files(root: Path) -> list[str]:
    """Return the paths of the test files to run, relative to the tree."""
    return [
        path.relative_to(root).as_posix()
        for path in sorted((root / "tests").rglob("test_*.py"))
        if path.relative_to(root / "tests").parts[0] not in EXCLUDED
    ]


def own_tests(module: str) -> list[str]:
    """Return the test files of a module: its mirror, and the tests of its package."""
    shared = [file for package, file in PACKAGE_TESTS.items() if module.startswith(package)]
    return [mirror(module), *shared]


def mirror(module: str) -> str:
    """Return the test file of a module: tests/x/test_y.py for drone_rl/x/y.py."""
    path = Path(module)
    folder = Path("tests", *path.parts[1:-1])
    name = path.parent.name if path.stem == "__init__" else path.stem
    return (folder / f"test_{name}.py").as_posix()
