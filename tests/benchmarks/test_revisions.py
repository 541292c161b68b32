"""An earlier revision runs its own files, and ratios above 1 mean a higher cost."""

import json
import subprocess
from pathlib import Path

import pytest

from benchmarks import revisions
from drone_rl.utils.errors import InputError


@pytest.fixture
def checkout(tmp_path):
    """Return a repository whose program writes figures of its own revision."""
    root = tmp_path / "root"
    (root / "drone_rl" / "cli").mkdir(parents=True)
    (root / "drone_rl" / "__init__.py").touch()
    (root / "drone_rl" / "cli" / "__init__.py").touch()
    git = ["git", "-C", str(root), "-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run([*git, "init", "-q"], check=True)
    code = (
        "import json, pathlib, sys\n"
        "folder = next(a.split('=')[1] for a in sys.argv if a.startswith('folder='))\n"
        "target = pathlib.Path(folder) / ('quick' if 'quick=true' in sys.argv else '')\n"
        "target.mkdir(parents=True)\n"
        "(target / 'results.json').write_text(json.dumps(FIGURES))\n"
    )
    for number, figures in enumerate(({"explain_s": 10.0, "collector_fps": 100.0, "other": 1.0},
                                      {"explain_s": 12.0, "collector_fps": 80.0})):  # fmt: skip
        text = code.replace("FIGURES", repr(figures))
        (root / "drone_rl" / "cli" / "main.py").write_text(text)
        subprocess.run([*git, "add", "-A"], check=True)
        subprocess.run([*git, "commit", "-q", "-m", str(number)], check=True)
    return root


@pytest.mark.parametrize("quick", [True, False])
def test_both_revisions_are_measured(checkout, tmp_path, monkeypatch, quick):
    monkeypatch.chdir(tmp_path)
    found = revisions.bench_revisions(Path("out"), quick, before="HEAD~1", root=checkout)
    assert found["ratio_before_after"] == {"explain_s": 1.2, "collector_fps": 1.25}
    pairs = found["revisions"]["pairs"]
    assert pairs[0][0] == {"explain_s": 10.0, "collector_fps": 100.0}
    assert len(pairs) == (1 if quick else 3 * len(revisions.NAMES))
    json.dumps(found)


def test_an_unknown_revision_is_an_error(checkout, tmp_path):
    with pytest.raises(InputError, match="no revision deadbeef"):
        revisions.extract("deadbeef", tmp_path / "tree", checkout)


def test_a_failed_benchmark_is_an_error(checkout, tmp_path):
    (checkout / "drone_rl" / "cli" / "main.py").write_text("raise SystemExit('out of memory')")
    with pytest.raises(RuntimeError, match="out of memory"):
        revisions.measure(checkout, "solve", tmp_path / "out", quick=False)


def test_a_figure_that_only_one_revision_has_is_left_out():
    pair = ({"explain_s": 1.0}, {"explain_s": 2.0, "verdict_s": 3.0})
    assert revisions.compare([pair]) == {"explain_s": 2.0}


def test_a_ratio_is_the_median_of_those_of_pairs():
    """The machine's speed halves and doubles again; 22 / 20 is the median."""
    pairs = [
        ({"explain_s": 10.0}, {"explain_s": 12.0}),
        ({"explain_s": 20.0}, {"explain_s": 22.0}),
        ({"memory": 1.0}, {"memory": 2.0}),
        ({"explain_s": 10.0}, {"explain_s": 10.5}),
    ]
    assert revisions.compare(pairs) == pytest.approx({"explain_s": 1.1})
