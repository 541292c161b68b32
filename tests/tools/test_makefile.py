"""The files that `make clean` deletes, in a copy."""

import shutil
import subprocess
from pathlib import Path

import pytest

MAKEFILE = Path(__file__).parents[2] / "Makefile"


@pytest.fixture
def make(tmp_path):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    shutil.copy(MAKEFILE, tmp_path)
    for path in ("outputs/train/last.pt", ".venv/x", "site/x", "a/__pycache__/x", "a/kept.py"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("hours")

    def run(target, typed=""):
        command = ["make", "--silent", target]
        done = subprocess.run(
            command, cwd=tmp_path, input=typed, capture_output=True, text=True, check=True
        )
        left = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
        return left - {"Makefile"}, done.stdout

    return run


def test_clean_keeps_results(make):
    assert make("clean")[0] == {"outputs/train/last.pt", "a/kept.py"}


@pytest.mark.parametrize(
    ("typed", "is_deleted"),
    [("y\n", True), ("Y\n", True), ("n\n", False), ("\n", False), ("", False), ("why\n", False)],
)
def test_results_are_deleted_only_after_confirmation(make, typed, is_deleted):
    left, output = make("clean-outputs", typed)
    assert ("outputs/train/last.pt" not in left) == is_deleted
    assert {"a/kept.py", ".venv/x", "site/x"} <= left
    assert "[y/N]" in output and ("deleted" in output) == is_deleted
