import threading
import time
from concurrent.futures import ThreadPoolExecutor

from drone_rl.explanations.sections import find_sections
from drone_rl.explanations.threads import Once, aside, is_aside


def test_a_section_is_aside_if_it_says_so():
    @aside
    def section():
        return 3

    assert is_aside(section) and section() == 3
    assert not is_aside(len)


def test_those_aside_are_those_that_ask_neither_worlds_nor_hooks():
    assert [n for n, s in find_sections().items() if is_aside(s)] == [
        "attribution",
        "class_models",
        "embedding",
        "flaws",
    ]


def test_only_the_first_makes_it_and_others_wait():
    once, makers = Once(), []

    def make():
        makers.append(threading.get_ident())
        time.sleep(0.05)
        return object()

    with ThreadPoolExecutor(4) as pool:
        got = list(pool.map(lambda _: once.get(make), range(8)))
    assert len(makers) == 1 and all(one is got[0] for one in got)
