import hashlib
import json

import pytest

from benchmarks.mutants import bench_mutants
from drone_rl.utils.errors import InputError

OUTCOMES = ("killed", "killed", "timeout", "survived", "equivalent", "equivalent")


@pytest.fixture
def checkout(tmp_path):
    """Return a checkout with a module of one line and a list of six mutants of it."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "module.py").write_text("one = 1\n")
    digest = hashlib.sha256(b"one = 1\n").hexdigest()
    kept = {
        "revision": "abc",
        "modules": {"module.py": digest},
        "first_score": 0.6,
        "score": 1.0,  # ignored: the score is counted again
        "mutants": [{"outcome": outcome} for outcome in OUTCOMES],
    }
    (tmp_path / "docs" / "mutants.json").write_text(json.dumps(kept))
    return tmp_path


def test_equivalent_mutants_are_not_counted_and_timeouts_are_killed(checkout):
    assert bench_mutants(checkout) == {
        "mutation_score": 0.75,
        "mutation_score_at_first_sight": 0.6,
        "mutants_sampled": 6,
        "mutants_killed": 3,
        "mutants_equivalent": 2,
        "mutants_revision": "abc",
    }


def test_a_changed_or_missing_module_makes_the_list_stale(checkout):
    (checkout / "module.py").write_text("one = 2\n")
    with pytest.raises(InputError, match=r"changed since .*module\.py"):
        bench_mutants(checkout)
    (checkout / "module.py").unlink()
    with pytest.raises(InputError, match=r"module\.py"):
        bench_mutants(checkout)


def test_the_error_for_a_missing_list_names_the_command(tmp_path):
    with pytest.raises(InputError, match="make mutants"):
        bench_mutants(tmp_path)
