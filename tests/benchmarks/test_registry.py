import re
from pathlib import Path

import pytest

from benchmarks.ledger import digest_code
from benchmarks.registry import BENCHMARKS, GROUPS, find_benchmarks
from drone_rl.utils.errors import InputError


def test_find_benchmarks_expands_groups_and_removes_duplicates():
    assert find_benchmarks([]) == []
    assert find_benchmarks(["solve", "render"]) == ["solve", "render"]
    truth = [n for n, b in BENCHMARKS.items() if b.group == "adversarial"]
    others = [name for name in truth if name != "gamed"]
    assert find_benchmarks(["gamed", "adversarial"]) == ["gamed", *others]
    assert not set(GROUPS) & set(BENCHMARKS)


def test_the_error_for_an_unknown_name_lists_the_known_names():
    with pytest.raises(
        InputError, match=r"'speed' is unknown; use some of: main, adversarial.*render"
    ):
        find_benchmarks(["render", "speed"])


@pytest.mark.parametrize("name", BENCHMARKS)
def test_the_measured_modules_exist(name):
    assert digest_code(BENCHMARKS[name].measures)


def test_the_configuration_documents_every_benchmark_and_group():
    text = (Path(__file__).parents[2] / "conf" / "bench.yaml").read_text()
    assert {name for name in (*GROUPS, *BENCHMARKS) if not re.search(rf"\b{name}\b", text)} == set()
