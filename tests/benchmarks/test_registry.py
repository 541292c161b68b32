import re
from pathlib import Path

import pytest

from benchmarks.ledger import digest_code
from benchmarks.registry import BENCHMARKS, GROUPS, find_benchmarks
from drone_rl.utils.errors import InputError


def test_words_name_benchmarks_and_groups_each_once():
    assert find_benchmarks([]) == []
    assert find_benchmarks(["solve", "render"]) == ["solve", "render"]
    truth = [n for n, b in BENCHMARKS.items() if b.group == "truth"]
    others = [name for name in truth if name != "hostile"]
    assert find_benchmarks(["hostile", "truth"]) == ["hostile", *others]
    assert not set(GROUPS) & set(BENCHMARKS)


def test_an_unknown_word_is_answered_by_the_known_ones():
    with pytest.raises(InputError, match=r"'speed' is unknown; use some of: main, truth.*render"):
        find_benchmarks(["render", "speed"])


@pytest.mark.parametrize("name", BENCHMARKS)
def test_what_is_measured_is_there(name):
    assert digest_code(BENCHMARKS[name].measures)


def test_the_settings_name_every_benchmark_and_group():
    text = (Path(__file__).parents[2] / "conf" / "bench.yaml").read_text()
    assert {name for name in (*GROUPS, *BENCHMARKS) if not re.search(rf"\b{name}\b", text)} == set()
