"""The judge of answers to mistakes, and a sample of the list."""

import pytest

from benchmarks import mistakes
from benchmarks.mistakes import find_fault, read_cases, run_all
from tests.forked import run_module_forked

GOOD = "error: sed=1 is unknown; did you mean seed=1?\n"


def fault(stderr=GOOD, status=2, stdout="", line="train sed=1"):
    return find_fault(status, stdout, stderr, line, ["seed=1"])


def test_one_line_with_the_remedy_is_right():
    assert fault() == ""
    assert fault(GOOD + "usage: drone-rl COMMAND\n") == ""
    assert fault("error: Config seed=1\n", line="train Config=1") == ""


@pytest.mark.parametrize(
    ("given", "wrong"),
    [
        ({"status": 0}, "status 0"),
        ({"stderr": "Traceback (most recent call last):\n" + GOOD}, "a traceback"),
        ({"stdout": "Traceback (most recent call last):\n"}, "a traceback"),
        ({"stderr": GOOD + "and more\n"}, "printed 2 lines"),
        ({"stderr": GOOD + "usage: a\nusage: b\n"}, "printed 3 lines"),
        ({"stderr": ""}, "printed"),
        ({"stderr": "seed=1\n"}, "no error"),
        ({"stderr": "error: sed=1 is unknown\n"}, "lacks: seed=1"),
        *(
            ({"stderr": f"error: {word}; type seed=1\n"}, "words that users do not know")
            for word in (
                *("Key 'sed' is not in struct", "use +sed=1 to append", "Could not override"),
                *("missing EQUAL at '<EOF>'", "TrainCommandSchema", "a ListConfig", "the lexer"),
            )
        ),
    ],
)
def test_every_other_answer_is_a_fault(given, wrong):
    assert wrong in fault(**given)


def test_the_list_is_long_and_without_repetition():
    lines = [line for line, *_ in read_cases()]
    assert len(lines) >= 120 and len({*lines}) == len(lines)
    assert all(words for _, *words in read_cases())


def test_a_sample_is_answered(tmp_path, monkeypatch):
    monkeypatch.setattr(mistakes.subprocess, "run", run_module_forked)
    outcomes = run_all(tmp_path, every=15)
    assert len(outcomes) == len(read_cases()[::15])
    assert [o for o in outcomes if o["wrong"]] == []
